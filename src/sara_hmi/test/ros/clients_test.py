#!/usr/bin/env python3
"""The touch screen's rosbridge by the programs that people write for it: roslibpy; roslib in a page of another host.

Both publish, subscribe, call a service and read a parameter; what is not on the allow-lists is refused in words.
"""

import functools
import http.server
import json
import pathlib
import shutil
import subprocess
import tempfile
import threading
import time
import unittest

import rospkg
import rospy
import rostest
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger, TriggerResponse

from sara_hmi.browser.page import browsing

PATIENCE_S = 60.0
SOURCE = pathlib.Path(rospkg.RosPack().get_path('sara_hmi')).resolve()
CLIENTS = SOURCE.parents[1] / '.venv' / 'clients'  # tools/setup_clients.sh
ROSLIB = CLIENTS / 'roslib' / 'build' / 'roslib.min.js'
HAS_ROSLIBPY = any(CLIENTS.glob('lib/python3*/site-packages/roslibpy'))
PAGE = '<!doctype html><title>roslib</title><script src="roslib.min.js"></script>'
STORY = """
const [url, done] = arguments;
const came = {};
const ros = new ROSLIB.Ros({ url });
ros.on('error', () => done({ error: 'refused' }));
ros.onAny((name, frame) => { if (name.startsWith('status')) came.refused ??= frame.msg; }); // status:ID of the frame
ros.on('connection', async () => {
  const get = (name) => new Promise((told) => new ROSLIB.Param({ ros, name }).get(told));
  const call = (name, serviceType) => new Promise((told) =>
    new ROSLIB.Service({ ros, name, serviceType }).callService(new ROSLIB.ServiceRequest({}), told, told));
  const hear = (name, messageType, more) => new Promise((told) =>
    new ROSLIB.Topic({ ros, name, messageType, ...more }).subscribe(told));
  const publish = (name, messageType, message) =>
    new ROSLIB.Topic({ ros, name, messageType }).publish(new ROSLIB.Message(message));
  came.param = await get('/hmi_clients/answer');
  came.topic_type = await new Promise((told) => ros.getTopicType('/hmi_clients/said', told));
  came.service = await call('/emergency_stop/reset', 'std_srvs/Trigger');
  came.service_refused = await call('/hmi/set_logger_level', 'roscpp/SetLoggerLevel');
  came.said = await hear('/hmi_clients/said', 'std_msgs/String');
  came.cbor = (await hear('/hmi_clients/said', 'std_msgs/String', { compression: 'cbor' })).data;
  publish('/emergency_stop', 'std_msgs/Bool', { data: true });
  publish('/cmd_vel/touch', 'geometry_msgs/Twist', { linear: { x: 1 } });
  while (!came.refused) await new Promise((again) => setTimeout(again, 20));
  done(came);
});
"""


class Quiet(http.server.SimpleHTTPRequestHandler):
    """Serves a folder."""

    def log_message(self, *_):
        """Says nothing of it."""


class ClientsTest(unittest.TestCase):
    """One robot for all."""

    @classmethod
    def setUpClass(cls):
        cls.stops, cls.touched = [], []
        rospy.Subscriber('/emergency_stop', Bool, lambda message: cls.stops.append(message.data))
        rospy.Subscriber('/cmd_vel/touch', Twist, cls.touched.append)
        rospy.Service('/emergency_stop/reset', Trigger, lambda _: TriggerResponse(True, 'free'))
        cls.said = rospy.Publisher('/hmi_clients/said', String, queue_size=1, latch=True)
        cls.said.publish('a word')
        cls.wait(lambda: rospy.has_param('/hmi/url'))
        cls.port = int(rospy.get_param('/hmi/url').rsplit(':', 1)[1])

    def setUp(self):
        self.stops.clear()

    @staticmethod
    def wait(condition):
        end = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < end, 'not within the time'
            time.sleep(0.02)

    def judge(self, came):
        self.assertEqual(came['param'], 42)
        self.assertEqual(came['topic_type'], 'std_msgs/String')
        self.assertEqual(came['service'], {'success': True, 'message': 'free'})
        self.assertIn('/hmi/set_logger_level is not on the list of what may be called', came['service_refused'])
        self.assertEqual(came['said'], {'data': 'a word'})
        self.assertIn('/cmd_vel/touch is not on the list of what may be published', came['refused'])
        self.wait(lambda: self.stops)
        self.assertEqual((self.stops, self.touched), ([True], []))

    @unittest.skipUnless(HAS_ROSLIBPY, 'roslibpy could not be installed (tools/setup_clients.sh)')
    def test_roslibpy(self):
        program = SOURCE / 'test' / 'ros' / 'roslibpy_client.py'
        command = [str(CLIENTS / 'bin' / 'python3'), '-I', str(program), str(self.port)]
        out = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(out.returncode, 0, out.stderr)
        self.judge(json.loads(out.stdout))

    @unittest.skipUnless(ROSLIB.exists(), 'roslib could not be installed (tools/setup_clients.sh)')
    @unittest.skipUnless(shutil.which('chromium'), 'chromium is not installed')
    def test_roslib_in_a_page_of_another_host(self):
        with tempfile.TemporaryDirectory() as folder:
            shutil.copy(ROSLIB, folder)
            pathlib.Path(folder, 'index.html').write_text(PAGE)
            handler = functools.partial(Quiet, directory=folder)
            with http.server.ThreadingHTTPServer(('127.0.0.1', 0), handler) as host:
                threading.Thread(target=host.serve_forever, daemon=True).start()
                with browsing(f'http://127.0.0.1:{host.server_port}') as page:
                    page.driver.set_script_timeout(PATIENCE_S)
                    page.driver.get(f'{page.url}/index.html')
                    came = page.driver.execute_async_script(STORY, f'ws://127.0.0.1:{self.port}')
                    # The same page under a name that is not on the list of origins.
                    page.driver.get(f'http://localhost:{host.server_port}/index.html')
                    stranger = page.driver.execute_async_script(STORY, f'ws://127.0.0.1:{self.port}')
                host.shutdown()
        self.assertEqual(came.pop('cbor'), 'a word')
        self.judge(came)
        self.assertEqual(stranger, {'error': 'refused'})


if __name__ == '__main__':
    rospy.init_node('clients_test')
    rostest.rosrun('sara_hmi', 'clients', ClientsTest)
