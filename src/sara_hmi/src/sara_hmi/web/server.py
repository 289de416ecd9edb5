"""The web server: carries out what the hub wants, and shows the robot to everybody who may look.

One thread, one asyncio loop. Other threads speak to it by `post`.
"""

from __future__ import annotations

import asyncio
import ssl
import threading
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from aiohttp import WSMsgType, web

from sara_hmi.config.config import HmiConfig
from sara_hmi.hub.actions import Action, Close, Everyone, Motion, Order, Send, Show, Store, error
from sara_hmi.hub.hub import Hub
from sara_hmi.protocol.frames import NONE
from sara_hmi.protocol.outbox import ORDER
from sara_hmi.rosbridge.bridge import RosSide, on_list
from sara_hmi.web import access, qr
from sara_hmi.web.bridge_socket import BridgeConnection
from sara_hmi.web.client import Client, local_socket
from sara_hmi.web.robot import Robot
from sara_hmi.web.room import Held, room
from sara_hmi.web.screen import Screen, dumps


class Server:
    """hub: the rules. robot: what carries them out. www: the page's folder. store(text): keeps the paired devices.
    url: of the page in the network, for QR codes.
    """

    def __init__(self, config: HmiConfig, hub: Hub, www: Path, store: Callable[[str], None], url: str) -> None:
        self._config, self.hub, self._www, self._store, self._url = config, hub, www, store, url
        self.robot: Robot | None = None
        self.screen = Screen(config.robot, hub, self._put)
        self._clients: dict[int, Client] = {}
        self.ros_side: RosSide | None = None
        self._bridges: dict[BridgeConnection, bool] = {}  # whether it is one of this computer
        self._timer: asyncio.TimerHandle | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._lock, self._early = threading.Lock(), []
        self._names = access.names(config.network, url)

    def post(self, function: Callable[..., None], *arguments: Any) -> None:
        """From any thread: call a function in the server's, once it runs; nothing after it has ended."""
        with self._lock:
            if self._loop is None:
                self._early.append(partial(function, *arguments))
            elif not self._loop.is_closed():
                self._loop.call_soon_threadsafe(function, *arguments)

    # What the robot tells, in the server's thread

    def on_profiles(self, profiles: Mapping[str, Mapping[str, float]], profile: str) -> None:
        """The robot has these speed profiles, and uses one."""
        if profile in profiles:
            self.apply(self.hub.tasks.use_profiles(profiles, profile))

    def on_profile(self, profile: str) -> None:
        """Somebody, perhaps a page, has asked the robot for another profile."""
        self.on_profiles(self.hub.tasks.profiles, profile)

    def on_end(self, number: int, key: str, why: str) -> None:
        """A goal has ended. why: a key, or ""."""
        goal = self.hub.tasks.mission.ended(number)
        if goal is None:
            return
        values = {'place': goal.place or 'goal.unnamed', **({'reason': why} if why else {})}
        self.everyone(dumps({'op': 'ended', 'key': key, 'values': values}))
        if key != 'goal.succeeded':
            self.screen.note(key, values)

    def on_reset(self, client: int, why: str) -> None:
        """The emergency stop is released, or why it is not, as a key."""
        if why:
            self.apply([error(client, why, 'reset')])
            return
        self.hub.driving.stopped = False
        self.screen.note('event.reset', {})

    def on_refusal(self, client: int, key: str, of: str, values: dict[str, Any]) -> None:
        """An order cannot be carried out."""
        self.apply([error(client, key, of, values)])

    # Sending

    def _put(self, kind, frame):
        for number, client in self._clients.items():
            if self._may_look(number):
                client.put(kind, frame)

    def everyone(self, text: str) -> None:
        """A frame that must arrive, to everybody."""
        for number, client in self._clients.items():
            if self._may_look(number):
                client.answer(text)

    def _may_look(self, number):
        known = self.hub.clients.get(number)
        return known is not None and known.role != NONE

    def apply(self, actions: list[Action]) -> None:
        """Do what the hub wants."""
        for action in actions:
            if isinstance(action, Motion):
                self.robot.drive(*self.hub.tasks.speed(action.v, action.w))
            elif isinstance(action, Send):
                if action.client in self._clients:
                    self._clients[action.client].answer(dumps(action.frame))
            elif isinstance(action, Everyone):
                if action.frame['op'] in ORDER:
                    self.screen.show(action.frame)
                else:
                    self.everyone(dumps(action.frame))
            elif isinstance(action, Order):
                self._order(action)
            elif isinstance(action, Close):
                if action.client in self._clients:
                    self._clients[action.client].close()
            elif isinstance(action, Store):
                self._store(action.text)
            else:
                self._invited(action)
        if self._loop is not None:
            self._step_when_due()

    def _order(self, order):
        if order.op == 'catch_up':
            for kind, frame in self.screen.newest.items():
                self._clients[order.client].put(kind, frame)
            return
        if order.op == 'stop':
            self.screen.note('event.stop', {})
        self.robot.order(order)

    def _invited(self, show: Show):
        url = f'{self._url}/#code={show.code}'
        invited = {'op': 'invited', 'code': show.code, 'role': show.role, 'until_s': show.seconds, 'url': url}
        self.apply([Send(show.client, {**invited, 'svg': qr.svg(url)})])

    def _step_when_due(self):
        due = self.hub.due(self._loop.time())
        if self._timer is not None:
            due = min(due, self._timer.when())  # whatever comes meanwhile does not put it off
            self._timer.cancel()
        self._timer = self._loop.call_at(due, self._step)

    def _step(self):
        self._timer = None
        self.apply(self.hub.step(self._loop.time()))

    async def _watch(self, hertz, tick):
        due = self._loop.time()
        while True:
            tick(self.robot)
            due = max(due + 1.0 / hertz, self._loop.time())
            await asyncio.sleep(due - self._loop.time())

    # Connections

    async def page(self, request: web.Request) -> web.StreamResponse:
        """A file of the page; at its root also rosbridge, where roslib looks for it unless it is told a path."""
        if (
            request.path == '/'
            and self.ros_side is not None
            and 'websocket' in request.headers.get('Upgrade', '').lower()
        ):
            return await self.rosbridge(request)
        name = request.match_info.get('name') or 'index.html'
        path = (self._www / name).resolve()
        if not (path.is_relative_to(self._www.resolve()) and path.is_file()):
            raise web.HTTPNotFound()
        return web.FileResponse(path)

    async def websocket(self, request: web.Request) -> web.StreamResponse:
        """A page's connection."""
        network, limits = self._config.network, self._config.limits
        self._make_room(request)
        socket = web.WebSocketResponse(
            max_msg_size=limits.frame_bytes, heartbeat=network.heartbeat_s, compress=False, timeout=1.0
        )
        known = self.hub.connect(self._loop.time(), self._is_local(request))
        client = self._clients[known.number] = Client(socket, request.transport, limits, request.remote)
        pump = None
        try:
            await socket.prepare(request)
            pump = asyncio.create_task(client.pump())
            async for message in client.messages():
                now = self._loop.time()
                if message.type == WSMsgType.TEXT:
                    self.apply(self.hub.receive(now, known.number, message.data))
                else:
                    self.apply(self.hub.refuse(now, known.number, 'error.no_frame'))
        finally:
            self.apply(self.hub.disconnect(known.number))
            del self._clients[known.number]
            if pump is not None:
                pump.cancel()
        return socket

    def _make_room(self, request, origins=()):
        """Refuses pages of foreign hosts, but for these origins, and more connections than there may be."""
        origin = request.headers.get('Origin')
        if not access.same_origin(origin, request.scheme, request.host) and not on_list(origin, origins):
            raise web.HTTPForbidden(text='This page belongs to another computer.')
        held = [
            Held(number, client.peer, self.hub.clients[number].local, self._may_look(number))
            for number, client in self._clients.items()
            if not client.is_ending
        ]
        held += [Held(-1, one.client.peer, local, True) for one, local in self._bridges.items()]
        may, ended = room(held, request.remote, self._is_local(request), self._config.network)
        if not may:
            raise web.HTTPServiceUnavailable(text='Too many pages are open.')
        if ended is not None:
            self._clients[ended].cut()

    async def rosbridge(self, request: web.Request) -> web.StreamResponse:
        """A connection of roslibjs or roslibpy; from the network with ?token=."""
        config = self._config
        self._make_room(request, config.rosbridge.origins)
        role = self.hub.role_of(self._is_local(request), request.query.get('token', ''))
        if role == NONE:
            raise web.HTTPForbidden(text='This device is not paired: pair it, then show its token as ?token=...')
        socket = web.WebSocketResponse(
            max_msg_size=config.rosbridge.frame_bytes, heartbeat=config.network.heartbeat_s, compress=False, timeout=1.0
        )
        await socket.prepare(request)
        make = partial(Client, socket, request.transport, config.limits, request.remote)
        one = BridgeConnection(config, role, self.ros_side, lambda outbox: make(outbox=outbox))
        self._bridges[one] = self._is_local(request)
        try:
            await one.serve()
        finally:
            del self._bridges[one]
        return socket

    @staticmethod
    def _is_local(request):
        return access.is_local(request.remote) and request.scheme == 'http'

    @web.middleware
    async def _guard(self, request, handler):
        if not access.may_call(request.host, self._names):
            raise web.HTTPMisdirectedRequest(text='This computer has another name.')
        return await handler(request)

    def application(self) -> web.Application:
        """The routes."""
        app = web.Application(middlewares=[self._guard], client_max_size=1024)
        app.on_response_prepare.append(_add_headers)
        app.router.add_get('/ws', self.websocket)
        if self.ros_side is not None:
            app.router.add_get('/rosbridge', self.rosbridge)
        app.router.add_get('/', self.page)
        app.router.add_get('/{name:[A-Za-z0-9_][A-Za-z0-9_./-]*}', self.page)
        return app

    async def run(self, end: asyncio.Event, tls: ssl.SSLContext | None, ready: Callable[[int], None]) -> None:
        """Serve until `end`. tls: for the network; None: this computer alone is served. ready(port): it can be reached.
        Raises OSError where a port is taken.
        """
        with self._lock:
            self._loop = asyncio.get_running_loop()
            for call in self._early:
                self._loop.call_soon(call)
            self._early.clear()
        network, robot = self._config.network, self._config.robot
        runner = web.AppRunner(self.application(), access_log=None)
        await runner.setup()
        try:
            await web.SockSite(runner, local_socket(network.port), shutdown_timeout=1.0).start()
            if tls is not None:
                place = network.address, network.tls_port
                await web.TCPSite(runner, *place, shutdown_timeout=1.0, ssl_context=tls).start()
            watches = (
                (robot.state_hz, self.screen.show_state),
                (robot.ranges_hz, self.screen.show_ranges),
                (robot.plan_hz, self.screen.show_plan),
            )
            tasks = [asyncio.create_task(self._watch(*watch)) for watch in watches]
            self._step()
            ready(runner.addresses[0][1])
            await end.wait()
            for task in tasks:
                task.cancel()
        finally:
            self.apply(self.hub.end())
            for client in [*self._clients.values(), *(one.client for one in self._bridges)]:
                client.cut()
            await runner.cleanup()


async def _add_headers(_request, response):
    response.headers.update(access.HEADERS)
