"""The web server's own rules that need no socket."""

import asyncio
from types import SimpleNamespace

import pytest
from aiohttp import ClientSession, test_utils

from sara_hmi.config.config import HmiConfig, NetworkConfig
from sara_hmi.hub.hub import Hub
from sara_hmi.pairing.pairing import Pairing
from sara_hmi.web import access
from sara_hmi.web.server import Server


def test_what_a_robot_tells_before_the_server_runs_is_heard_in_order(tmp_path):
    config = HmiConfig(network=NetworkConfig(port=0))
    hub = Hub(config, Pairing(config.pairing, lambda most: 0, lambda: 'token', ()), lambda: 0.0)
    server = Server(config, hub, tmp_path, lambda text: None, '')
    for tick in ('show_state', 'show_ranges', 'show_plan'):
        setattr(server.screen, tick, lambda robot: None)
    heard = []

    async def run():
        end = asyncio.Event()
        server.post(heard.append, 'places')
        server.post(heard.append, 'profiles')
        server.post(end.set)
        await asyncio.wait_for(server.run(end, None, lambda port: None), 30.0)

    asyncio.run(run())
    server.post(heard.append, 'too late')
    assert heard == ['places', 'profiles']


def test_what_is_due_is_not_put_off_by_what_comes_meanwhile(tmp_path):
    hub, steps = SimpleNamespace(due=lambda t: t + 0.1, step=lambda t: steps.append(t) or []), []

    async def run():
        server = Server(HmiConfig(), hub, tmp_path, lambda text: None, '')
        server._loop = asyncio.get_running_loop()
        while len(steps) < 3:
            server.apply([])
            await asyncio.sleep(0.02)

    asyncio.run(asyncio.wait_for(run(), 30.0))


@pytest.mark.parametrize('host', ['sara', 'SARA:8443', 'chair.local', 'localhost', '10.1.2.3'])
def test_it_answers_to_the_name_that_it_tells(host):
    names = access.names(NetworkConfig(address='Chair.local'), 'https://sara:8443')
    assert access.may_call(host, names) and not access.may_call('elsewhere.org', names)


def test_a_page_whose_frames_come_at_once_gets_every_answer(tmp_path):
    config = HmiConfig()
    count = config.limits.frames_burst - 10
    assert count > config.limits.urgent_frames
    hub = Hub(config, Pairing(config.pairing, lambda most: 0, lambda: 'token', ()), lambda: 0.0)

    async def run():
        server = Server(config, hub, tmp_path, lambda text: None, '')
        server._loop = asyncio.get_running_loop()
        async with (
            test_utils.TestServer(server.application()) as site,
            ClientSession() as session,
            session.ws_connect(site.make_url('/ws')) as page,
        ):
            await page.send_json({'op': 'hello', 'version': 1})
            await asyncio.gather(*(page.send_json({'op': 'echo', 't': k}) for k in range(count)))
            told = []
            while len(told) < count:
                frame = await page.receive_json(timeout=30.0)
                told += [frame['t']] if frame['op'] == 'echo' else []
            assert told == list(range(count))

    asyncio.run(run())
