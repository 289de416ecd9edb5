"""What a page says, read from the bytes of its connection: frames of its WebSocket as they leave the browser."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, NamedTuple

HEAD_END = b'\r\n\r\n'
TEXT, KEY_BYTES = 1, 4


class Said(NamedTuple):
    """A frame of the page, and when it passed (s)."""

    t: float
    frame: dict[str, Any]


class Tap:
    """One connection's bytes towards the server (RFC 6455, whole text frames). `said`: the page's frames so far."""

    def __init__(self) -> None:
        self._held = b''
        self._begun = False
        self.said: list[Said] = []

    def feed(self, t: float, data: bytes) -> None:
        """Bytes passed at t."""
        self._held += data
        if not self._begun and self._skip_head():
            self._begun = True
        if self._begun:
            self.said += [Said(t, json.loads(text)) for text in self._texts()]

    def _skip_head(self):
        """Whether the request that opens a WebSocket is over; requests of files are passed over."""
        while HEAD_END in self._held:
            head, _, self._held = self._held.partition(HEAD_END)
            if b'upgrade: websocket' in head.lower():
                return True
        return False

    def _texts(self) -> Iterator[str]:
        while len(self._held) >= 2:
            size, start = self._held[1] & 0x7F, 2
            if size == 126:
                start = 4
                size = int.from_bytes(self._held[2:4], 'big')
            elif size == 127:
                raise ValueError('a frame of more than 64 kB')
            end = start + KEY_BYTES + size
            if len(self._held) < end:
                return
            key, masked = self._held[start : start + KEY_BYTES], self._held[start + KEY_BYTES : end]
            if self._held[0] & 0x0F == TEXT:
                yield bytes(byte ^ key[k % KEY_BYTES] for k, byte in enumerate(masked)).decode()
            self._held = self._held[end:]


def page_clock(said: list[Said]) -> float:
    """s from the page's clock (`t` of its commands, ms) to the reader's, by the frame that came soonest."""
    return min(one.t - 1e-3 * one.frame['t'] for one in said if one.frame['op'] == 'drive')


def commands(said: list[Said], limits: dict[str, float]) -> dict[float, float]:
    """{speed (m/s): when the page made the command (s, the reader's clock)}. limits: the profile's, as in `welcome`."""
    clock = page_clock(said)
    return {
        round(one.frame['v'] * limits['max_forward' if one.frame['v'] > 0.0 else 'max_reverse'], 9): clock
        + 1e-3 * one.frame['t']
        for one in said
        if one.frame['op'] == 'drive'
    }
