"""Waiting for what a node answers."""

import rospy


def wait_until(condition, what, timeout=20.0):
    """What a condition returns once that is true; AssertionError with `what`, a text or what gives one, after `timeout`
    s.
    """
    end = rospy.Time.now() + rospy.Duration(timeout)
    while rospy.Time.now() < end:
        found = condition()
        if found:
            return found
        rospy.sleep(0.005)
    raise AssertionError(what() if callable(what) else what)
