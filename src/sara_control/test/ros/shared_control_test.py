#!/usr/bin/env python3
"""The wiring of shared_control: commands, a costmap and tf in; commands and sentences out. The test is the clock."""

import unittest

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import TransformStamped, Twist, Vector3
from nav_msgs.msg import OccupancyGrid
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Bool, Float32, String
from tf2_msgs.msg import TFMessage

from sara_common.platforms import chosen

CELL, SIDE = 0.05, 120
AHEAD_M = 0.5 * chosen().body.length + 0.16  # from base_link to the wall
TRIES = 200


class SharedControlTest(unittest.TestCase):
    def setUp(self):
        self.commands, self.sentences, self.left, self.profiles = [], [], [], []
        self.clock = rospy.Publisher('/clock', Clock, queue_size=1)
        self.tf = rospy.Publisher('/tf', TFMessage, queue_size=1)
        self.costmap = rospy.Publisher('costmap', OccupancyGrid, queue_size=1)
        self.active = rospy.Publisher('cmd_vel_mux/active', String, queue_size=1, latch=True)
        self.override = rospy.Publisher('shared_control/override', Bool, queue_size=1)
        self.profile = rospy.Publisher('shared_control/profile', String, queue_size=1)
        self.wish = rospy.Publisher('/cmd_vel/mux', Twist, queue_size=1)
        rospy.Subscriber('/cmd_vel/assisted', Twist, self.commands.append)
        rospy.Subscriber('shared_control/override_left', Float32, lambda message: self.left.append(message.data))
        rospy.Subscriber('shared_control/profile_in_use', String, lambda m: self.profiles.append(m.data))
        rospy.Subscriber('shared_control/status', String, lambda message: self.sentences.append(message.data))
        self.now = 100.0
        publishers = self.clock, self.tf, self.costmap, self.active, self.override, self.profile, self.wish
        heard = self.profiles, self.sentences, self.left  # latched
        while not (all(heard) and all(publisher.get_num_connections() for publisher in publishers)):
            # what is said before is lost
            rospy.rostime.wallsleep(0.02)

    def tick(self, v, w=0.0, sees=True, side=SIDE):
        """0.1 s: the world as it is, and a wish. Returns the command that came of it, None where none did yet."""
        self.now += 0.1
        stamp = rospy.Time.from_sec(self.now)
        self.clock.publish(Clock(clock=stamp))
        transform = TransformStamped()
        transform.header.stamp, transform.header.frame_id, transform.child_frame_id = stamp, 'map', 'base_link'
        transform.transform.translation.x = transform.transform.translation.y = 0.5 * SIDE * CELL
        transform.transform.rotation.w = 1.0
        self.tf.publish(TFMessage([transform]))
        if sees:
            grid = OccupancyGrid()
            grid.header.stamp, grid.header.frame_id = stamp, 'map'
            grid.info.resolution, grid.info.width, grid.info.height = CELL, side, SIDE
            grid.info.origin.orientation.w = 1.0
            cells = np.zeros((SIDE, SIDE), np.int8)
            cells[:, int((0.5 * SIDE * CELL + AHEAD_M) / CELL) :] = 100
            grid.data = cells.ravel().tolist()
            self.costmap.publish(grid)
        rospy.rostime.wallsleep(0.02)
        del self.commands[:]
        self.wish.publish(Twist(Vector3(v, 0.0, 0.0), Vector3(0.0, 0.0, w)))
        for _ in range(50):
            if self.commands:
                return self.commands[-1].linear.x, self.commands[-1].angular.z
            rospy.rostime.wallsleep(0.01)
        return None

    def until(self, wanted, *wish, **what):
        """Ticks until a command is as wanted; the test fails where none ever is."""
        for _ in range(TRIES):
            command = self.tick(*wish, **what)
            if command is not None and wanted(*command):
                return
        self.fail(f'no such command: the last is {command}, sentences {self.sentences}')

    def test_a_rider_is_helped_and_nobody_else(self):
        self.active.publish('joystick')
        self.until(lambda v, w: v < 0.3, 0.35)
        self.until(lambda v, w: 'keep clear' in self.sentences[-1] or 'room' in self.sentences[-1], 0.35)
        self.until(lambda v, w: (v, w) == (0.0, 0.0), 0.0)
        self.override.publish(True)
        self.until(lambda v, w: (v, w) == (0.35, 0.0), 0.35)
        self.until(
            lambda v, w: (v, w) == (0.0, 0.0) and self.sentences[-1].endswith('the rider wants to go alone.'), 0.0
        )
        self.until(lambda v, w: 0.0 < self.left[-1] < 19.0, 0.0)  # 0 is that of before
        self.assertAlmostEqual(max(self.left), 20.0, delta=0.5)
        self.override.publish(False)
        self.until(lambda v, w: (v, w) != (0.35, 0.0), 0.35)
        self.until(lambda v, w: self.left[-1] == 0.0, 0.0)
        self.profile.publish('none')  # there is no such profile
        self.until(lambda v, w: (v, w) != (0.35, 0.0), 0.35)
        self.profile.publish('gate_only')
        self.until(lambda v, w: (v, w) == (0.35, 0.0), 0.35)
        self.until(lambda v, w: self.sentences[-1].endswith('its help is switched off.'), 0.0)
        self.profile.publish('much')
        self.until(lambda v, w: (v, w) != (0.35, 0.0), 0.35)
        self.until(lambda v, w: len(self.profiles) == 3, 0.35)  # they come by a connection of their own
        self.assertEqual(self.profiles, ['much', 'gate_only', 'much'])
        self.until(lambda v, w: (v, w) == (0.35, 0.0), 0.35, sees=False)  # it is too old to be used
        self.until(lambda v, w: 'does not know' in self.sentences[-1], 0.35, sees=False)
        self.until(lambda v, w: (v, w) != (0.35, 0.0), 0.35)
        self.until(lambda v, w: (v, w) == (0.35, 0.0), 0.35, side=SIDE - 1)  # it has more cells than it says
        self.active.publish('navigation')
        self.until(lambda v, w: (v, w) == (0.35, 0.1), 0.35, 0.1)
        self.until(lambda v, w: self.sentences[-1] == 'The chair follows the rider.', 0.35, 0.1)


if __name__ == '__main__':
    rospy.init_node('shared_control_test')
    rostest.rosrun('sara_control', 'shared_control', SharedControlTest)
