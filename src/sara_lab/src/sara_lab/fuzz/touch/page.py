"""A page of the touch screen as a client without a browser: it drives with commands that can be told apart."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Callable
from typing import Any

import aiohttp

PATIENCE_S = 30.0
DRIVE_S = 0.05  # between two commands: 20 Hz
STEPS = 100000  # commands until one is like an earlier one


async def until(condition: Callable[[], Any], what: str) -> Any:
    """Wait until a condition holds; returns what it returns. Raises TimeoutError, which tells what was waited for."""
    end = time.monotonic() + PATIENCE_S
    while not (found := condition()):
        if time.monotonic() > end:
            raise TimeoutError(f'after {PATIENCE_S:.0f} s still not: {what}')
        await asyncio.sleep(0.002)
    return found


class Page:
    """One connection. states: [(when it came by the monotonic clock, its frame)]; maps: how many came.
    sent: {speed: when its frame was sent}; awake: cleared, it reads nothing.
    """

    def __init__(self, session: aiohttp.ClientSession, url: str, first: int = 0) -> None:
        self._session, self._url = session, url
        self._number, self.seq, self.beat, self._forward = first, 0, 0, 0.0
        self.maps = 0
        self.states: list[tuple[float, dict[str, Any]]] = []
        self.sent: dict[float, float] = {}
        self.awake = asyncio.Event()
        self.awake.set()
        self._reader: asyncio.Task | None = None

    async def __aenter__(self) -> Page:
        self.socket = await self._session.ws_connect(f'{self._url}/ws', max_msg_size=0)
        self._reader = asyncio.create_task(self._read())
        await self.send('hello', version=1)
        await until(lambda: self._forward or self._reader.done(), 'welcome')
        return self

    async def __aexit__(self, *_) -> None:
        self._reader.cancel()
        await self.socket.close()

    @property
    def gone(self) -> bool:
        """Whether the connection has ended."""
        return self._reader.done()

    async def _read(self):
        async for message in self.socket:
            await self.awake.wait()
            if message.type == aiohttp.WSMsgType.BINARY:
                self.maps += 1
                continue
            frame = json.loads(message.data)
            if frame['op'] == 'state':
                self.states.append((time.monotonic(), frame))
            elif frame['op'] == 'beat':
                self.beat = frame['n']
            elif frame['op'] in ('welcome', 'profile'):
                self._forward = frame['limits']['max_forward']

    async def send(self, op: str, **fields: Any) -> None:
        """Send a frame."""
        await self.socket.send_json({'op': op, **fields})

    async def take(self) -> None:
        """Become the driver."""
        await self.send('take')
        await until(lambda: self.beat or self.gone, 'a beat')

    async def drive(self, beat: int | None = None) -> None:
        """One command, of a speed that no other has. beat: the newest, unless it is told."""
        self.seq, self._number = self.seq + 1, self._number + 1
        share = 0.2 + 0.6 * (self._number % STEPS) / STEPS
        self.sent[round(share * self._forward, 9)] = time.monotonic()
        await self.send('drive', seq=self.seq, t=1, n=self.beat if beat is None else beat, v=share, w=0.0)

    async def drive_for(self, seconds: float) -> None:
        """Commands at 20 Hz."""
        due = time.monotonic()
        end = due + seconds
        while due < end:
            await self.drive()
            due = max(due + DRIVE_S, time.monotonic())
            await asyncio.sleep(due - time.monotonic())

    async def halt(self) -> None:
        """The finger is lifted."""
        self.seq += 1
        await self.send('halt', seq=self.seq)
