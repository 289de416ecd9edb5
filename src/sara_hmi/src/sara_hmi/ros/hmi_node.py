"""hmi: the touch screen's server as a node."""

from __future__ import annotations

import asyncio
import datetime
import secrets
import socket
import threading
import time
from pathlib import Path

import rospkg
import rospy

from sara_common.config import ConfigError
from sara_common.ros.node import on_shutdown, start_node
from sara_hmi.config.config import HmiConfig, NetworkConfig
from sara_hmi.hub.hub import Hub
from sara_hmi.pairing.pairing import Pairing, StoreError, loads
from sara_hmi.ros.bridge_side import BridgeSide
from sara_hmi.ros.robot import RosRobot
from sara_hmi.web import certificate, qr
from sara_hmi.web.server import Server

END_S = 3.0  # that the server has to say zero and close


def folder() -> Path:
    """Where the certificate and the paired devices are kept."""
    return Path(rospkg.get_ros_home()) / 'sara_hmi'


def own_address(network: NetworkConfig) -> str:
    """The number or name by which the network reaches this computer."""
    if network.address not in ('0.0.0.0', '::'):
        return network.address
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(('192.0.2.1', 9))  # sends nothing: asks which interface would be taken
            return probe.getsockname()[0]
        except OSError:
            return socket.gethostname()


def stored_tokens(path: Path) -> tuple:
    """The paired devices of earlier runs; none where they cannot be read, which is said."""
    try:
        return loads(path.read_text(encoding='utf-8'))
    except FileNotFoundError:
        return ()
    except (OSError, StoreError) as error:
        rospy.logwarn('%s; every device must be paired anew', error)
        return ()


def store(path: Path, text: str) -> None:
    """Keep the paired devices; those of a disk that takes nothing are known until this run ends, which is said."""
    try:
        certificate.write_secret(path, text.encode())
    except OSError as error:
        rospy.logwarn('%s; the devices that are paired now must be paired anew after the next start', error)


class HmiNode:
    """The server, its robot and its end."""

    def __init__(self, config: HmiConfig) -> None:
        self._config = config
        self._address = own_address(config.network)
        self._url = f'https://{self._address}:{config.network.tls_port}'
        www = Path(rospkg.RosPack().get_path('sara_hmi')) / 'www'
        tokens = folder() / 'devices.json'
        self._pairing = Pairing(
            config.pairing, secrets.randbelow, lambda: secrets.token_urlsafe(32), stored_tokens(tokens)
        )
        hub = Hub(config, self._pairing, time.time)
        self.server = Server(config, hub, www, lambda text: store(tokens, text), self._url)
        if config.rosbridge.enabled:
            self.server.ros_side = BridgeSide(config.rosbridge, self.server.post)
        self.server.robot = RosRobot(config.robot, self.server, www / 'words')

    async def run(self) -> None:
        """Serve until ROS ends."""
        end, loop, done = asyncio.Event(), asyncio.get_running_loop(), threading.Event()

        def stop() -> None:
            loop.call_soon_threadsafe(end.set)
            done.wait(END_S)  # the last zero is published before rospy closes its topics

        on_shutdown(stop)
        network, tls, print_ = self._config.network, None, ''
        if not network.is_local:
            names = ['localhost', socket.gethostname(), self._address, *network.host_names]
            now = datetime.datetime.now(datetime.UTC)
            tls, print_ = certificate.kept(folder(), dict.fromkeys(names), now)
        try:
            await self.server.run(end, tls, lambda port: self._announce(loop.time(), port, print_))
        except OSError as error:
            rospy.logfatal('the touch screen cannot be served: %s', error)
            rospy.signal_shutdown(str(error))
        finally:
            done.set()

    def _announce(self, t, port, print_):
        """Say where the page is, to whoever started this."""
        rospy.set_param('~url', f'http://localhost:{port}')
        lines = [f'The touch screen: http://localhost:{port} on this computer.']
        if print_:
            role = self._config.pairing.first_role
            code = self._pairing.invite(t, role)
            lines += [
                f'From the network: {self._url}, the code is {code} (once, in the role {role}).',
                f'Its certificate is its own; the browser warns once. SHA-256: {print_}',
                qr.terminal(f'{self._url}/#code={code}'),
            ]
        else:
            lines.append('For a tablet or telephone: hmi_address:=0.0.0.0.')
        print('\n'.join(lines), flush=True)


def main() -> None:
    """Run the node."""
    start_node('hmi')
    params = rospy.get_param('~', {})
    params.pop('url', None)  # said by a node before this one, on the same master
    try:
        config = HmiConfig.from_params(params)
    except ConfigError as error:
        rospy.logfatal('wrong configuration of %s: %s', rospy.get_name(), error)
        raise SystemExit(1) from error
    asyncio.run(HmiNode(config).run())
