"""Room for one more connection: whoever is not paired can take up none that others need.

This computer and the network are counted apart, so the chair's own screen always finds room. In the network, the oldest
connection that is not paired makes room for a newer one: a paired device shows its token with its first frame, and a
flood of strangers ends strangers only.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from sara_hmi.config.config import NetworkConfig


class Held(NamedTuple):
    """A connection that there is: its number, growing with time; the address of its other end; whether that is this
    computer; whether it is known who it is.
    """

    number: int
    peer: str | None
    local: bool
    known: bool


def room(held: Sequence[Held], peer: str | None, local: bool, limits: NetworkConfig) -> tuple[bool, int | None]:
    """(whether another connection from `peer` is let in, the number of the one that is ended for it or None)."""
    beside = [one for one in held if one.local == local]
    strangers = [one.number for one in beside if not one.known]
    ended = min(strangers) if not local and len(strangers) >= limits.strangers else None
    beside = [one for one in beside if one.number != ended]
    of_peer = sum(one.peer == peer for one in beside)
    may = len(beside) < limits.connections and of_peer < limits.connections_per_address
    return may, ended if may else None
