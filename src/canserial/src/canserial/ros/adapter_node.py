"""canserial.py: frames of a CAN adapter to `canrx`, frames of `cantx` to the adapter.

Two threads of its own: one receives (and opens, waits and opens again when the adapter is missing), the main one publishes
diagnostics. Both wait in wall time, for an adapter does not know of simulated time.
"""

import threading

import rospy
from canserial.adapter import Adapter, AdapterConfig, AdapterError, BadFrame
from canserial.msg import CAN
from canserial.ros.conversions import frame_to_msg, msg_to_frame
from canserial.ros.node import ERROR, OK, WARN, Diagnostics, config_from_params

FIRST_BACK_OFF, LAST_BACK_OFF = 0.2, 2.0  # s
RECEIVE_TIMEOUT = 0.1  # s


class AdapterNode:
    """The shell around one Adapter."""

    def __init__(self):
        self.config = config_from_params(AdapterConfig)
        self.where = f'{self.config.interface} adapter on {self.config.port}'
        self.adapter = Adapter(self.config)
        self.counters = {'reconnections': 0, 'not_sent_closed': 0, 'not_sent_invalid': 0}
        self.error = 'not opened yet'
        self.stopping = threading.Event()
        self.canrx = rospy.Publisher('canrx', CAN, queue_size=1000, tcp_nodelay=True)
        self.diagnostics = Diagnostics('CAN adapter', self.config.port)
        rospy.Subscriber('cantx', CAN, self.send, queue_size=100, tcp_nodelay=True)
        rospy.on_shutdown(self.stopping.set)

    def run(self):
        """Until ROS shuts down."""
        thread = threading.Thread(target=self.receive, name='can-receive')
        thread.start()
        while not self.stopping.wait(1.0):
            if not thread.is_alive() and not self.stopping.is_set():
                rospy.logerr('the receiving thread died: started anew')
                thread = threading.Thread(target=self.receive, name='can-receive')
                thread.start()
            level = OK if self.adapter.is_open and not self.error else ERROR
            if level == OK and self.adapter.counters['received'] == 0:
                level = WARN
            message = self.error or ('open' if level == OK else 'open, but no frame has come yet')
            self.diagnostics.publish(level, message, {**self.counters, **self.adapter.counters})
        thread.join(2.0)

    def receive(self):
        """Open the adapter, receive until it fails, wait, begin again."""
        back_off, said = FIRST_BACK_OFF, None
        try:
            while not self.stopping.is_set():
                try:
                    self.adapter.open()
                    self.error = ''
                    rospy.loginfo('the %s is open at %d bit/s', self.where, self.config.bitrate)
                    back_off, said = FIRST_BACK_OFF, None
                    self.pump()
                except AdapterError as error:
                    lost = self.adapter.is_open
                    self.adapter.close()
                    self.error = f'the {self.where} is {"lost" if lost else "missing"}: {error}'
                    if lost:
                        self.counters['reconnections'] += 1
                    if self.error != said:
                        rospy.logwarn('%s. Waiting for it.', self.error)
                        said = self.error
                    self.stopping.wait(back_off)
                    back_off = min(2.0 * back_off, LAST_BACK_OFF)
        finally:
            self.adapter.close()

    def pump(self):
        """Publish what comes, until the adapter fails or the node stops."""
        while not self.stopping.is_set():
            frame = self.adapter.receive(RECEIVE_TIMEOUT, rospy.get_time)
            if frame is not None:
                self.canrx.publish(frame_to_msg(frame))

    def send(self, message):
        """A message of cantx to the adapter; never raises."""
        try:
            self.adapter.send(msg_to_frame(message))
        except BadFrame as error:
            self.counters['not_sent_invalid'] += 1
            rospy.logwarn_throttle(10.0, f'cantx: {error}; dropped')
        except AdapterError as error:
            self.counters['not_sent_closed'] += 1
            if self.adapter.is_open:
                rospy.logwarn_throttle(10.0, f'cantx: the {self.where} did not take a frame: {error}')


def main():
    """Run the node."""
    rospy.init_node('canserial')
    AdapterNode().run()
    rospy.spin()  # until rospy has ended its own shutdown, so that the master forgets the node
