"""A server that speaks the page's protocol (docs/protocol.md) and records what it gets, without a chair behind it.

Everything that a test depends on is done on command: states, places, answers; frames can be held on their way, it can
be silent, and files can be missing. It runs
in a thread of its own; the test's thread calls its methods.
"""

import asyncio
import io
import json
import math
import threading
import time
from concurrent.futures import Future
from pathlib import Path
from typing import NamedTuple

from aiohttp import WSMsgType, web
from PIL import Image, ImageDraw

WWW = Path(__file__).resolve().parents[2] / 'www'
CSP = "default-src 'self'; img-src 'self' data: blob:; connect-src 'self'"
BEAT_S, STATE_S = 0.05, 0.1
NAMES = ['bathroom', 'bedroom', 'childs_room', 'corridor', 'entrance', 'garden', 'kitchen', 'library', 'living_room']
PLACES = {name: [1.0 + k, 2.0 + 0.5 * k, 0.0] for k, name in enumerate(NAMES)}
LIMITS = {'max_forward': 0.8, 'max_reverse': 0.4, 'max_turn': 0.8}
SESSION = 7


class Received(NamedTuple):
    """t: s, when it came; beat: the newest beat that had been sent by then; frame: the JSON object."""

    t: float
    beat: int
    frame: dict


def idle():
    """The state of a chair that stands and is ready."""
    return {
        'op': 'state',
        't': 1_700_000_000_000,
        'pose': [2.0, 3.0, 0.5],
        'lost': False,
        'maps': False,
        'v': 0.0,
        'w': 0.0,
        'gate': {'state': 'IDLE', 'reasons': []},
        'driver': None,
        'goal': None,
        'asked': None,
        'assist': None,
        'battery': {'share': 0.82, 'volts': 25.1},
        'connected': {'odom': True, 'battery': True, 'SDI_range': True, 'SDD_range': False, 'safety_gate/status': True},
        'stopped': False,
    }


def picture():
    """A PNG of a room: (bytes, width, height)."""
    image = Image.new('L', (240, 160), 254)
    ImageDraw.Draw(image).rectangle((4, 4, 235, 155), outline=0, width=3)
    data = io.BytesIO()
    image.save(data, 'PNG')
    return data.getvalue(), image.width, image.height


class FakeChair:
    """`port` is where it listens. See the module's docstring."""

    def __init__(self):
        self._loop = asyncio.new_event_loop()
        self._ready = threading.Event()
        self.reset()
        threading.Thread(target=self._run, daemon=True).start()
        self._ready.wait(10.0)

    def reset(self):
        """As new, but for connections that are open: call it before a page is loaded."""
        self.state = idle()
        self.places = dict(PLACES)
        self.edits = []
        self.role = 'rider'
        self.received = []
        self.requests = []
        self.beat = 0
        self.beat_sent = {}
        self.connections = 0
        self.answers_echo = True
        self.refuses = None
        self.is_silent = False
        self.missing = ()
        self._sockets = getattr(self, '_sockets', set())
        self._open = getattr(self, '_open', None)

    # ---- for the tests
    def frames(self, *ops):
        """The frames received of these ops, in their order."""
        return [r.frame for r in list(self.received) if r.frame.get('op') in ops]

    def wait(self, what, timeout=20.0):
        """Wait until `what()` is true; returns its value."""
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            value = what()
            if value:
                return value
            time.sleep(0.005)
        raise AssertionError(f'nothing like it within {timeout} s; received: {[r.frame for r in self.received[-8:]]}')

    def wait_for(self, *ops, count=1):
        """Wait until `count` frames of these ops have come; returns them."""
        return self.wait(lambda: len(self.frames(*ops)) >= count and self.frames(*ops))

    def send(self, frame):
        """Send a frame to all pages."""
        self._call(self._send_all(frame))

    def hold(self):
        """Frames from the page pile up on their way from now on."""
        self._loop.call_soon_threadsafe(self._open.clear)

    def let_through(self):
        """What piled up comes in a burst."""
        self._loop.call_soon_threadsafe(self._open.set)

    def cut(self):
        """Every connection breaks."""
        self._call(self._cut())

    def _call(self, coroutine):
        future: Future = asyncio.run_coroutine_threadsafe(coroutine, self._loop)
        return future.result(10.0)

    # ---- the server
    def _run(self):
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._begin())
        self._ready.set()
        self._loop.run_forever()

    async def _begin(self):
        self._open = asyncio.Event()
        self._open.set()
        app = web.Application()
        app.router.add_get('/ws', self._socket)
        app.router.add_get('/{path:.*}', self._file)
        runner = web.AppRunner(app)
        await runner.setup()
        site = web.TCPSite(runner, '127.0.0.1', 0)
        await site.start()
        self.port = site._server.sockets[0].getsockname()[1]
        self._loop.create_task(self._every(BEAT_S, self._send_beat))
        self._loop.create_task(self._every(STATE_S, self._send_state))

    async def _every(self, period, act):
        while True:
            await act()
            await asyncio.sleep(period)

    async def _send_beat(self):
        if self.state['driver'] is not None:
            self.beat += 1
            self.beat_sent[self.beat] = time.monotonic()
            await self._send_all({'op': 'beat', 'n': self.beat})

    async def _send_state(self):
        await self._send_all(self.state)

    async def _send_all(self, frame):
        for socket in list(self._sockets):
            if not (socket.closed or self.is_silent):
                await socket.send_str(json.dumps(frame))

    async def _cut(self):
        self.state['driver'] = None
        for socket in list(self._sockets):
            await socket.close()

    async def _file(self, request):
        self.requests.append(request.path)
        path = WWW / (request.match_info['path'] or 'index.html')
        if not path.is_file() or path.name in self.missing:
            return web.Response(status=404)
        headers = {'Content-Security-Policy': CSP, 'Cache-Control': 'no-cache'}
        if path.suffix == '.webmanifest':
            headers['Content-Type'] = 'application/manifest+json'
        return web.FileResponse(path, headers=headers)

    async def _socket(self, request):
        socket = web.WebSocketResponse()
        await socket.prepare(request)
        self.connections += 1
        try:
            async for message in socket:
                await self._open.wait()
                if message.type == WSMsgType.TEXT:
                    frame = json.loads(message.data)
                    self.received.append(Received(time.monotonic(), self.beat, frame))
                    await self._answer(socket, frame)
        finally:
            self._sockets.discard(socket)
            if not self._sockets:
                self.state['driver'] = None
        return socket

    async def _answer(self, socket, frame):
        answer = None if self.is_silent else getattr(self, f'_on_{frame["op"]}', None)
        for reply in answer(frame) if answer else ():
            if isinstance(reply, bytes):
                await socket.send_bytes(reply)
            else:
                await socket.send_str(json.dumps(reply))
        if frame['op'] == 'hello':
            self._sockets.add(socket)

    def _on_hello(self, frame):
        welcome = {'op': 'welcome', 'session': SESSION, 'role': self.role, 'version': frame['version']}
        if self.role == 'none':
            return [welcome]
        data, width, height = picture()
        profiles = ['gentle', 'standard', 'brisk']
        welcome |= {
            'driver': self.state['driver'],
            'limits': LIMITS,
            'profiles': profiles,
            'profile': 'standard',
            'body': [1.1, 0.6],
        }
        there = {'op': 'map', 'width': width, 'height': height, 'resolution': 0.05, 'origin': [0.0, 0.0, 0.0], 'id': 1}
        sonar = {'pose': [0.5, 0.0, 0.0], 'range': 1.2, 'min': 0.16, 'max': 3.0, 'fov': math.radians(60.0)}
        stop = {'t': 1_700_000_000_000, 'key': 'state.HELD', 'values': {'reason': 'reason.IMPACT'}}
        plan = {'op': 'plan', 'points': [[2.0, 3.0], [4.0, 3.5], [6.0, 5.0]]}
        history = {'op': 'history', 'list': [stop]}
        return [welcome, self._listed(), self._drawn(), there, data, {'op': 'ranges', 'SDI': sonar}, plan, history]

    def _listed(self):
        return {'op': 'places', 'places': self.places}

    def _drawn(self):
        return {'op': 'edits', 'edits': self.edits}

    def _on_edit(self, frame):
        self.edits.append({'kind': frame['kind'], 'points': frame['points']})
        return [self._drawn()]

    def _on_unedit(self, frame):
        self.edits.remove({'kind': frame['kind'], 'points': frame['points']})
        return [self._drawn()]

    def _on_echo(self, frame):
        return [{'op': 'echo', 't': frame['t']}] if self.answers_echo else []

    def _on_take(self, frame):
        self.state['driver'] = SESSION
        return [{'op': 'driver', 'session': SESSION, 'name': ''}]

    def _on_release(self, frame):
        if self.state['driver'] != SESSION:
            return []
        self.state['driver'] = None
        return [{'op': 'driver', 'session': None, 'name': ''}]

    def _on_drive(self, frame):
        why = {'why': self.refuses} if self.refuses else {}
        return [{'op': 'ack', 'seq': frame['seq'], 't': frame['t'], 'ok': not why, **why}]

    def _on_stop(self, frame):
        self.state |= {'stopped': True, 'gate': {'state': 'HELD', 'reasons': ['EMERGENCY_STOP']}, 'goal': None}
        return [self.state]

    def _on_reset(self, frame):
        self.state |= {'stopped': False, 'gate': {'state': 'IDLE', 'reasons': []}}
        return [self.state]

    def _on_go(self, frame):
        self.state['goal'] = {'state': 'going', 'place': frame.get('place', ''), 'pose': [0, 0, 0], 'left': 8.0}
        return [self.state]

    def _on_pause(self, frame):
        if self.state['goal']:
            self.state['goal'] |= {'state': 'paused'}
        return [self.state]

    def _on_resume(self, frame):
        self.state['goal'] |= {'state': 'going'}
        return [self.state]

    def _on_cancel(self, frame):
        place = self.state['goal']['place']
        self.state['goal'] = None
        return [self.state, {'op': 'ended', 'key': 'goal.cancelled', 'values': {'place': place}}]

    def _on_profile(self, frame):
        return [{'op': 'profile', 'profile': frame['name'], 'limits': LIMITS}]

    def _on_help(self, frame):
        self.state['assist'] |= {'profile': frame['name'], 'does': 'OFF' if frame['name'] == 'gate_only' else ''}
        return [self.state]

    def _on_override(self, frame):
        self.state['assist'] |= {'does': 'OVERRIDE', 'left': 20} if frame['on'] else {'does': '', 'left': 0}
        return [self.state]

    def _on_place(self, frame):
        self.places[frame['name']] = frame.get('pose', self.state['pose'])
        return [self._listed()]

    def _on_rename(self, frame):
        self.places[frame['to']] = self.places.pop(frame['name'])
        return [self._listed()]

    def _on_delete(self, frame):
        del self.places[frame['name']]
        return [self._listed()]

    def _on_save_map(self, frame):
        return [{'op': 'saved', 'key': 'event.map_saved', 'values': {}}]

    def _on_pair(self, frame):
        if frame['code'] != 'ABCD-2345':
            return [{'op': 'error', 'key': 'error.code_wrong', 'values': {}, 'of': 'pair'}]
        self.role = 'carer'
        return [{'op': 'paired', 'token': 'a-token', 'role': 'carer'}]

    def _on_invite(self, frame):
        svg = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><path d="M0 0h5v5H0z"/></svg>'
        url = 'https://192.0.2.1:8443/'
        return [{'op': 'invited', 'code': 'ABCD-2345', 'url': url, 'svg': svg, 'until_s': 300.0, 'role': frame['role']}]
