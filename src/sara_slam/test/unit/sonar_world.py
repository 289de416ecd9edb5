"""A known building for tests of the map builder with ultrasonic sensors: two rooms with a door of 0.80 m, a robot with
six sensors in it, and its odometry, whose turns and ways are wrong.
"""

import math

import numpy as np

from sara_common.planar import compose, inverse, wrap

MOUNTS = {
    'front': (0.5, 0.1, 0.0),
    'rear': (-0.5, 0.0, math.pi),
    'left_front': (0.35, 0.29, 0.5 * math.pi),
    'left_rear': (-0.35, 0.29, 0.5 * math.pi),
    'right_front': (0.35, -0.29, -0.5 * math.pi),
    'right_rear': (-0.35, -0.29, -0.5 * math.pi),
}
WIDTH, DEPTH, MIDDLE, DOOR, THICK = 8.0, 4.0, 4.0, (1.6, 2.4), 0.1
"""m: of the building, where the wall between the rooms is, from where to where its door is, and its half thickness."""
HALF, STEEPEST, MOST = math.radians(30.0), math.radians(60.0), 2.5
STEP, TICK, DELAY = 0.04, 0.1, 0.3
TURNS, WAYS = 0.02, -0.01
"""What the odometry's turns and ways are short of the true ones, relative."""

# Walls: (from, to) with the side they are seen from on the left.
_FACES = [
    ((0.0, 0.0), (WIDTH, 0.0)),
    ((WIDTH, 0.0), (WIDTH, DEPTH)),
    ((WIDTH, DEPTH), (0.0, DEPTH)),
    ((0.0, DEPTH), (0.0, 0.0)),
]
for _low, _high in ((0.0, DOOR[0]), (DOOR[1], DEPTH)):
    _FACES.append(((MIDDLE - THICK, _low), (MIDDLE - THICK, _high)))
    _FACES.append(((MIDDLE + THICK, _high), (MIDDLE + THICK, _low)))
_FACES.append(((MIDDLE + THICK, DOOR[0]), (MIDDLE - THICK, DOOR[0])))
_FACES.append(((MIDDLE - THICK, DOOR[1]), (MIDDLE + THICK, DOOR[1])))
FACES = np.array(_FACES)


def heard(sensor):
    """m to the nearest surface in the cone of a sensor (x, y, axis) that sends its echo back; inf without one."""
    angles = sensor[2] + np.linspace(-HALF, HALF, 31)
    rays = np.stack((np.cos(angles), np.sin(angles)), 1)
    a, along = FACES[:, 0], FACES[:, 1] - FACES[:, 0]
    normal = np.stack((-along[:, 1], along[:, 0]), 1) / np.hypot(*along.T)[:, None]
    facing = -(normal @ (math.cos(sensor[2]), math.sin(sensor[2])))
    ahead = ((np.array(sensor[:2]) - a) * normal).sum(1)
    closing = -(rays @ normal.T)
    with np.errstate(divide='ignore', invalid='ignore'):
        reach = ahead / closing
        hit = np.array(sensor[:2]) + reach[..., None] * rays[:, None] - a
        share = (hit * along).sum(2) / (along**2).sum(1)
    good = (closing > 1e-9) & (ahead > 0.0) & (share >= 0.0) & (share <= 1.0)
    answers = np.where(good & (facing >= math.cos(STEEPEST)), reach, np.inf).min()
    return float(answers) if answers <= MOST else math.inf


def way():
    """(n, 3) true poses: round the left room, through the door, round the right one, and back."""
    corners = [(1.0, 1.0), (3.0, 1.0), (3.0, 3.0), (1.0, 3.0), (1.0, 2.0), (5.0, 2.0)]
    corners += [(5.0, 1.0), (7.0, 1.0), (7.0, 3.0), (5.0, 3.0), (5.0, 2.0), (1.0, 2.0), (1.0, 1.0)]
    poses, yaw = [], 0.0
    for (x0, y0), (x1, y1) in zip(corners, corners[1:]):
        goal = math.atan2(y1 - y0, x1 - x0)
        turn = wrap(goal - yaw)
        poses += [(x0, y0, yaw + share * turn) for share in np.linspace(0.0, 1.0, max(round(abs(turn) / 0.06), 1))]
        yaw = goal
        for share in np.linspace(0.0, 1.0, round(math.dist((x0, y0), (x1, y1)) / STEP))[1:]:
            poses.append((x0 + share * (x1 - x0), y0 + share * (y1 - y0), yaw))
    return np.array(poses)


def drive(slam, seed):
    """Let a SonarSlam hear a drive; returns (n, 3) true poses, STEP apart, TICK (s) each."""
    random, true, odometry = np.random.default_rng(seed), way(), (0.0, 0.0, 0.0)
    for number, pose in enumerate(true.tolist()):
        if number:
            dx, dy, turn = compose(inverse(true[number - 1]), pose)
            dx, dy, turn = (1.0 - WAYS) * dx, (1.0 - WAYS) * dy, (1.0 - TURNS) * wrap(turn)
            odometry = compose(odometry, (dx, dy, turn + random.normal(0.0, 2e-4)))
        slam.on_pose(number * TICK, odometry)
        for name, mount in MOUNTS.items():
            distance = heard(compose(pose, mount)) + random.normal(0.0, 0.01)
            slam.on_range(number * TICK + DELAY, name, mount, math.inf if random.random() < 0.02 else distance)
    return true
