"""What the hub wants done. A shell sends the frames, and a robot carries out the motions and orders."""

from __future__ import annotations

from typing import Any, NamedTuple


class Send(NamedTuple):
    """A frame to one client, in order."""

    client: int
    frame: dict[str, Any]


class Everyone(NamedTuple):
    """A frame to every client that may look; a newer one of its op replaces it where it still waits."""

    frame: dict[str, Any]


class Close(NamedTuple):
    """The connection is to be ended, once what was sent to it has gone."""

    client: int


class Motion(NamedTuple):
    """What to publish now. v, w: -1 to 1, shares of the profile's limits."""

    v: float
    w: float


class Order(NamedTuple):
    """Something else the robot is to do: op, and what it needs; `client` hears of a failure."""

    client: int
    op: str
    values: tuple = ()


class Store(NamedTuple):
    """The paired devices are to be kept."""

    text: str


class Show(NamedTuple):
    """A pairing code is to be shown to a client on the chair's own screen, for so many seconds."""

    client: int
    code: str
    role: str
    seconds: float


Action = Send | Everyone | Close | Motion | Order | Store | Show


def error(client: int, key: str, of: str = '', values: dict[str, Any] | None = None) -> Send:
    """The frame that says what is refused, and why."""
    return Send(client, {'op': 'error', 'key': key, 'values': values or {}, 'of': of})
