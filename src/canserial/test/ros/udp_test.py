#!/usr/bin/env python3
"""An adapter other than the Lawicel one by parameters alone: frames of cantx come out on the other nodes' canrx, as far
as they listen.
"""

import os
import socket
import struct
import sys
import time
import unittest

# This test is installed beside canserial.py, which must not be taken for the package.
HERE = {os.path.dirname(os.path.realpath(path)) for path in (sys.argv[0], __file__)}
sys.path[:] = [path for path in sys.path if os.path.realpath(path or '.') not in HERE]
sys.path.append(os.path.join(os.path.dirname(os.path.realpath(__file__)), 'support'))

import rospy  # noqa: E402
import rostest  # noqa: E402
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from pty_adapter import wait_until  # noqa: E402

from canserial.msg import CAN  # noqa: E402


def multicast_works():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.setsockopt(
                socket.IPPROTO_IP,
                socket.IP_ADD_MEMBERSHIP,
                struct.pack('4sl', socket.inet_aton('239.74.163.2'), socket.INADDR_ANY),
            )
            probe.sendto(b'', ('239.74.163.2', 43902))
        except OSError:
            return False
    return True


@unittest.skipUnless(multicast_works(), 'this machine has no multicast')
class UdpTest(unittest.TestCase):
    def test_frames_between_nodes(self):
        got, statuses = {'one': [], 'two': [], 'listener': []}, {}
        for name, messages in got.items():
            rospy.Subscriber(f'/{name}/canrx', CAN, messages.append, queue_size=100, tcp_nodelay=True)
        rospy.Subscriber('/diagnostics', DiagnosticArray, lambda m: statuses.update({s.name: s for s in m.status}))
        send = {name: rospy.Publisher(f'/{name}/cantx', CAN, queue_size=100) for name in got}
        short, long = CAN(stdId=0x120, extId=-1, data=b'12345678'), CAN(stdId=0, extId=0x1ABCDEF0, data=b'')

        def arrives():
            send['one'].publish(short)
            time.sleep(0.1)
            return got['two']

        self.assertTrue(wait_until(arrives), 'no frame from one to two')
        self.assertEqual((got['two'][0].stdId, got['two'][0].extId, got['two'][0].data), (0x120, -1, b'12345678'))

        def both_ways():
            send['two'].publish(long)
            send['listener'].publish(long)
            time.sleep(0.1)
            return any(m.extId == 0x1ABCDEF0 for m in got['one']) and got['listener']

        self.assertTrue(wait_until(both_ways), 'no frame from two')
        self.assertEqual({m.extId for m in got['listener']}, {0x1ABCDEF0}, 'the filter')
        status = 'listener/canserial: CAN adapter'
        self.assertTrue(
            wait_until(
                lambda: (
                    status in statuses
                    and any(
                        value.key == 'not_sent_listen_only' and int(value.value) > 0
                        for value in statuses[status].values
                    )
                )
            ),
            statuses.keys(),
        )
        self.assertIn(('sent', '0'), [(value.key, value.value) for value in statuses[status].values])


if __name__ == '__main__':
    rospy.init_node('udp_test')
    rostest.rosrun('canserial', 'udp', UdpTest)
