"""A rosbridge connection as a WebSocket."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from aiohttp import WSMsgType

from sara_hmi.config.config import HmiConfig
from sara_hmi.protocol.limits import Bucket
from sara_hmi.protocol.outbox import Outbox
from sara_hmi.rosbridge import text
from sara_hmi.rosbridge.bridge import Bridge, RosSide
from sara_hmi.web.client import Client


class BridgeOutbox(Outbox):
    """Answers first, then messages of the subscriptions in turn."""

    def __init__(self, urgent: int, bridge: Callable[[], Bridge]) -> None:
        super().__init__(urgent)
        self._bridge = bridge

    def take(self, urgent_only: bool = False) -> Any | None:
        """The next frame, None where nothing waits."""
        frame = super().take(urgent_only)
        return self._bridge().take() if frame is None and not urgent_only else frame


class BridgeConnection:
    """One client: its Bridge, and what waits for it. Called in the server's thread."""

    def __init__(self, config: HmiConfig, role: str, ros: RosSide, make: Callable[[Outbox], Client]) -> None:
        limits = config.limits
        self._bucket = Bucket(limits.frames_per_s, limits.frames_burst)
        self._bridge = Bridge(config.rosbridge, role, ros, self, self._answer)
        self.client = make(BridgeOutbox(limits.urgent_frames, lambda: self._bridge))
        self._loop = asyncio.get_running_loop()
        self._told = False

    def _answer(self, frame: dict[str, Any]) -> None:
        self.client.answer(text.dumps(frame))

    def fail(self, sentence: str) -> None:
        """Something that was asked for cannot be done."""
        self._answer({'op': 'status', 'level': 'error', 'msg': sentence})

    def offer(self, topic: str, form: str, encoded: str | bytes) -> None:
        """A message has come."""
        if self._bridge.offer(self._loop.time(), topic, form, encoded):
            self.client.wake()

    async def serve(self) -> None:
        """Until the client is gone."""
        pump = asyncio.create_task(self.client.pump())
        try:
            async for message in self.client.messages():
                if message.type != WSMsgType.TEXT:
                    self.fail('frames to the server are text')
                elif self._bucket.take(self._loop.time()):
                    self._told = False
                    self._bridge.receive(message.data)
                elif not self._told:
                    self._told = True
                    self.fail('too many frames: some are dropped (limits in config/hmi.yaml)')
        finally:
            self._bridge.end()
            pump.cancel()
