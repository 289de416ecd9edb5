#!/usr/bin/env python3
"""A drive in lockstep as a bag, which `judge` reads, and as MCAP, which holds the same messages."""

import tempfile
import unittest
from collections import Counter
from pathlib import Path

import rosbag
from mcap.reader import make_reader

from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.paths import share
from sara_common.planar import Pose2D
from sara_lab.campaign.results.recorded import recorded
from sara_lab.judge.judge import judge
from sara_lab.ros.studies.bag_track import read_track
from sara_lab.ros.studies.drive_bag import write_bag, write_mcap

START, GOAL = (9.0, 4.0, 3.1), Pose2D(8.2, 4.0, 3.1)


def drive():
    """0.8 m straight on; returns the true pose at the end."""
    lockstep = Lockstep(share() / 'maps' / 'doorway.yaml', START, 1, localization='fake')
    lockstep.start_up()
    lockstep.move_base.set_goal(GOAL, lockstep.time)
    while lockstep.result is None:
        lockstep.step()
    for _ in range(100):
        lockstep.step()
    return lockstep.chair.pose


class DriveBagTest(unittest.TestCase):
    def test_a_bag_is_judged_as_a_recorded_drive_and_mcap_holds_its_bytes(self):
        end, recording = recorded(drive)
        with tempfile.TemporaryDirectory() as folder:
            bag, mcap = Path(folder) / 'drive.bag', Path(folder) / 'drive.mcap'
            write_bag(bag, recording)
            write_mcap(mcap, recording)
            track, dropped = read_track(bag)
            with rosbag.Bag(str(bag)) as source:
                held = [(topic, message[1], t.to_nsec()) for topic, message, t in source.read_messages(raw=True)]
            with mcap.open('rb') as stream:
                read = [
                    (channel.topic, message.data, message.log_time)
                    for _, channel, message in make_reader(stream).iter_messages()
                ]
        found = judge(track)
        self.assertEqual((track.source, len(track.goals), track.goals[0].reached, dropped), ('true', 1, True, {}))
        self.assertLess(max(abs(a - b) for a, b in zip(track.pose[-1], end)), 0.01)
        self.assertAlmostEqual(found.length, 0.8, delta=0.1)
        self.assertEqual(Counter(held), Counter(read))
        topics = {topic for topic, _, _ in held}
        self.assertEqual(len(topics), 10, topics)


if __name__ == '__main__':
    import rostest

    rostest.rosrun('sara_lab', 'drive_bag_test', DriveBagTest)
