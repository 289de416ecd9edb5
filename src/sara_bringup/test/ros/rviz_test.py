#!/usr/bin/env python3
"""RViz driven with real mouse and key events: "2D Pose Estimate", then "2D Nav Goal", and the chair arrives.

RViz runs on an Xvfb screen of its own. What it showed is left as PNG files in the folder that SARA_SCREENSHOTS names,
by default build/rviz.
"""

import math
import os
import shutil
import subprocess
import time
import unittest
from pathlib import Path

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from move_base_msgs.msg import MoveBaseActionResult
from nav_msgs.msg import Odometry
from PIL import ImageGrab
from sensor_msgs.msg import Imu

from sara_bringup.paths import share
from sara_common.planar import wrap, yaw_of

SCREEN = 1300, 900
SCALE, FOCUS = 85.0, (3.0, 3.0)  # of the view in rviz/sara.rviz: pixels per metre, and what is in its middle
DRAG = 100  # pixels, of the arrow that says the yaw
NEEDED = ('Xvfb', 'rviz', 'xdotool')
START, GOAL = (1.0, 1.0, 0.0), (4.0, 1.2, math.pi / 2)
PLAN, TRUE_TRAIL, FUSED_TRAIL = (25, 200, 25), (20, 20, 20), (30, 90, 220)  # colours of displays in rviz/sara.rviz


def wait(condition, seconds, what):
    """Wait in real time until condition() gives something true; return that."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        found = condition()
        if found:
            return found
        time.sleep(0.1)
    raise AssertionError(f'{what}: not within {seconds} s')


class Screen:
    """An X server without a screen to look at, and RViz on it."""

    def __init__(self):
        read, write = os.pipe()
        self.server = subprocess.Popen(
            [
                'nice',
                'Xvfb',
                '-displayfd',
                str(write),
                '-screen',
                '0',
                f'{SCREEN[0]}x{SCREEN[1]}x24',
                '-nolisten',
                'tcp',
            ],
            pass_fds=(write,),
            stderr=subprocess.DEVNULL,
        )
        os.close(write)
        with os.fdopen(read) as pipe:
            self.display = f':{pipe.readline().strip()}'
        # Painting in software takes what it gets; the chair must not wait for it.
        self.env = {**os.environ, 'DISPLAY': self.display, 'LIBGL_ALWAYS_SOFTWARE': '1', 'LP_NUM_THREADS': '1'}
        self.rviz = subprocess.Popen(
            ['nice', 'rviz', '-d', str(share() / 'rviz' / 'sara.rviz')],
            env=self.env,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self.centre = 823.0, 466.0  # pixels, of the view's middle; what comes of a click corrects it

    def do(self, *words):
        """xdotool's answer to its arguments."""
        return subprocess.run(
            ['xdotool', *map(str, words)], env=self.env, capture_output=True, text=True, check=False
        ).stdout

    def wait_for_window(self):
        """Wait for RViz's window and give it the keyboard."""
        window = wait(lambda: self.do('search', '--onlyvisible', '--name', 'sara.rviz').split(), 60, "RViz's window")[
            -1
        ]
        self.do('windowfocus', window)

    def shot(self, name):
        """Keep a picture of the screen; return it, uint8 (rows, columns, 3)."""
        folder = Path(os.environ.get('SARA_SCREENSHOTS') or share().parent.parent / 'build' / 'rviz')
        folder.mkdir(parents=True, exist_ok=True)
        picture = ImageGrab.grab(xdisplay=self.display)
        picture.save(folder / f'{name}.png')
        return np.asarray(picture.convert('RGB'))

    def drag(self, key, pose):
        """Take the tool of a key, press at a pose's place on the map, pull to where it looks, let go."""
        x = round(self.centre[0] + (pose[0] - FOCUS[0]) * SCALE)
        y = round(self.centre[1] - (pose[1] - FOCUS[1]) * SCALE)
        self.do('mousemove', x, y)
        time.sleep(0.3)
        self.do('key', key)
        time.sleep(0.3)
        self.do('mousedown', 1)
        for part in (0.3, 0.6, 1.0):
            time.sleep(0.1)
            self.do('mousemove', round(x + part * DRAG * math.cos(pose[2])), round(y - part * DRAG * math.sin(pose[2])))
        time.sleep(0.2)
        self.do('mouseup', 1)

    def close(self):
        """End both programs."""
        for process in (self.rviz, self.server):
            process.terminate()
            process.wait()


def pixels_of(picture, colour):
    """How many pixels have nearly this colour."""
    return int(np.all(np.abs(picture.astype(int) - colour) <= 12, axis=2).sum())


class RvizTest(unittest.TestCase):
    def setUp(self):
        missing = [name for name in NEEDED if not shutil.which(name)]
        if missing:
            self.skipTest(f'no {", ".join(missing)} on this machine, and so no screen to try RViz on')
        self.heard = {}
        for name, topic, kind in (
            ('pose', '/set_pose', PoseWithCovarianceStamped),
            ('goal', '/move_base_simple/goal', PoseStamped),
            ('true', '/ground_truth', Odometry),
            ('imu', '/imu/data', Imu),
            ('fused', '/odometry/filtered', Odometry),
            ('result', '/move_base/result', MoveBaseActionResult),
        ):
            rospy.Subscriber(topic, kind, lambda message, name=name: self.heard.__setitem__(name, message))
        self.screen = Screen()
        self.addCleanup(self.screen.close)

    def pose_of(self, name):
        message = self.heard[name]
        pose = message.pose if isinstance(message, PoseStamped) else message.pose.pose
        return pose.position.x, pose.position.y, yaw_of(pose.orientation)

    def point_at(self, key, pose, name):
        """Use a tool at a pose until what came is meant: the first try may show where the view's middle really is."""
        for _ in range(4):
            self.heard.pop(name, None)
            self.screen.drag(key, pose)
            try:
                wait(lambda: name in self.heard, 20, f'a message after key {key}')
            except AssertionError:
                continue
            came = self.pose_of(name)
            off = came[0] - pose[0], came[1] - pose[1]
            if math.hypot(*off) < 0.05:
                self.assertLess(abs(wrap(came[2] - pose[2])), 0.05)
                return came
            x, y = self.screen.centre
            self.screen.centre = x - off[0] * SCALE, y + off[1] * SCALE
        self.fail(f'the tool of key {key} never hit {pose}; newest: {name in self.heard and self.pose_of(name)}')

    def way_is_seen(self):
        picture = self.screen.shot('rviz_arrived')
        return pixels_of(picture, FUSED_TRAIL) + pixels_of(picture, TRUE_TRAIL) > 100

    def test_a_pose_and_a_goal_by_mouse_and_the_chair_arrives(self):
        wait(lambda: {'fused', 'true', 'imu'} <= set(self.heard), 60, "the fused pose, and the gyro's calibration")
        self.screen.wait_for_window()
        wait(
            lambda: (
                rospy.get_published_topics() and any(topic == '/set_pose' for topic, _ in rospy.get_published_topics())
            ),
            30,
            "RViz's tools",
        )
        time.sleep(2.0)
        self.point_at('p', START, 'pose')
        rospy.sleep(1.0)
        fused = self.pose_of('fused')
        self.assertLess(math.dist(fused[:2], self.pose_of('pose')[:2]), 0.05)
        self.screen.shot('rviz_pose')
        self.point_at('g', GOAL, 'goal')
        wait(lambda: math.dist(self.pose_of('true')[:2], START[:2]) > 1.5, 60, 'the chair on its way')
        wait(lambda: pixels_of(self.screen.shot('rviz_driving'), PLAN) > 50, 120, 'a plan on the screen')
        wait(lambda: 'result' in self.heard, 90, "move_base's result")
        self.assertEqual(self.heard['result'].status.status, 3, self.heard['result'].status.text)
        true = self.pose_of('true')
        self.assertLess(math.dist(true[:2], GOAL[:2]), 0.2)
        self.assertLess(abs(wrap(true[2] - GOAL[2])), math.radians(8))
        wait(self.way_is_seen, 120, 'the way driven on the screen')


if __name__ == '__main__':
    rospy.init_node('rviz_test')
    rostest.rosrun('sara_bringup', 'rviz_by_hand', RvizTest)
