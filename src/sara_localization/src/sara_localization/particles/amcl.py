"""amcl without ROS: scans and odometry in, the pose in a known map out, when and as the C++ node gives it.

A scan counts once the robot has moved by `update_min_d` or turned by `update_min_a` since the last one that did: the
particles move, are weighed by the scan and, every `resample_interval` scans, drawn anew. With several scanners each
counts once for such a motion. The first scan after a start counts at once.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from sara_common.grids import distances
from sara_common.planar import wrap
from sara_localization.geometry.rigid import Transform
from sara_localization.particles import beams as beam_choice
from sara_localization.particles import field, scan_kernels
from sara_localization.particles.amcl_config import AmclConfig
from sara_localization.particles.belief import Belief, belief
from sara_localization.particles.kept_heading import KeptHeading
from sara_localization.particles.likelihood import MeasurementModel
from sara_localization.particles.lost import Evidence, LostFilter, outside
from sara_localization.particles.odometry_watch import UNKNOWN_SIGMA, OdometryWatch
from sara_localization.particles.particle_filter import ParticleFilter
from sara_localization.particles.scan_input import ScanInput
from sara_localization.particles.scan_models import ScanModel, same_model
from sara_localization.ranges.range_data import FARTHEST, RangeMap

PARTICLES_PER_M2, MOST_SEARCHING = 80, 200_000
"""Of a start anywhere, per square metre of free cells, and in all."""
TRIED_PER_M2, MOST_TRIED = 1500, 40_000
"""Candidates at a time of a search, likewise: so many that chance prefers none of two places that look alike."""
NOT_KNOWN = 0.5
"""The probability of being lost at a pose that was told, until a scan bears it out."""
LOST_WAITS = 1.0
"""s after which a scan counts although the robot stands, while it is lost."""
SEARCH_AGAIN = 8
"""Scans used from one search for the place to the next, while no particle is right."""
DOUBT = 0.5
"""Of the probability that no particle is right: below it a search is made once more, for the robot may have been
carried on since the last. Of the probability of being lost: above it, weights are sharpened.
"""


class Result(NamedTuple):
    """What a scan led to. map_from_odom: None before the first pose. counted: the particles changed; pose: a Belief is
    due to be published, else None.
    """

    map_from_odom: Transform | None
    counted: bool
    pose: Belief | None


class Amcl:
    """`counts`: Counter of what became of the scans; `say`: called with one sentence per kind of trouble."""

    def __init__(self, config: AmclConfig, say: Callable[[str], None] = lambda sentence: None):
        distances.warm()
        scan_kernels.warm()
        self.config, self.say, self._watch = config, say, OdometryWatch()
        self.rng = np.random.default_rng(config.seed)
        self.filter, self.lost, self._heading = ParticleFilter(config, self.rng), LostFilter(), KeptHeading()
        self.counts, self._said = Counter(), set()
        self.map: RangeMap | None = None
        self._model = self._free = self._wanted = None
        self.belief: Belief | None = None
        self.map_from_odom: Transform | None = None
        self._force = False
        self._anywhere = False  # the next scan says where
        self._begin_again()

    def _begin_again(self):
        """The next scan counts at once; the odometry up to it does not."""
        self._last: tuple[float, float, float] | None = None  # the odometry's pose when a scan last counted
        self._due, self._since, self._searched = {}, 0, 0
        self._moved, self._unconfirmed, self._counted_at = True, False, math.nan
        self._heading.forget()

    # What is told from outside

    def set_map(self, map_: RangeMap) -> None:
        """Another map. Particles stay where they are: only a pose that is set moves them."""
        first = self.map is None
        self.map, self._free = map_, field.free_cells(map_)
        self._model = ScanModel(self.config, map_)
        self._heading.forget()
        if first:
            pose, variances = self._wanted or (self.config.initial_pose, np.diag(self.config.initial_variances))
            self._start(pose, variances)
        self._force = self._force or self.config.force_update_after_set_map

    def set_pose(self, pose: Sequence[float], covariance: np.ndarray) -> str:
        """The robot is at x, y, yaw in the map, with a covariance (3, 3) of these. Before there is a map it waits for
        one. Returns '' or the sentence why it is refused.
        """
        covariance = np.asarray(covariance, float)
        if not all(math.isfinite(v) and abs(v) <= FARTHEST for v in pose):
            return 'the pose holds something that is no number'
        if not np.isfinite(covariance).all() or np.abs(covariance).max() > FARTHEST**2:
            return 'the covariance holds something that is no number'
        covariance = 0.5 * (covariance + covariance.T)
        if np.linalg.eigvalsh(covariance).min() < -1e-9 * max(1.0, float(np.abs(covariance).max())):
            return 'the covariance is not positive semidefinite'
        if self.map is None:
            self._wanted = tuple(pose), covariance
            return ''
        self._start(pose, covariance)
        self._force = self._force or self.config.force_update_after_initialpose
        return ''

    def _start(self, pose, covariance):
        self.filter.start_at(pose, covariance)
        self.lost.start(NOT_KNOWN)
        self._begin_again()
        self._anywhere = False

    def start_anywhere(self) -> str:
        """The robot may be on any free cell (`global_localization`). Returns '' or why that cannot be."""
        if self.map is None:
            return 'there is no map yet'
        if not len(self._free):
            return 'the map has no free cell'
        self.filter.start_anywhere(self._random_poses, self._searching)
        self.lost.start(1.0)
        self._begin_again()
        self._anywhere = True
        return ''

    @property
    def _searching(self):
        """Particles with which the place is searched for anywhere."""
        wanted = min(int(PARTICLES_PER_M2 * self._area), MOST_SEARCHING)
        return max(wanted, self.config.max_particles)

    @property
    def _tried(self):
        return int(min(TRIED_PER_M2 * self._area, MOST_TRIED))

    @property
    def _area(self):
        return len(self._free) * self.map.resolution**2

    def force_update(self) -> None:
        """The next scan of each scanner counts, although the robot stands (`request_nomotion_update`)."""
        self._force = True

    def forget_odometry(self) -> None:
        """The clock or the odometry began anew: its next pose is no motion."""
        self._begin_again()

    def reconfigure(self, config: AmclConfig) -> None:
        """Other parameters; the particles stay."""
        anew = not same_model(config, self.config)
        if (config.odom_frame_id, config.base_frame_id) != (self.config.odom_frame_id, self.config.base_frame_id):
            self._begin_again()
        self.config = self.filter.config = config
        if anew and self.map is not None:
            self._model = ScanModel(config, self.map)

    def _random_poses(self, count):
        return field.random_poses(self.map, self._free, count, self.rng)

    def _lost_poses(self, count):
        """Where a robot that was carried away may be."""
        poses = self._random_poses(count)
        return self._heading.turned(poses, self._last[2], self.config.lost_keeps_heading, self.rng)

    # Scans

    def on_scan(self, scan: ScanInput) -> Result | None:
        """Take a scan; None where it could not be used."""
        if self.map is None:
            self.trouble('no_map', f'{scan.frame}: a scan came before the map: dropped')
            return None
        fault = scan.fault
        if fault:
            kind, wrong = fault
            end = 'dropped' if kind == 'bad_scan' else 'the scan is dropped'
            self.trouble(kind, f'{scan.frame}: {wrong}: {end}')
            return None
        self.counts['scans'] += 1
        odometry = (*scan.odometry.translation[:2], scan.odometry.yaw)
        self._look_for_jump(scan.sweep.stamp, odometry)
        first = self._last is None
        moved = first or self._has_moved(odometry)
        if not first and (moved or self._force or self._is_due_at_rest(scan.sweep.stamp)):
            self._due, self._moved = dict.fromkeys(self._due, True), moved
        self._force = self._force and first
        resampled, counted, measured = False, self._due.setdefault(scan.frame, True), None
        if counted:
            self._due[scan.frame], self._counted_at = False, scan.sweep.stamp
            measured = self._count(scan, odometry)
            resampled = self._resample()
        if resampled or first:
            self.belief = belief(self.filter.poses, self.filter.weights)
            x, y, yaw = self.belief.pose
            self.map_from_odom = Transform.from_xyz_rpy(x, y, 0.0, 0.0, 0.0, yaw) @ scan.odometry.inverse()
        if measured is not None:
            self._judge(measured, self.map_from_odom @ scan.odometry)
        return Result(self.map_from_odom, counted, self.belief if resampled or first else None)

    def _look_for_jump(self, stamp, odometry):
        """Odometry that has begun anew tells no motion: the robot is about where it was."""
        jump = self._watch.jump(stamp, odometry)
        if jump and self._last is not None:
            self.trouble('jump', f'{jump}: the robot is taken to be where it was')
            self.forget_odometry()
            self.filter.spread(UNKNOWN_SIGMA)

    def _has_moved(self, odometry):
        way = math.dist(odometry[:2], self._last[:2])
        turn = abs(float(wrap(odometry[2] - self._last[2])))
        return way > self.config.update_min_d or turn > self.config.update_min_a

    def _is_due_at_rest(self, stamp):
        waited = not 0.0 <= stamp - self._counted_at < LOST_WAITS
        return waited and self.lost.probability > self.config.lost_limit

    def _judge(self, measured, pose):
        """Whether the pose that is given is wrong, by a measurement; where it is, the place is searched for."""
        place = *pose.translation[:2], pose.yaw
        far = outside(place, self.filter.poses, self.filter.weights)
        self.lost.update(Evidence(measured.agreement(place), far, self._moved))
        self._heading.remember(self.map_from_odom.yaw, self.lost.probability)
        self._searched += 1
        if self.config.lost_recovery and not self.filter.is_searching and len(self._free) and self._is_search_due():
            self._searched = 0
            self.counts['searches'] += 1
            self.filter.search(self._lost_poses, measured, self._searching, self._tried)

    def _is_search_due(self):
        """Where particles elsewhere make the doubt, readings to come will tell: a search would forget past ones."""
        if self.lost.hidden > self.config.lost_limit and self._searched > SEARCH_AGAIN:
            self._unconfirmed = True
            return True
        confirms = self._unconfirmed and self.lost.hidden < DOUBT
        self._unconfirmed = self._unconfirmed and not confirms
        return confirms

    def _count(self, scan, odometry) -> MeasurementModel | None:
        """The particles move and are weighed; returns the measurement, None where the scan says nothing."""
        if self._last is not None:
            self.filter.move(self._last, odometry)
        self._last = odometry
        chosen = beam_choice.chosen(scan.sweep, scan.mount, self._model.choice, scan.motion)
        if not len(chosen.ranges):
            self.trouble('no_beams', f'{scan.frame}: a scan has no range that can be used')
            return None
        measured = self._model.scan(chosen)
        self._use(scan.frame, measured)
        return measured

    def _resample(self) -> bool:
        """Draw the particles anew where it is time to; whether it was done."""
        self._since += 1
        if self._since % self.config.resample_interval:
            return False
        return self.filter.resample(self._random_poses if len(self._free) else None)

    def _use(self, frame, measured):
        """Weigh the particles by a scan; after a start anywhere, set them where it fits."""
        sharpened = self.config.lost_recovery and self.lost.probability > DOUBT
        if self._anywhere and len(self._free):
            self.filter.start_where_it_fits(self._random_poses, measured, self._tried)
            self._anywhere = False
            self.counts['updates'] += 1
        elif self.filter.weigh(measured.likelihoods(self.filter.poses), sharpened):
            self.counts['updates'] += 1
        else:
            self.trouble('no_fit', f'{frame}: a scan fits no particle: it is not used')

    def trouble(self, kind: str, sentence: str) -> None:
        """Count it, and say the first of its kind."""
        self.counts[kind] += 1
        if kind not in self._said:
            self._said.add(kind)
            self.say(sentence)
