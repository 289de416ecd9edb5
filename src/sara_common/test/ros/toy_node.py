"""A node that tells who it takes itself for: in its main thread, a timer, a callback and a service."""

import rospy
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerResponse

from sara_common.ros.node import start_node


def main():
    start_node('toy')
    word = rospy.get_param('~word')
    if word == 'stumble':
        raise ValueError('it stumbles')
    said = rospy.Publisher('~said', String, queue_size=10, latch=True)
    out = rospy.Publisher('out', String, queue_size=10)
    timed = rospy.Publisher('~timed', String, queue_size=10, latch=True)
    rospy.Subscriber('in', String, lambda message: out.publish(f'{message.data} {rospy.get_name()}'))
    rospy.Service('~who', Trigger, lambda _: TriggerResponse(True, f'{rospy.get_name()} {rospy.get_param("~word")}'))
    rospy.Timer(rospy.Duration(0.05), lambda _: timed.publish(rospy.get_name()), oneshot=True)
    said.publish(f'{rospy.get_name()} {word}')
    rospy.spin()
