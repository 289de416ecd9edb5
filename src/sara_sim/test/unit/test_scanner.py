"""The laser scanner: what a sweep shows of a room, when each ray is cast, and that a chair without it is as it was."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import advanced, quaternion_from_yaw
from sara_common.platforms import chosen
from sara_common.scans import shares_of, swept
from sara_sim.chair import SimulatedChair
from sara_sim.chips import scanner
from sara_sim.config import ChairConfig
from sara_sim.faults.faults import FaultError
from sara_sim.options import ChairOptions
from sara_sim.world.obstacles import Obstacle
from sara_sim.world.world import World

SEEN = np.abs(scanner.ANGLES) <= scanner.VIEW
START = (3.02, 2.98, 0.3)
SCANNER = chosen().scan
OPTICS = scanner.optics_at(SCANNER)


def room():
    """6 m x 6 m within walls of one cell."""
    occupied = np.zeros((122, 122), bool)
    occupied[[0, -1], :] = occupied[:, [0, -1]] = True
    return World(occupied, origin=(-0.05, -0.05))


def scans_of(chair, count):
    found = []
    while len(found) < count:
        chair.step()
        if chair.scanner.scan is not None:
            found.append(chair.scanner.scan)
    return found


def truth(pose, angles):
    """(n,) m from the scanner of a chair at `pose` to the room's walls."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    x, y = pose[0] + c * SCANNER.x, pose[1] + s * SCANNER.x
    with np.errstate(divide='ignore'):
        ways = [
            (np.where(d > 0, 6.0, 0.0) - at) / d
            for at, d in ((x, np.cos(pose[2] + angles)), (y, np.sin(pose[2] + angles)))
        ]
    return np.minimum(*ways)


def chair_of(world=None, **arguments):
    return SimulatedChair(world or room(), 3, START, options=ChairOptions(scan=True), **arguments)


def test_a_standing_chair_measures_the_walls_to_a_centimetre():
    errors = np.array([scan.ranges[SEEN] - truth(START, scanner.ANGLES[SEEN]) for scan in scans_of(chair_of(), 20)])
    assert abs(errors.mean()) < 0.001
    assert errors.std() == pytest.approx(scanner.SIGMA, rel=0.03)


def test_ten_sweeps_a_second_are_stamped_with_their_first_ray():
    stamps = [scan.stamp for scan in scans_of(chair_of(), 5)]
    assert np.diff(stamps) == pytest.approx(0.1)
    assert stamps[0] == 0.0


def test_the_frame_hides_what_is_behind_it():
    ranges = scans_of(chair_of(), 1)[0].ranges
    assert len(ranges) == 541 and np.all(ranges[~SEEN] == -math.inf) and np.all(np.isfinite(ranges[SEEN]))


def test_nothing_within_its_reach_reads_infinity():
    assert np.all(scans_of(chair_of(World.empty()), 1)[0].ranges[SEEN] == math.inf)


def test_it_sees_who_stands_there_and_no_longer_when_gone():
    world = room()
    x, y = START[0] + 1.5 * math.cos(START[2]), START[1] + 1.5 * math.sin(START[2])
    world.obstacles.add(Obstacle('ann', radius=0.25, at=(x, y), disappears=1.0))
    first, *_, last = scans_of(chair_of(world), 14)
    middle = 270
    assert first.ranges[middle] == pytest.approx(1.5 - 0.25 - SCANNER.x, abs=0.05)
    assert last.ranges[middle] == pytest.approx(truth(START, scanner.ANGLES)[middle], abs=0.05)


def test_each_ray_is_cast_from_where_the_chair_is_at_its_time():
    """A chair that is carried round: the pose of each ray is that of its own time, not of the sweep's beginning."""
    world, rate = room(), 1.0
    device = scanner.Scanner(world, np.random.default_rng(0), START, 0.01, OPTICS)
    found = []
    for tick in range(1, 201):
        device.step((START[0], START[1], START[2] + rate * 0.01 * tick))
        if device.scan is not None:
            found.append(device.scan)
    errors = []
    for scan in found[1:]:
        times = scan.stamp + scanner.TIME_INCREMENT * np.arange(scanner.RAYS)[SEEN]
        own = [
            truth((*START[:2], START[2] + rate * t), scanner.ANGLES[SEEN][i : i + 1])[0] for i, t in enumerate(times)
        ]
        errors.append(scan.ranges[SEEN] - own)
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(scanner.SIGMA, rel=0.1)


@settings(max_examples=10)
@given(st.floats(-1.0, 1.0), st.floats(-0.5, 0.5))
def test_a_sweep_placed_ray_by_ray_shows_the_walls_as_a_standing_one_does(rate, speed):
    """The mean error of the wall (scans.swept) is that of a chair at rest; the whole sweep at one pose is off."""

    def wall_error(rate, speed):
        pose = (3.0, 3.0, 0.4)
        device, found = scanner.Scanner(room(), np.random.default_rng(0), pose, 0.01, OPTICS), []
        for tick in range(1, 60):
            device.step(advanced(*pose, speed, rate, 0.01 * tick))
            if device.scan is not None:
                found.append(device.scan)
        errors = []
        for scan in found:
            ends = [advanced(*pose, speed, rate, scan.stamp + after) for after in (0.0, scanner.TIME_INCREMENT * 540)]
            rays = np.flatnonzero(np.isfinite(scan.ranges))
            angles, ranges = scanner.ANGLES[rays], scan.ranges[rays]
            own = np.column_stack([ranges * np.cos(angles), ranges * np.sin(angles), 0.0 * ranges])
            places = [
                ((x + 0.5 * math.cos(yaw), y + 0.5 * math.sin(yaw), 0.25), quaternion_from_yaw(yaw))
                for x, y, yaw in ends
            ]
            seen = swept(own, shares_of(rays, scanner.RAYS), *places)[:, :2]
            errors.append(np.abs(np.minimum(seen, 6.0 - seen)).min(axis=1))
        return float(np.concatenate(errors).mean())

    assert wall_error(rate, speed) == pytest.approx(wall_error(0.0, 0.0), abs=0.0012)


def test_frames_and_motion_are_those_of_a_chair_without(pilot):
    def heard(scan):
        flight = pilot(SimulatedChair(room(), 3, START, options=ChairOptions(scan=scan)))
        flight.drive(1.0, 1.5, 2.0)
        return flight.raw, flight.chair.pose

    assert heard(True) == heard(False)


def test_the_same_seed_gives_the_same_scans():
    one, two = (scans_of(chair_of(), 3) for _ in range(2))
    assert all(np.array_equal(a.ranges, b.ranges) for a, b in zip(one, two))
    assert not np.array_equal(one[0].ranges, one[1].ranges)


def test_a_silent_scanner_sends_nothing_and_a_frozen_one_the_same():
    chair = chair_of(config=ChairConfig.of())
    before = scans_of(chair, 1)[0]
    chair.faults.add('scan_frozen', duration=0.5)
    frozen = scans_of(chair, 3)
    assert all(np.array_equal(scan.ranges, before.ranges) for scan in frozen)
    assert [scan.stamp for scan in frozen] == pytest.approx([0.1, 0.2, 0.3])
    chair.faults.clear()
    chair.faults.add('scan_silent', duration=1.0)
    silent_from, after = chair.time, scans_of(chair, 1)[0]
    assert after.stamp > silent_from + 0.9 and not np.array_equal(after.ranges, before.ranges)


@pytest.mark.parametrize('name', ['scan_silent', 'scan_frozen'])
def test_a_chair_without_a_scanner_has_no_such_fault(name):
    with pytest.raises(FaultError, match='no laser scanner'):
        SimulatedChair(room(), 3, START).faults.add(name)
