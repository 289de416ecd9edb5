#!/usr/bin/env python3
"""The touch screen's server as a network sees it: its own certificate, pairing, foreign pages, floods, a new start."""

import asyncio
import contextlib
import os
import pathlib
import re
import signal
import ssl
import stat
import subprocess
import tempfile
import time
import unittest

import aiohttp
import rospy
import rostest

from sara_common.ports import free_port

PATIENCE_S = 30.0
ADDRESS = '127.0.0.2'  # not the one of this computer's own pages: served by TLS, and its clients are strangers
PATIENT_S = 120.0  # visitors answer pings only while they listen, most wait here for others, and some say no hello
SAID = re.compile(r'(https://\S+), the code is (\S+) .*SHA-256: (\S+)', re.DOTALL)


class Node:
    """The node in a ROS_HOME of its own. url, code, print: what it has printed. local: the page on this computer."""

    def __init__(self, home):
        network = [('address', ADDRESS), ('port', free_port()), ('tls_port', free_port())]
        network += [('heartbeat_s', PATIENT_S), ('hello_s', PATIENT_S)]
        self.local = f'http://127.0.0.1:{network[1][1]}'
        self.process = subprocess.Popen(
            ['rosrun', 'sara_hmi', 'hmi', *(f'_network/{name}:={value}' for name, value in network)],
            env={**os.environ, 'ROS_HOME': home},
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        printed = ''
        while not (found := SAID.search(printed)):
            line = self.process.stdout.readline()
            assert line, f'it has ended: {printed}'
            printed += line
        self.url, self.code, self.print = found.groups()

    def end(self):
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGINT)
            self.process.stdout.close()
            self.process.wait(PATIENCE_S)


class Visitor:
    """A WebSocket of a device in the network."""

    def __init__(self, socket):
        self.socket = socket

    async def send(self, op, **fields):
        await self.socket.send_json({'op': op, **fields})

    async def until(self, *ops):
        """The next frame of one of these ops."""
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            frame = await asyncio.wait_for(self.socket.receive_json(), PATIENCE_S)
            if frame['op'] in ops:
                return frame
        raise AssertionError(f'no {ops}')

    async def ask(self, op, *answers, **fields):
        await self.send(op, **fields)
        return await self.until(*answers)


class NetworkTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix='sara_hmi_')
        self.addCleanup(folder.cleanup)
        self.home = folder.name

    def start(self):
        self.node = Node(self.home)
        self.addCleanup(self.node.end)
        return self.node

    @contextlib.asynccontextmanager
    async def visit(self, url=None, **headers):
        """A Visitor who trusts the certificate whose fingerprint was printed, and no other."""
        pin = aiohttp.Fingerprint(bytes.fromhex(self.node.print.replace(':', '')))
        async with (
            aiohttp.ClientSession() as session,
            session.ws_connect(f'{url or self.node.url}/ws', ssl=pin, headers=headers) as socket,
        ):
            yield Visitor(socket)

    async def refused(self, **headers):
        """The status with which a page is refused."""
        with self.assertRaises(aiohttp.WSServerHandshakeError) as refusal:
            async with self.visit(**headers):
                pass
        return refusal.exception.status

    def test_who_is_let_in(self):
        node = self.start()
        folder = pathlib.Path(self.home) / 'sara_hmi'
        self.assertEqual(stat.S_IMODE((folder / 'key.pem').stat().st_mode), 0o600)
        self.assertIn(ADDRESS, node.url)

        async def first():
            self.assertEqual(await self.refused(Origin='https://evil.example'), 403)
            self.assertEqual(await self.refused(Host='evil.example'), 421)
            async with self.visit(Origin=node.url) as stranger:
                self.assertEqual((await stranger.ask('hello', 'welcome', version=1))['role'], 'none')
                for op in ('take', 'stop', 'invite'):
                    fields = {'role': 'rider'} if op == 'invite' else {}
                    answer = await stranger.ask(op, 'error', **fields)
                    self.assertEqual(answer['key'], 'error.pair_first')
                answer = await stranger.ask('pair', 'error', 'paired', code='AAAA-AAAA')
                self.assertEqual(answer['key'], 'error.code_wrong')
                token = (await stranger.ask('pair', 'error', 'paired', code=node.code.lower()))['token']
                self.assertEqual((await stranger.until('welcome'))['role'], 'rider')
                await stranger.until('state')
            async with self.visit() as other:
                await other.send('hello', version=1)
                self.assertEqual((await other.ask('pair', 'error', code=node.code))['key'], 'error.code_none')
            return token

        token = asyncio.run(first())
        self.assertNotIn(token, (folder / 'devices.json').read_text())
        node.end()
        again = self.start()
        self.assertEqual(again.print, node.print)
        self.assertNotEqual(again.code, node.code)

        async def invited(role):
            """A new code."""
            async with self.visit(url=again.local) as rider:
                await rider.send('hello', version=1)
                return (await rider.ask('invite', 'invited', role=role))['code']

        async def on_a_full_disk():
            """A device is let in where nothing can be written."""
            (folder / 'devices.json').unlink()
            (folder / 'devices.json').mkdir()
            code = await invited('look')
            async with self.visit() as device:
                await device.send('hello', version=1)
                self.assertEqual((await device.ask('pair', 'paired', code=code))['role'], 'look')
                await device.until('state')
            await invited('look')  # a code that counts, for those who guess

        async def later():
            async with self.visit() as device:
                self.assertEqual((await device.ask('hello', 'welcome', version=1, token=token))['role'], 'rider')
            await on_a_full_disk()
            async with self.visit() as guesser:
                await guesser.send('hello', version=1)
                for _ in range(5):
                    answer = await guesser.ask('pair', 'error', code='BBBB-BBBB')
                    self.assertEqual(answer['key'], 'error.code_wrong')
                answer = await guesser.ask('pair', 'error', 'paired', code=again.code)
                self.assertEqual(answer['key'], 'error.code_paused')

        asyncio.run(later())

    def test_floods_keep_nobody_out(self):
        node = self.start()

        async def flood():
            async with contextlib.AsyncExitStack() as stack, self.visit(node.local) as here:
                self.assertEqual((await here.ask('hello', 'welcome', version=1))['role'], 'rider')
                device = await stack.enter_async_context(self.visit())
                await device.send('hello', version=1)
                token = (await device.ask('pair', 'paired', code=node.code))['token']
                await device.until('state')
                crowd = [await stack.enter_async_context(self.visit()) for _ in range(24)]
                for stranger in crowd[-8:]:
                    self.assertEqual((await stranger.ask('hello', 'welcome', version=1))['role'], 'none')
                for stranger in crowd[:-8]:
                    self.assertIn((await stranger.socket.receive()).type, ENDS)
                async with self.visit() as later:
                    welcome = await later.ask('hello', 'welcome', version=1, token=token)
                    self.assertEqual(welcome['role'], 'rider')
                async with self.visit(node.local) as another:
                    self.assertEqual((await another.ask('hello', 'welcome', version=1))['role'], 'rider')
                async with self.visit() as loud:
                    await loud.ask('hello', 'welcome', version=1)
                    told = asyncio.ensure_future(loud.until('error'))
                    while not told.done():  # a slow machine may let them come as slowly as they may
                        with contextlib.suppress(ConnectionError):  # such a visitor is shown the door
                            for _ in range(400):
                                await loud.send('echo', t=1)
                        await asyncio.wait([told], timeout=2.0)
                    self.assertEqual((await told)['key'], 'error.rate')
                await device.until('state')
                await here.until('state')

        asyncio.run(flood())

    def test_the_network_gets_nothing_without_tls(self):
        node = self.start()
        host, port = node.url.removeprefix('https://').split(':')

        async def plain():
            async with aiohttp.ClientSession() as session:
                for url in (f'http://{host}:{port}/', node.local.replace('127.0.0.1', ADDRESS)):
                    with self.assertRaises(aiohttp.ClientError):
                        await session.get(url)
                with self.assertRaises(aiohttp.ClientConnectorCertificateError):
                    await session.get(node.url)
                context = ssl.create_default_context(cafile=f'{self.home}/sara_hmi/certificate.pem')
                async with session.get(node.url, ssl=context) as answer:  # its names are those of this computer
                    self.assertEqual(answer.status, 200)

        asyncio.run(plain())


ENDS = (aiohttp.WSMsgType.CLOSE, aiohttp.WSMsgType.CLOSED, aiohttp.WSMsgType.CLOSING, aiohttp.WSMsgType.ERROR)

if __name__ == '__main__':
    rospy.init_node('network_test')
    rostest.rosrun('sara_hmi', 'network', NetworkTest)
