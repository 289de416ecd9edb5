"""Track and wheel radii of a differential drive from a drive with a gyroscope.

The two errors are those of UMBmark (Borenstein & Feng, "Measurement and correction of systematic odometry errors in
mobile robots", IEEE Trans. Robotics and Automation 12(6), 1996): the effective wheelbase E_b and the ratio of the wheel
diameters E_d, with the mean diameter kept. They read both off the positions to which a square returns; that is linear
in small errors only, and a track 28 % off leaves no square to return. Here a gyroscope gives the turn of each stretch
between two rests, in which the model is linear without being small:

    gyro = p (radius dphi_right) - q (radius dphi_left) + bias dt,    p = m_right / (m_sep separation),  q = m_left /
    (m_sep separation)

for all stretches by weighted least squares, standstills included (they tell the bias). Straight legs tell p / q, turns
on the spot p + q, driving the square both ways keeps the bias apart from p / q. The absolute size of the wheels shows
in neither: it needs a length measured on the floor (`leg`), else the mean radius stays what it was.
"""

from dataclasses import dataclass

import numpy as np

from sara_control.calibration.drive_log import DriveLog, LogError, stretches
from sara_control.wheels.odometry import Odometry

STRAIGHT = 0.2  # rad that a straight leg may turn
SHORTEST_LEG = 0.5  # m
READING = 2e-4  # rad, of a stretch's turn: steps of the encoders and of the gyroscope's samples


@dataclass(frozen=True)
class Geometry:
    """separation, left_radius, right_radius: m."""

    separation: float
    left_radius: float
    right_radius: float


@dataclass(frozen=True)
class Calibration:
    """Multipliers on the nominal separation and radius, each with its standard deviation, and how they were come by.

    residual: rms of what is left of the stretches' turns, rad. bias: the gyroscope's, rad/s. turned: rad on the spot to
    the left and to the right; legs: number of straight ones and their length by the wheels, m.
    """

    separation: float
    left: float
    right: float
    separation_sigma: float
    left_sigma: float
    right_sigma: float
    bias: float
    residual: float
    turned: tuple
    legs: tuple

    def geometry(self, separation: float, radius: float) -> Geometry:
        """The Geometry with these multipliers."""
        return Geometry(self.separation * separation, self.left * radius, self.right * radius)


def calibrate(
    log: DriveLog,
    separation: float,
    radius: float,
    gyro_scale_sigma: float = 0.005,
    leg: float | None = None,
    leg_sigma: float = 0.005,
) -> Calibration:
    """A Calibration of the nominal separation and radius (m) from a DriveLog.

    gyro_scale_sigma: how well the gyroscope's scale is known, relative: it is the separation's floor. leg: the true
    mean length of the straight legs, measured on the floor (m, with leg_sigma), or None. Raises LogError where the
    drive does not tell.
    """
    moves, rests = stretches(log, radius)
    turned, legs = _survey(moves, separation, radius)
    if not moves or sum(turned) < np.pi or len(legs) < 2:
        raise LogError(
            f'the recording has {sum(turned):.1f} rad of turns on the spot and {len(legs)} straight legs, '
            'at least half a turn and two legs are needed'
        )
    (p, q, bias), covariance, residual = _fit(moves, rests, radius, _noise_density(log, rests))
    if p <= 0.0 or q <= 0.0:
        raise LogError(
            'the gyroscope turns against the wheels: check the signs and the order of left_wheel and right_wheel'
        )
    values, sigmas = _multipliers(p, q, covariance, separation)
    scale, scale_sigma = _scale(legs, leg, leg_sigma, values[1:], radius)
    relative = np.hypot(sigmas / values, [np.hypot(gyro_scale_sigma, scale_sigma), scale_sigma, scale_sigma])
    values *= scale
    lengths = [abs(0.5 * (m.left + m.right)) * radius for m in legs]
    return Calibration(
        *values.tolist(),
        *(values * relative).tolist(),
        float(bias),
        residual,
        turned,
        (len(legs), float(np.mean(lengths))),
    )


def odometry_path(log: DriveLog, geometry: Geometry, start: int = 0, end: int | None = None) -> np.ndarray:
    """(k, 3) x, y, heading by these wheels from index start to end of the wheel times, from 0, 0, 0."""
    odometry = Odometry(geometry.separation, geometry.left_radius, geometry.right_radius, 1)
    path = []
    for left, right, time in zip(log.left[start:end], log.right[start:end], log.wheel_times[start:end]):
        odometry.update(left, right, time)
        path.append((odometry.x, odometry.y, odometry.heading))
    return np.array(path)


def reference_path(
    log: DriveLog, geometry: Geometry, bias: float, start: int = 0, end: int | None = None
) -> np.ndarray:
    """The same from the truth where it is known, else the wheels' way along the gyroscope's heading (its bias taken
    off).
    """
    times = log.wheel_times[start:end]
    if log.truth is not None:
        x, y, yaw = (np.asarray(log.truth)[start:end] - np.asarray(log.truth)[start]).T
        c, s = np.cos(log.truth[start][2]), np.sin(log.truth[start][2])
        return np.column_stack((c * x + s * y, c * y - s * x, np.unwrap(yaw)))
    heading = log.turned(times) - bias * times
    heading -= heading[0]
    way = 0.5 * (
        geometry.left_radius * np.diff(log.left[start:end]) + geometry.right_radius * np.diff(log.right[start:end])
    )
    middle = 0.5 * (heading[1:] + heading[:-1])
    x, y = (np.concatenate(([0.0], np.cumsum(way * part))) for part in (np.cos(middle), np.sin(middle)))
    return np.column_stack((x, y, heading))


@dataclass(frozen=True)
class Run:
    """A piece of the drive: start, end (s), angle turned (rad) and way (m) in it, and how far its end is off before and
    after.

    Positions in m, headings in rad.
    """

    start: float
    end: float
    turned: float
    way: float
    position_before: float
    position_after: float
    heading_before: float
    heading_after: float


def end_errors(log: DriveLog, before: Geometry, after: Geometry, bias: float, pause: float = 3.0) -> list:
    """A Run for each piece between rests of `pause` s or more.

    The errors are how far the odometry's end lies from the reference's, both begun at one pose: what UMBmark calls the
    return position error where the run is a square. before, after: Geometry.
    """
    radius = 0.5 * (before.left_radius + before.right_radius)
    rests = log.rests(radius, pause)
    cuts = sorted({0, len(log.wheel_times) - 1, *((begin + end) // 2 for begin, end in rests)})
    runs = []
    for start, end in zip(cuts, cuts[1:]):
        path = odometry_path(log, after, start, end + 1)
        way = float(np.hypot(*np.diff(path[:, :2], axis=0).T).sum())
        if way < 0.1 and np.abs(np.diff(path[:, 2])).sum() < 0.2:
            continue
        reference = reference_path(log, after, bias, start, end + 1)[-1]
        off_before, off_after = (
            odometry_path(log, geometry, start, end + 1)[-1] - reference for geometry in (before, after)
        )
        runs.append(
            Run(
                float(log.wheel_times[start]),
                float(log.wheel_times[end]),
                float(path[-1, 2]),
                way,
                float(np.hypot(*off_before[:2])),
                float(np.hypot(*off_after[:2])),
                float(abs(off_before[2])),
                float(abs(off_after[2])),
            )
        )
    return runs


def _survey(moves, separation, radius):
    """((rad to the left, rad to the right) turned on the spot, [straight legs])."""
    turned, legs = [0.0, 0.0], []
    for move in moves:
        way = abs(0.5 * radius * (move.left + move.right))
        turn = abs(radius * (move.right - move.left)) / separation
        if abs(move.gyro) < STRAIGHT and way >= SHORTEST_LEG:
            legs.append(move)
        elif way < 0.25 * separation * turn:
            turned[0 if move.gyro > 0.0 else 1] += abs(move.gyro)
    return tuple(turned), legs


def _noise_density(log, rests):
    """Variance of the turned angle per second, rad2/s, from the scatter of the rates at rest."""
    scatter = []
    for rest in rests:
        rates = log.rates[(log.gyro_times > rest.start) & (log.gyro_times <= rest.end)]
        if len(rates) >= 3:
            scatter.append((np.var(rates, ddof=1), len(rates)))
    if not scatter:
        return 0.0
    variances, counts = np.array(scatter).T
    return float(np.average(variances, weights=counts - 1) * np.median(np.diff(log.gyro_times)))


def _multipliers(p, q, covariance, separation):
    """Multipliers on separation, left and right radius for a mean radius of 1, and their standard deviations."""
    total = p + q
    jacobian = np.array(
        [
            [-2.0 / (separation * total**2)] * 2 + [0.0],
            [-2.0 * q / total**2, 2.0 * p / total**2, 0.0],
            [2.0 * q / total**2, -2.0 * p / total**2, 0.0],
        ]
    )
    values = np.array([2.0 / (separation * total), 2.0 * q / total, 2.0 * p / total])
    return values, np.sqrt(np.diag(jacobian @ covariance @ jacobian.T))


def _fit(moves, rests, radius, density):
    """((p, q, bias), their covariance, r.m.s. residual of the moves, rad) of the module's equation."""
    rows = np.array(
        [(radius * m.right, -radius * m.left, m.seconds) for m in moves] + [(0.0, 0.0, r.seconds) for r in rests]
    )
    gyro = np.array([stretch.gyro for stretch in moves + rests])
    weight = 1.0 / np.sqrt(density * rows[:, 2] + READING**2)
    solution, covariance, left_over = _solve(rows * weight[:, None], gyro * weight)
    return solution, covariance, float(np.sqrt(np.mean((left_over / weight)[: len(moves)] ** 2)))


def _solve(rows, values):
    """(solution, covariance, residuals) of weighted rows; large residuals scale the covariance up."""
    solution, _, rank, _ = np.linalg.lstsq(rows, values, rcond=None)
    free = len(values) - 3
    if rank < 3 or free < 1:
        raise LogError(
            'the moves are too much alike to tell track and wheels apart: drive straight and turn, both ways'
        )
    residuals = values - rows @ solution
    covariance = np.linalg.inv(rows.T @ rows)
    return solution, covariance * max(1.0, float(residuals @ residuals) / free), residuals


def _scale(legs, leg, leg_sigma, multipliers, radius):
    """(factor on both radii, its relative standard deviation) from a length measured on the floor."""
    if leg is None:
        return 1.0, 0.0
    lengths = [abs(0.5 * radius * (multipliers[0] * m.left + multipliers[1] * m.right)) for m in legs]
    mean = float(np.mean(lengths))
    scatter = float(np.std(lengths, ddof=1)) / np.sqrt(len(lengths))
    return leg / mean, float(np.hypot(leg_sigma / leg, scatter / mean))
