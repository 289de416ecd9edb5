"""The emergency stop that the page presses and releases."""

from __future__ import annotations

import threading

import rospy
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from sara_hmi.words import endings

SERVICE_S = 1.0  # of wall time that the safety gate is waited for
RELEASE_TRIES, RELEASE_PAUSE_S = 5, 0.1
PRESSED = 'error.reset_pressed'


class EmergencyStop:
    """`presses`: how often it was pressed. A release is asked for by that number: a stop that comes later ends it."""

    def __init__(self) -> None:
        self._out = rospy.Publisher('emergency_stop', Bool, queue_size=1, latch=True, tcp_nodelay=True)
        self._lock, self.presses = threading.Lock(), 0

    def press(self) -> None:
        """At once."""
        with self._lock:
            self.presses += 1
            self._out.publish(Bool(True))

    def release(self, presses: int, has_gate: bool) -> str:
        """Ask for its end; returns why it is not over, a key, or ''. Waits; not for the server's thread."""
        if not has_gate:
            return '' if self._let_go(presses) else PRESSED
        try:
            rospy.wait_for_service('emergency_stop/reset', SERVICE_S)
        except rospy.ROSException:
            return 'error.no_gate'
        release, why = rospy.ServiceProxy('emergency_stop/reset', Trigger), PRESSED
        for _ in range(RELEASE_TRIES):
            if not self._let_go(presses):
                return PRESSED
            rospy.rostime.wallsleep(RELEASE_PAUSE_S)  # the gate hears it
            answer = release()
            why = '' if answer.success else endings.reset(answer.message)
            if why != PRESSED:
                break
        return why

    def _let_go(self, presses):
        """Publish that nobody presses it, unless somebody has since."""
        with self._lock:
            if presses == self.presses:
                self._out.publish(Bool(False))
            return presses == self.presses
