"""The web server's own rules that need no socket."""

import asyncio

from sara_hmi.config.config import HmiConfig, NetworkConfig
from sara_hmi.hub.hub import Hub
from sara_hmi.pairing.pairing import Pairing
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
