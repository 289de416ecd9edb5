"""Random fixes, velocities, odometry, IMU messages, clocks, datums and zones at navsat_transform_node.

`fuzz_navsat(count, seed)` tells what came of `count` inputs. Nothing may be raised but NoPlace by a service, every
output must be finite with a covariance that is one, and every kind of trouble is said once.
"""

from __future__ import annotations

import datetime
import math

import numpy as np

from sara_lab.fuzz.blocks import Report
from sara_localization.geometry.rigid import Transform
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.gps.fixes import FixData
from sara_localization.gps.grid import NoPlace
from sara_localization.gps.navsat import NavSat
from sara_localization.gps.navsat_config import NavSatConfig
from sara_localization.gps.navsat_status import status
from sara_localization.gps.velocity_heading import VelocityData, VelocityHeading
from sara_localization.inputs.data import ImuData, OdometryData

INPUTS_PER_NODE = 250
WEIRD = (math.nan, math.inf, -math.inf, 0.0, -0.0, 1e-320, 1e-30, 1e15, -1e15, 1e300, -1e300, -1.0, 90.0, -180.0)
FRAMES = ('gps', '/gps', 'far', 'nowhere', '', '/')
PLACES = ((48.1, 11.6), (0.0, 6.0), (-0.01, 179.99), (83.9, 30.0), (-79.9, -100.0), (89.0, 0.0), (-43.5, 172.6))
TODAY = datetime.date(2026, 1, 1)


def fuzz_navsat(count: int, seed: int) -> Report:
    """`count` inputs from a seed."""
    report, rng = Report(), np.random.default_rng(seed)
    while report.inputs < count and not report.faults:
        _Node(rng, report).run(min(INPUTS_PER_NODE, count - report.inputs))
    return report


class _Node:
    """One node of random parameters at a random place, and its clock."""

    def __init__(self, rng, report):
        self.rng, self.report, self.said = rng, report, []
        self.place = PLACES[rng.integers(len(PLACES))]
        buffer = TransformBuffer()
        if rng.random() < 0.8:
            buffer.set_transform('base_link', 'gps', _transform(rng, 0.5))
            buffer.set_transform('base_link', 'far', Transform((1e6, -1e6, 0.0)))
        self.config = _config(rng)
        restarts = bool(rng.random() < 0.5)
        self.node = NavSat(self.config, buffer, self.said.append, today=lambda: TODAY, restarts=restarts)
        self.heading = VelocityHeading(self.node, buffer, self.said.append)
        self.now = 1.7e9 if rng.random() < 0.8 else 10.0

    def run(self, count):
        acts = (
            (0.2, self._fix),
            (0.05, self._velocity),
            (0.3, self._odometry),
            (0.15, self._imu),
            (0.24, self._tick),
            (0.01, self._clock),
            (0.01, self._datum),
            (0.01, self._zone),
            (0.03, self._convert),
        )
        self.report.attack(self.rng, count, acts, lambda: (), lambda: f'{self.config}, {self.place}')
        if self.report.faults:
            return
        accounts = self.node.accounts
        for name, account in accounts.items():
            self.report.kinds.update({f'{name} {kind}': n for kind, n in account.problems.items()})
        self.report.check_said(self.said, sum(len(account.problems) for account in accounts.values()))

    def _fault(self, sentence):
        self.report.faults.append(f'{sentence} ({self.config}, {self.place})')

    def _fix(self):
        rng = self.rng
        chance = rng.random()
        latitude, longitude = (p + _number(rng, 1e-3, 0.01) for p in self.place)
        fix = FixData(
            _stamp(rng, self.now),
            FRAMES[rng.integers(2 if chance < 0.9 else len(FRAMES))],
            int(rng.choice([-1, 0, 1, 2], p=(0.05, 0.85, 0.05, 0.05))),
            latitude,
            longitude,
            _number(rng, 100.0, 0.03),
            _covariance(rng),
            int(rng.choice([0, 1, 2, 3, 77])),
        )
        self.node.on_fix(fix, self.now)

    def _velocity(self):
        rng = self.rng
        east, north, stamp = _number(rng, 1.0, 0.05), _number(rng, 1.0, 0.05), _stamp(rng, self.now)
        if self.node.odometry is not None and rng.random() < 0.5:  # a speed that the odometry has, too
            east, north = self.node.odometry.linear[:2]
        frame = FRAMES[rng.integers(2 if rng.random() < 0.9 else len(FRAMES))]
        found = self.heading.on_velocity(VelocityData(stamp, frame, east, north))
        if found is not None:
            self.report.kinds['gps/heading'] += 1
            if not np.isfinite((*found.orientation, found.orientation_covariance[2, 2])).all():
                self._fault(f'gps/heading is not finite: {found}')

    def _odometry(self):
        rng = self.rng
        frame = 'odom' if rng.random() < 0.98 else FRAMES[rng.integers(len(FRAMES))]
        pose = _transform(rng, 5.0)
        orientation = pose.rotation if rng.random() < 0.97 else tuple(_number(rng, 1.0, 0.3) for _ in range(4))
        covariance = np.diag(10.0 ** rng.uniform(-6, 2, 6))
        if rng.random() < 0.05:
            covariance[rng.integers(6), rng.integers(6)] = WEIRD[rng.integers(len(WEIRD))]
        linear, angular = (tuple(_number(rng, 1.0, 0.01) for _ in range(3)) for _ in range(2))
        stamp = _stamp(rng, self.now)
        self.node.on_odometry(
            OdometryData(stamp, frame, 'base_link', pose.translation, orientation, covariance, linear, angular)
        )

    def _imu(self):
        rng = self.rng
        q = rng.normal(size=4)
        q /= np.linalg.norm(q)
        if rng.random() < 0.05:
            q[rng.integers(4)] = WEIRD[rng.integers(len(WEIRD))]
        if rng.random() < 0.02:
            q[:] = 0.0
        frame = 'base_link' if rng.random() < 0.9 else FRAMES[rng.integers(len(FRAMES))]
        covariance = np.diag([-1.0, 0.0, 0.0]) if rng.random() < 0.05 else np.eye(3)
        self.node.on_imu(ImuData(_stamp(rng, self.now), frame, tuple(q.tolist()), covariance))

    def _tick(self):
        self.now += self.rng.uniform(0.0, 0.3)
        output = self.node.tick(self.now)
        self.report.kinds['odometry/gps'] += len(output.gps)
        for data in output.gps:
            wrong = _wrong(data.position, data.pose_covariance)
            if wrong:
                self._fault(f'odometry/gps: {wrong}')
        if output.filtered is not None:
            self.report.kinds['gps/filtered'] += 1
            f = output.filtered
            if not (abs(f.latitude) <= 90.0 and abs(f.longitude) <= 180.0 and math.isfinite(f.altitude)):
                self._fault(f'gps/filtered is no place: {f}')
        if output.transform is not None:
            self.report.kinds['transforms'] += 1
            t = output.transform.transform
            if not np.isfinite((*t.translation, *t.rotation)).all():
                self._fault(f'the transform is not finite: {t}')
        told = status(self.node, self.now, self.now)
        if 'nan' in told.message or not told.message:
            self._fault(f'diagnostics say {told.message}')

    def _clock(self):
        self.now = max(1.0, self.now + float(self.rng.choice([-1e9, -100.0, -0.5, 100.0, 1e6])))

    def _datum(self):
        rng = self.rng
        latitude, longitude = (p + _number(rng, 1.0, 0.1) for p in self.place)
        orientation = tuple(_number(rng, 1.0, 0.05) for _ in range(4))
        self._asked('datum', self.node.set_datum, latitude, longitude, _number(rng, 100.0, 0.1), orientation)

    def _zone(self):
        text = str(self.rng.choice(['31U', '32U', '1C', '60X', '61N', 'Z', '', '31', '59G', '33X']))
        self._asked('zone', self.node.set_zone, text)

    def _convert(self):
        rng = self.rng
        place = tuple(p + _number(rng, 0.1, 0.05) for p in self.place)
        point = self._asked('from_ll', self.node.from_ll, *place, _number(rng, 100.0, 0.05))
        found = self._asked('to_ll', self.node.to_ll, tuple(_number(rng, 1e4, 0.05) for _ in range(3)))
        for values in (point, found):
            if values is not None and not np.isfinite(values).all():
                self._fault(f'a service answers {values}')

    def _asked(self, name, question, *arguments):
        """The answer, None where it is refused."""
        try:
            return question(*arguments)
        except NoPlace as error:
            self.report.kinds[f'{name} refused'] += 1
            if len(str(error)) < 10:
                self._fault(f'{name} is refused without a sentence')
            return None


def _wrong(position, covariance):
    """What is wrong with odometry/gps; '' where nothing is."""
    if not (np.isfinite(position).all() and np.isfinite(covariance).all()):
        return f'not finite: {position}, {covariance}'
    if np.abs(position[:2]).max() > 1e9:
        return f'out of this world: {position}'
    eigenvalues = np.linalg.eigvalsh(0.5 * (covariance + covariance.T)[:3, :3])
    return '' if eigenvalues.min() > 0.0 else f'no covariance: {covariance}'


def _config(rng):
    """Parameters that are accepted, also odd ones."""
    flags = (
        'zero_altitude',
        'publish_filtered_gps',
        'broadcast_cartesian_transform',
        'broadcast_cartesian_transform_as_parent_frame',
        'use_local_cartesian',
    )
    params = {name: bool(rng.random() < 0.5) for name in flags}
    params.update({name: bool(rng.random() < 0.15) for name in ('use_odometry_yaw', 'wait_for_datum')})
    if rng.random() < 0.7:
        params['magnetic_declination_radians'] = float(rng.choice([0.0, 0.1, -1e3]))
    if params['wait_for_datum'] and rng.random() < 0.5:
        params['datum'] = [float(rng.uniform(-79, 79)), float(rng.uniform(-180, 180)), float(rng.normal())]
    params['yaw_offset'] = float(rng.choice([0.0, math.pi / 2, -1e6]))
    params['velocity_sigma'] = float(rng.choice([0.1, 0.05, 1e-9, 1e9]))
    params['delay'] = float(rng.choice([0.0, 0.0, 3.0, 1e300]))
    return NavSatConfig.from_params(params)


def _number(rng, size, weird):
    return float(WEIRD[rng.integers(len(WEIRD))]) if rng.random() < weird else float(rng.normal() * size)


def _stamp(rng, now):
    chance = rng.random()
    if chance < 0.94:
        return now - rng.uniform(0.0, 0.3) * (rng.random() < 0.3)
    if chance < 0.97:
        return now + rng.normal() * 10.0 ** rng.uniform(-3, 7)
    return float(rng.choice([0.0, -1.0, math.nan, math.inf, 1e-9, 4e9, 1e300]))


def _covariance(rng):
    chance = rng.random()
    if chance < 0.7:
        return np.diag(10.0 ** rng.uniform(-4, 3, 3))
    if chance < 0.8:
        return np.zeros((3, 3))
    matrix = rng.normal(size=(3, 3)) if chance < 0.9 else np.diag(10.0 ** rng.uniform(-9, 12, 3))
    if chance > 0.85:
        matrix[rng.integers(3), rng.integers(3)] = WEIRD[rng.integers(len(WEIRD))]
    return matrix


def _transform(rng, size):
    x, y, z = (_number(rng, size, 0.003) for _ in range(3))
    return Transform.from_xyz_rpy(x, y, z, *(rng.normal(size=2) * 0.05).tolist(), float(rng.uniform(-3.2, 3.2)))
