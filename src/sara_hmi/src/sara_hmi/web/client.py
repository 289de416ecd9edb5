"""One client's WebSocket: sends what waits for it, as fast as it takes it."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator
from typing import Any

from aiohttp import WSMessage, web

from sara_hmi.config.config import LimitsConfig
from sara_hmi.protocol.outbox import Outbox

BUFFER_BYTES = 32768  # that the kernel keeps for a slow client
LOOK_S = 0.02  # how often a full socket is looked at
SEGMENT_BYTES = 1448  # as in an Ethernet


def local_socket(port: int) -> socket.socket:
    """Where this computer's own pages connect. Segments are small, as loopback's own of 64 kB do not fit twice into the
    buffer: each would wait 40 ms for its acknowledgement, and a large map would hold up the states. Raises OSError
    where the port is taken.
    """
    made = socket.create_server(('127.0.0.1', port))
    made.setsockopt(socket.IPPROTO_TCP, socket.TCP_MAXSEG, SEGMENT_BYTES)
    return made


class Client:
    """A WebSocket and its Outbox. Frames are texts, bytes, or for the map a pair of both. peer: its address."""

    def __init__(
        self,
        socket_: web.WebSocketResponse,
        transport: asyncio.Transport,
        limits: LimitsConfig,
        peer: str | None,
        outbox: Outbox | None = None,
    ) -> None:
        self._socket, self._transport, self._unsent, self.peer = socket_, transport, limits.unsent_bytes, peer
        self.outbox = Outbox(limits.urgent_frames) if outbox is None else outbox
        self._news = asyncio.Event()
        self._closing = False
        held = transport.get_extra_info('socket')
        if held is not None:
            with contextlib.suppress(OSError):
                held.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
                held.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, BUFFER_BYTES // 2)

    def answer(self, text: str) -> None:
        """A frame that must arrive. A client that takes none of so many is cut off."""
        if not self.outbox.answer(text):
            self.cut()
        self._news.set()

    def put(self, kind: str, frame: Any) -> None:
        """A frame that replaces an older one of its kind."""
        self.outbox.put(kind, frame)
        self._news.set()

    def wake(self) -> None:
        """Something new may wait in the outbox."""
        self._news.set()

    def close(self) -> None:
        """End the connection once the answers that wait have gone."""
        self._closing = True
        self._news.set()

    def cut(self) -> None:
        """End the connection now, whatever waits."""
        self._transport.abort()

    @property
    def is_ending(self) -> bool:
        """Whether the connection is as good as gone."""
        return self._transport.is_closing()

    async def messages(self) -> AsyncIterator[WSMessage]:
        """What the client sends, until the connection ends. Answers go out between messages that come at once, or more
        of them would wait than a client may have.
        """
        async for message in self._socket:
            yield message
            await asyncio.sleep(0)

    async def pump(self) -> None:
        """Send until the connection ends."""
        while not self._socket.closed and not self._transport.is_closing():
            full = self._transport.get_write_buffer_size() > self._unsent
            frame = self.outbox.take(urgent_only=full or self._closing)
            if frame is not None:
                await self._send(frame)
            elif self._closing:
                await self._socket.close(code=1008)
            elif full:
                await asyncio.sleep(LOOK_S)
            else:
                self._news.clear()
                await self._news.wait()

    async def _send(self, frame):
        with contextlib.suppress(ConnectionError, RuntimeError):  # it ends just now; the reading side sees that, too
            if isinstance(frame, str):
                await self._socket.send_str(frame)
            elif isinstance(frame, bytes):
                await self._socket.send_bytes(frame)
            else:
                await self._socket.send_str(frame[0])
                await self._socket.send_bytes(frame[1])
