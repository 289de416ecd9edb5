#!/usr/bin/env python3
"""The offline tools from their command lines: what they print, their files and refusals, and the recorded drives.

The recorded drives (robot_localization's test1.bag and test2.bag) and the synthetic ones are looked for in
$SARA_SHARED_DATA, else in ../shared/data beside the repository; without them their tests are skipped.
"""

import json
import math
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np
import rosbag
import rospkg
import rospy
import rostest
import yaml
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from sara_localization.bags.alignment import path_length
from sara_localization.config.filter_config import FilterConfig
from sara_localization.ros.bags import bag_tools
from sara_localization.ros.bags.bag_filter import BagFilter
from sara_localization.ros.bags.bag_reader import BagReader, Unreadable

PACKAGE = Path(rospkg.RosPack().get_path('sara_localization'))
SHARED = Path(os.environ.get('SARA_SHARED_DATA', PACKAGE.resolve().parents[1].parent / 'shared' / 'data'))
BAGS, SYNTHETIC, LOCKSTEP = SHARED / 'bags', SHARED / 'reference' / 'rl_synth', SHARED / 'reference' / 'rl_node'
HUSKY_IMU = '0 -0.3 0.52 -1.570796327 0 1.570796327 base_link imu_link'
# robot_localization's own bag tests: where each filter must end (m), and how near.
PEER_TESTS = {
    ('test1', 'ekf'): ((-40.0454, -76.9988, -2.6974), 1.0452),
    ('test1', 'ukf'): ((-39.7333, -76.9820, -2.4427), 1.2910),
    ('test2', 'ekf'): ((1.0206, 3.4292, 0.7419), 0.1383),
    ('test2', 'ukf'): ((1.0438, 3.4940, 0.7260), 0.2351),
}
PARAMS = """
frequency: 30
two_d_mode: true
odom0: odom
odom0_config: [false, false, false, false, false, false, true, false, false, false, false, false, false, false, false]
imu0: /imu
imu0_config: [false, false, false, false, false, true, false, false, false, false, false, true, false, false, false]
"""


def tool(name, *arguments):
    return subprocess.run(['rosrun', 'sara_localization', name, *map(str, arguments)], capture_output=True, text=True)


def filter_bag(*arguments):
    return tool('filter_bag', *arguments)


def final(run):
    return json.loads(run.stdout.splitlines()[-1])['final']


def quarter_circle(path):
    """10 s of 0.5 m/s along a circle, a quarter of it; the IMU stands upside down on its own link."""
    rate = math.pi / 2 / 10.0
    with rosbag.Bag(str(path), 'w') as bag:
        for k in range(501):
            stamp = rospy.Time.from_sec(1000.0 + 0.02 * k)
            odom = Odometry()
            odom.header.stamp, odom.header.frame_id, odom.child_frame_id = stamp, 'odom', 'base_link'
            odom.twist.twist.linear.x = 0.5
            odom.twist.covariance = [1e-4 if i % 7 == 0 else 0.0 for i in range(36)]
            bag.write('/odom', odom, stamp)
            imu = Imu()
            imu.header.stamp, imu.header.frame_id = stamp, 'imu_link'
            yaw = rate * 0.02 * k
            imu.orientation.x, imu.orientation.y = math.cos(yaw / 2), math.sin(yaw / 2)  # rolled by half a turn
            imu.angular_velocity.z = -rate
            imu.orientation_covariance = imu.angular_velocity_covariance = [1e-4, 0, 0, 0, 1e-4, 0, 0, 0, 1e-4]
            bag.write('/imu', imu, stamp)


class FilterBagTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.params = self.folder / 'params.yaml'
        self.params.write_text(PARAMS)
        self.bag, self.out = self.folder / 'in.bag', self.folder / 'out.bag'

    def test_a_quarter_circle_ends_where_it_should_and_the_bag_holds_it(self):
        quarter_circle(self.bag)
        run = filter_bag(
            self.bag,
            self.out,
            '--params',
            self.params,
            '--reference',
            'odom',
            '--static-tf',
            f'0 0 0.1 0 0 {math.pi!r} base_link imu_link',
        )
        self.assertEqual(run.returncode, 0, run.stderr)
        result = json.loads(run.stdout.splitlines()[-1])
        self.assertEqual(result['messages'], 1002)
        self.assertLess(result['rmse'], 3.0)  # the wheels' own pose, which stays at the origin in this bag
        self.assertGreater(result['seconds'], 0.0)
        radius = 0.5 * 10.0 / (math.pi / 2)
        for value, expected in zip(result['final'], (radius, radius, 0.0, 0.0, 0.0, math.pi / 2)):
            self.assertAlmostEqual(value, expected, delta=0.1)  # up to five ticks beyond the last message
        with rosbag.Bag(str(self.out)) as bag:
            topics = bag.get_type_and_topic_info().topics
            last = list(bag.read_messages(topics=['odometry/filtered']))[-1].message
        self.assertGreater(topics['odometry/filtered'].message_count, 290)
        self.assertGreater(topics['/tf'].message_count, 290)
        self.assertEqual(last.pose.pose.position.x, result['final'][0])

    def test_a_bag_is_read_as_rosbag_reads_it_but_in_the_order_of_time(self):
        """Several chunks that overlap in time (there rosbag leaves each connection's messages as they stand), equal
        times, two connections of a topic, a topic left out, each compression.
        """
        random = np.random.default_rng(3)
        for compression in ('none', 'bz2', 'lz4'):
            path = self.folder / (compression + '.bag')
            with rosbag.Bag(str(path), 'w', compression=compression, chunk_threshold=3000) as bag:
                for k in range(200):
                    msg, topic = (Imu(), '/imu') if k % 3 else (Odometry(), 'odom')
                    msg.header.seq = k
                    topic = '/other' if k % 7 == 0 else topic
                    second = {
                        'topic': topic,
                        'type': msg._type,
                        'md5sum': msg._md5sum,
                        'message_definition': msg._full_text,
                        'callerid': '/b',
                    }
                    bag.write(
                        topic,
                        msg,
                        rospy.Time(100, 10**6 * int(k + random.integers(0, 20))),
                        connection_header=second if k % 5 == 0 else None,
                    )
            with rosbag.Bag(str(path)) as bag:
                wanted = [
                    (topic, type_, data, received.to_nsec())
                    for topic, (type_, data, *_), received in bag.read_messages(topics=['/imu', 'odom'], raw=True)
                ]
                read = list(bag_tools.unread_messages(bag, ['/imu', 'odom']))
                self.assertGreater(bag.get_compression_info().uncompressed, 2 * 3000)
            found = [(topic, msg._type, msg.bytes, received.nanoseconds) for topic, msg, received in read]
            self.assertEqual(sorted(found), sorted(wanted))
            self.assertEqual([time for *_, time in found], sorted(time for *_, time in wanted))
            self.assertGreater(len(wanted), 150)
            types = {type_: type_class for type_class in (Imu, Odometry) for type_ in [type_class._type]}
            self.assertEqual(
                [msg.message.header.seq for _, msg, _ in read],
                [types[type_]().deserialize(data).header.seq for _, type_, data, _ in found],
            )

    def test_a_bag_of_another_kind_is_left_to_rosbag(self):
        with open(self.bag, 'wb') as file:
            file.write(b'#ROSBAG V1.2\n')
        with open(self.bag, 'rb') as file, self.assertRaises(Unreadable):
            BagReader(file)

    def test_a_damaged_bag_is_told_in_a_sentence(self):
        quarter_circle(self.bag)
        content = self.bag.read_bytes()
        self.bag.write_bytes(content.replace(b'\x04\0\0\0odom', b'\xff\xff\x7f\0odom'))
        for name, arguments in (
            ('filter_bag', (self.bag, '-', '--params', self.params)),
            ('check_config', (self.params, self.bag)),
        ):
            run = tool(name, *arguments)
            self.assertGreater(run.returncode, 0)
            self.assertIn('damaged', run.stderr.splitlines()[-1])
            self.assertNotIn('Traceback', run.stderr)

    def test_a_clock_that_was_set_while_the_bag_was_recorded_makes_no_years_of_ticks(self):
        said = []
        machine = BagFilter(FilterConfig.from_params(yaml.safe_load(PARAMS)), report=said.append)
        for began in (100.0, 1.7e9):
            for k in range(20):
                msg, now = Odometry(), rospy.Time.from_sec(began + 0.1 * k)
                msg.header.stamp, msg.header.frame_id, msg.child_frame_id = now, 'odom', 'base_link'
                msg.twist.twist.linear.x = 0.5
                msg.twist.covariance = [1e-4 if i % 7 == 0 else 0.0 for i in range(36)]
                machine.deliver('/odom', msg, now)
        machine.finish()
        self.assertTrue(110 < machine.ticks < 130, machine.ticks)
        self.assertLess(abs(machine.last.stamp - 1.7e9 - 1.9), 0.3)
        self.assertLess(abs(machine.last.state[0] - 1.9), 0.2)
        self.assertEqual([sentence[:24] for sentence in said], ["the bag's clock was set "])

    def test_a_missing_transform_is_named(self):
        quarter_circle(self.bag)
        run = filter_bag(self.bag, self.out, '--params', self.params)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn('no transform imu_link -> base_link', run.stderr)

    def test_what_cannot_be_used_is_refused_in_a_sentence(self):
        quarter_circle(self.bag)
        bad = self.folder / 'bad.yaml'
        bad.write_text(PARAMS + 'odom0_differential: perhaps\n')
        for arguments, word in (
            ((self.bag, self.out, '--params', bad), 'odom0_differential'),
            ((self.bag, self.bag, '--params', self.params), 'another file'),
            ((self.folder / 'no.bag', self.out, '--params', self.params), 'no.bag'),
            ((self.bag, self.out, '--params', self.params, '--static-tf', '1 2 3'), '--static-tf'),
            ((self.bag, self.out, '--params', self.params, '--reference', '/fix'), '--reference /fix'),
            ((self.bag, self.out, '--params', self.params, '--reference', '/imu'), 'NavSatFix'),
        ):
            run = filter_bag(*arguments)
            self.assertNotEqual(run.returncode, 0)
            self.assertIn(word, run.stderr)
            self.assertNotIn('Traceback', run.stderr)

    def test_the_ukf_agrees_and_tables_and_picture_are_written(self):
        quarter_circle(self.bag)
        static = f'0 0 0.1 0 0 {math.pi!r} base_link imu_link'
        ends = []
        for kind in ('ekf', 'ukf'):
            run = filter_bag(
                self.bag,
                '-',
                '--params',
                self.params,
                '--filter',
                kind,
                '--static-tf',
                static,
                '--quiet',
                '--csv',
                self.folder / 'o.csv',
                '--tum',
                self.folder / 'o.tum',
                '--plot',
                self.folder / 'o.png',
            )
            self.assertEqual((run.returncode, run.stderr), (0, ''))
            ends.append(final(run))
        self.assertLess(math.dist(*ends), 1e-3)
        table = np.loadtxt(str(self.folder / 'o.tum'))
        self.assertEqual(table.shape[1], 8)
        self.assertLess(math.dist(table[-1, 1:3], ends[1][:2]), 1e-6)
        self.assertEqual((self.folder / 'o.csv').read_text().count('\n'), len(table) + 1)
        self.assertTrue((self.folder / 'o.png').read_bytes().startswith(b'\x89PNG'))
        self.assertFalse((self.folder / '-').exists())

    def test_check_config_tells_mistakes_and_what_the_bag_lacks(self):
        quarter_circle(self.bag)
        sound = tool(
            'check_config', self.params, self.bag, '--static-tf', f'0 0 0.1 0 0 {math.pi!r} base_link imu_link'
        )
        self.assertNotIn('transform imu_link', sound.stdout)
        lacking = tool('check_config', self.params, self.bag)
        self.assertEqual(lacking.returncode, 1)
        self.assertIn('error: imu0: 501 of 501 messages are lost, no transform imu_link -> base_link', lacking.stdout)
        bad = self.folder / 'bad.yaml'
        bad.write_text(PARAMS.replace('imu0: /imu', 'imu0: /imu/date') + 'frequenzy: 3\n')
        run = tool('check_config', bad, self.bag)
        self.assertIn('the bag has no topic /imu/date (is /imu meant?)', run.stdout)
        self.assertIn('is frequency meant?', run.stdout)
        self.assertEqual(tool('check_config', self.folder / 'no.yaml').returncode, 2)

    @unittest.skipUnless(BAGS.is_dir(), 'the recorded drives (test1.bag, test2.bag) are not there')
    def test_the_recorded_drives_end_where_the_peers_tests_ask(self):
        for (bag, kind), (end, tolerance) in PEER_TESTS.items():
            with self.subTest(bag=bag, filter=kind):
                run = filter_bag(
                    BAGS / (bag + '.bag'),
                    '-',
                    '--params',
                    BAGS / (f'{bag}_{kind}.yaml'),
                    '--filter',
                    kind,
                    *(('--static-tf', HUSKY_IMU) if bag == 'test1' else ()),
                )
                self.assertEqual(run.returncode, 0, run.stderr)
                self.assertLess(math.dist(final(run)[:3], end), tolerance)

    @unittest.skipUnless(BAGS.is_dir(), 'the recorded drive test1.bag is not there')
    def test_the_gyro_alone_brings_the_husky_home_and_check_config_says_why(self):
        bag = BAGS / 'test1.bag'
        accusing = tool('check_config', BAGS / 'test1_ekf.yaml', bag, '--static-tf', HUSKY_IMU)
        self.assertIn("warning: imu0's heading misleads", accusing.stdout)
        params = PACKAGE / 'config' / 'examples' / 'husky_gyro.yaml'
        mended = tool('check_config', params, bag, '--static-tf', HUSKY_IMU)
        self.assertEqual(mended.returncode, 0, mended.stdout)
        self.assertNotIn('warning', mended.stdout)
        for kind, worst in (('ekf', 3.0), ('ukf', 3.0)):
            run = filter_bag(
                bag, '-', '--params', params, '--filter', kind, '--static-tf', HUSKY_IMU, '--reference', '/fix'
            )
            self.assertEqual(run.returncode, 0, run.stderr)
            self.assertLessEqual(json.loads(run.stdout.splitlines()[-1])['rmse'], worst)

    @unittest.skipUnless(
        BAGS.is_dir() and LOCKSTEP.is_dir(), 'the recorded drives or their lockstep results (rl_node) are not there'
    )
    def test_every_lockstep_run_of_the_peers_ekf_is_reproduced(self):
        runs = sorted(LOCKSTEP.glob('*_ekf_*.yaml'))
        self.assertEqual(len(runs), 10)
        for params in runs:
            with self.subTest(params.stem):
                known, states = np.load(str(params.with_suffix('.npz'))), {}
                static = [bag_tools.static_transform(HUSKY_IMU)] if params.stem.startswith('b1') else []
                config = FilterConfig.from_params(bag_tools.load_params(str(params)))
                machine = BagFilter(
                    config,
                    static,
                    lambda now, output: states.update({machine.ticks: (*output.state[:3], *output.pose.rotation)}),  # noqa: B023
                )
                with rosbag.Bag(str(BAGS / {'b1': 'test1.bag', 'b2': 'test2.bag'}[params.stem[:2]])) as bag:
                    topics = [topic for topic in bag.get_type_and_topic_info().topics if topic in machine.topics]
                    for delivered in bag.read_messages(topics=topics):
                        machine.deliver(*delivered)
                machine.finish()
                valid = known['valid']
                ours, theirs = np.array([states[k] for k in known['tick_index'][valid]]), known['pose'][valid]
                theirs[:, 3:] *= np.sign((ours[:, 3:] * theirs[:, 3:]).sum(axis=1))[
                    :, None
                ]  # q and -q are one rotation
                self.assertLess(np.abs(ours - theirs).max(), 1e-6)

    @unittest.skipUnless(SYNTHETIC.is_dir(), 'the synthetic drives (rl_synth) are not there')
    def test_the_thesis_set_makes_the_square_too_long_and_the_default_set_does_not(self):
        truth = np.load(str(SYNTHETIC / 's2_square_chair_truth.npz'))
        wanted = path_length(truth['x'], truth['y'])
        clean = yaml.safe_load((SYNTHETIC / 's2_square_chair__thesis.yaml').read_text())
        clean['odom0_config'] = [k == 6 for k in range(15)]
        (self.folder / 'clean.yaml').write_text(yaml.safe_dump(clean))
        lengths = []
        for params in (SYNTHETIC / 's2_square_chair__thesis.yaml', self.folder / 'clean.yaml'):
            tum = self.folder / 'o.tum'
            run = filter_bag(SYNTHETIC / 's2_square_chair.bag', '-', '--params', params, '--tum', tum)
            self.assertEqual(run.returncode, 0, run.stderr)
            way = np.loadtxt(str(tum))
            lengths.append(path_length(way[:, 1], way[:, 2]) / wanted)
        self.assertAlmostEqual(lengths[0], 1.17, delta=0.03)
        self.assertAlmostEqual(lengths[1], 1.00, delta=0.02)


if __name__ == '__main__':
    rostest.rosrun('sara_localization', 'filter_bag', FilterBagTest, sys.argv)
