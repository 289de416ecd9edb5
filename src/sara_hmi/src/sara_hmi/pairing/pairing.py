"""Codes and tokens. A code is shown on the chair and counts for some minutes; whoever types it gets a token, which the
device shows from then on. Of tokens only hashes are kept.
"""

from __future__ import annotations

import hashlib
import hmac
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass

from sara_hmi.config.config import ROLES, PairingConfig

ALPHABET = '23456789ABCDEFGHJKMNPQRSTUVWXYZ'  # without 0 O 1 I L
LENGTH = 8  # 31^8 = 8.5e11 codes
DAY = 86400.0
WRONG, PAUSED, NO_CODE = 'error.code_wrong', 'error.code_paused', 'error.code_none'


@dataclass(frozen=True)
class Token:
    """digest: SHA-256 of the token, in hex. until: the date (s since 1970) until which it counts."""

    digest: str
    role: str
    name: str
    until: float


@dataclass(frozen=True)
class Code:
    """letters, without the hyphen. until: s of the steady clock."""

    letters: str
    role: str
    until: float


class StoreError(ValueError):
    """What was stored cannot be read."""


class Pairing:
    """choose(n): a random number below n. secret(): a random token. Both from the system's secure source.

    Times `t` are of the steady clock, `date` is s since 1970.
    """

    def __init__(
        self,
        config: PairingConfig,
        choose: Callable[[int], int],
        secret: Callable[[], str],
        tokens: tuple[Token, ...] = (),
    ) -> None:
        self._config, self._choose, self._secret = config, choose, secret
        self.tokens = list(tokens)
        self._code: Code | None = None
        self._wrong = 0
        self._paused_until = 0.0

    def invite(self, t: float, role: str) -> str:
        """A new code for one device in that role, as XXXX-XXXX; the code before counts no longer."""
        letters = ''.join(ALPHABET[self._choose(len(ALPHABET))] for _ in range(LENGTH))
        self._code, self._wrong = Code(letters, role, t + self._config.code_s), 0
        return f'{letters[:4]}-{letters[4:]}'

    def pair(self, t: float, date: float, typed: str, name: str) -> tuple[Token | None, str]:
        """(the new Token, its secret), or (None, why not). A code counts once."""
        if t < self._paused_until:
            return None, PAUSED
        if self._code is None or t >= self._code.until:
            return None, NO_CODE
        letters = ''.join(letter for letter in typed.upper() if letter.isalnum())
        if not hmac.compare_digest(letters.encode(), self._code.letters.encode()):
            self._wrong += 1
            if self._wrong >= self._config.attempts:
                self._code, self._paused_until = None, t + self._config.pause_s
            return None, WRONG
        role, self._code = self._code.role, None
        secret = self._secret()
        token = Token(digest(secret), role, name, date + self._config.token_days * DAY)
        self.tokens = [held for held in self.tokens if held.until > date][-(self._config.tokens - 1) :] + [token]
        self.tokens = self.tokens[-self._config.tokens :]
        return token, secret

    def known(self, date: float, secret: str) -> Token | None:
        """The Token of a secret, None where it is unknown or too old."""
        wanted = digest(secret)
        found = [held for held in self.tokens if hmac.compare_digest(held.digest, wanted) and held.until > date]
        return found[0] if found else None


def digest(secret: str) -> str:
    """SHA-256 in hex. A token is random, 256 bits: it needs neither salt nor a slow hash."""
    return hashlib.sha256(secret.encode('utf-8', 'surrogatepass')).hexdigest()


def dumps(tokens: list[Token]) -> str:
    """Tokens as the text to store."""
    return json.dumps([asdict(token) for token in tokens], indent=1)


def loads(text: str) -> tuple[Token, ...]:
    """The tokens of a stored text; raises StoreError."""
    try:
        tokens = tuple(Token(**entry) for entry in json.loads(text))
    except (ValueError, TypeError) as error:
        raise StoreError(f'the paired devices cannot be read: {error}') from error
    for token in tokens:
        good = isinstance(token.digest, str) and isinstance(token.name, str) and token.role in ROLES
        if not (good and isinstance(token.until, (int, float))):
            raise StoreError(f'{token} is no paired device')
    return tokens
