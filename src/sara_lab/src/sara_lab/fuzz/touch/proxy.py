"""A network between pages and the server that can be slow, held, or cut: a TCP proxy on this computer."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
import time
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from typing import Any

from sara_lab.fuzz.touch.tap import Tap

SLOW_BUFFER = 4096  # bytes that a slow network takes at once
SLICE_S = 0.1
PATIENCE_S = 60.0


class Proxy:
    """Forwards each connection to a port of this computer. up, down: cleared, they hold what comes from the page and
    what comes from the server. rate: bytes/s to the page, None: as fast as they come. taps: what each connection says.
    """

    def __init__(self, port: int, rate: float | None = None) -> None:
        self._port, self._rate = port, rate
        self.up, self.down = asyncio.Event(), asyncio.Event()
        self.up.set()
        self.down.set()
        self._writers: set[asyncio.StreamWriter] = set()
        self._tasks: set[asyncio.Task] = set()
        self.taps: list[Tap] = []

    async def __aenter__(self) -> Proxy:
        self._server = await asyncio.start_server(self._serve, '127.0.0.1', 0)
        self.url = f'http://127.0.0.1:{self._server.sockets[0].getsockname()[1]}'
        return self

    async def __aexit__(self, *_) -> None:
        self._server.close()
        self.abort()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def abort(self) -> None:
        """Close every connection at both ends, at once; what was held is lost."""
        for writer in self._writers:
            writer.transport.abort()

    async def _serve(self, reader, writer):
        self._tasks.add(asyncio.current_task())
        upstream = socket.socket()
        if self._rate is not None:
            upstream.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, SLOW_BUFFER)
        upstream.setblocking(False)
        with contextlib.suppress(ConnectionError):
            await asyncio.get_running_loop().sock_connect(upstream, ('127.0.0.1', self._port))
            from_server, to_server = await asyncio.open_connection(
                sock=upstream, limit=2**16 if self._rate is None else SLOW_BUFFER // 4
            )
            self._writers |= {writer, to_server}
            self.taps.append(tap := Tap())
            await asyncio.gather(
                self._carry(reader, to_server, self.up, None, tap),
                self._carry(from_server, writer, self.down, self._rate),
            )

    @staticmethod
    async def _carry(reader, writer, gate, rate, tap=None):
        size = 2**16 if rate is None else max(1, int(rate * SLICE_S))
        with contextlib.suppress(ConnectionError):
            while data := await reader.read(size):
                if tap is not None:
                    tap.feed(time.monotonic(), data)
                await gate.wait()
                writer.write(data)
                await writer.drain()
                if rate is not None:
                    await asyncio.sleep(len(data) / rate)
        writer.close()


class Network:
    """Proxies, in a thread of their own."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        threading.Thread(target=self._loop.run_forever, name='network', daemon=True).start()

    def run(self, work: Coroutine) -> Any:
        """Do it there; returns what it returns."""
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(PATIENCE_S)

    def call(self, function: Callable[[], object]) -> None:
        """Call it there."""

        async def work() -> None:
            function()

        self.run(work())

    @contextmanager
    def proxy(self, port: int) -> Iterator[Proxy]:
        """A Proxy for the length of a block."""
        proxy = Proxy(port)
        self.run(proxy.__aenter__())
        try:
            yield proxy
        finally:
            self.call(proxy.abort)
            self.run(proxy.__aexit__())
