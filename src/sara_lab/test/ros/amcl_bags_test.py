#!/usr/bin/env python3
"""A bag of one of amcl's tests: all that a localiser listens to, in order, and what the test asks for beside it."""

import math
import subprocess
import tempfile
import unittest
from collections import defaultdict
from pathlib import Path

import rosbag
import yaml

from sara_lab.studies.amcl_drives import AMCL_TESTS

GLOBAL = 'global_localization_stage'
FRAMES = {'base_footprint', 'base_link', 'base_laser_link'}


class AmclBagsTest(unittest.TestCase):
    def test_a_bag_holds_what_the_node_robot_publishes(self):
        with tempfile.TemporaryDirectory() as folder:
            command = ['rosrun', 'sara_lab', 'amcl_bags', GLOBAL, '--seed', '1', '--out', folder]
            subprocess.run(command, check=True, capture_output=True)
            heard = defaultdict(list)
            with rosbag.Bag(str(Path(folder) / f'{GLOBAL}.bag')) as bag:
                for topic, message, t in bag.read_messages():
                    heard[topic].append((t.to_sec(), message))
            asked = yaml.safe_load((Path(folder) / f'{GLOBAL}.yaml').read_text())
        counts = {topic: len(messages) for topic, messages in heard.items()}
        self.assertEqual(counts, {'/tf': 560, 'odom': 560, 'base_pose_ground_truth': 560, 'base_scan': 280})
        self.assertEqual({transform.child_frame_id for transform in heard['/tf'][0][1].transforms}, FRAMES)
        for t, scan in heard['base_scan']:
            self.assertEqual((scan.header.frame_id, len(scan.ranges)), ('base_laser_link', 541))
            self.assertTrue(0.0 < scan.header.stamp.to_sec() <= t + 1e-9)
        end = heard['base_pose_ground_truth'][-1][1].pose.pose.position
        x, y, _ = asked['expected']['pose']
        self.assertLess(math.dist((end.x, end.y), (x, y)), 0.1)
        self.assertTrue(asked['global_localization'])
        self.assertEqual(asked['amcl']['max_particles'], 5000)

    def test_a_name_that_is_no_test_is_refused(self):
        found = subprocess.run(
            ['rosrun', 'sara_lab', 'amcl_bags', 'texas'], capture_output=True, text=True, check=False
        )
        self.assertEqual(found.returncode, 2)
        self.assertIn(', '.join(AMCL_TESTS), found.stderr)


if __name__ == '__main__':
    import rostest

    rostest.rosrun('sara_lab', 'amcl_bags_test', AmclBagsTest)
