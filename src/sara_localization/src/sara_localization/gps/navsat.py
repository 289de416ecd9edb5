"""navsat_transform_node without ROS: fixes in, the robot's position in its world frame out, and places converted.

The world frame is the odometry's. It is laid on the earth once: by the first usable fix and the IMU's heading, or by a
datum that the user gives. Each fix is then the antenna's place in the world frame; the robot's is found by the pose
that the odometry had at the fix's own time, so that an antenna off the centre does not swing the robot about while it
turns.
"""

from __future__ import annotations

import datetime
import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from sara_localization.geometry.rigid import Vector, normalised, yaw_from_quaternion
from sara_localization.geometry.transforms import Transforms
from sara_localization.gps import answers, fixes
from sara_localization.gps.answers import Frames
from sara_localization.gps.fixes import FixData
from sara_localization.gps.grid import Grid, NoPlace
from sara_localization.gps.heading import ImuHeading, correction
from sara_localization.gps.navsat_config import NavSatConfig
from sara_localization.gps.tangent_plane import TangentPlane
from sara_localization.gps.track import Track
from sara_localization.gps.utm import Utm, Zone
from sara_localization.gps.waiting import PATIENCE, PlacedFix, WaitingFixes
from sara_localization.gps.world_frame import Anchor, WorldFrame
from sara_localization.inputs.data import ImuData, OdometryData, StampedTransform
from sara_localization.inputs.status import InputStatus

BACK = 1.0
"""s by which odometry must go back to be that of another run."""
TOPICS = {'fix': 'gps/fix', 'odometry': 'odometry/filtered', 'imu': 'imu/data'}
"""{input: its topic}."""


class NavSatOutput(NamedTuple):
    """What is to be published: odometry/gps, one for each fix; gps/filtered; the transform between grid and world."""

    gps: list[OdometryData]
    filtered: FixData | None = None
    transform: StampedTransform | None = None


class NavSat:
    """Messages in by on_fix, on_odometry, on_imu, which never raise for their data; results out by tick.

    Args:
        config: the parameters.
        transforms: where the antenna and the IMU are on the robot.
        report, inform: called with a sentence, when something is wrong and when something is found out.
        today: the date, for fixes that come in simulated time.
        restarts: whether a clock that goes back means that everything begins anew (simulated time).
        topics: how those of TOPICS are really called, for what is said.
    """

    def __init__(
        self,
        config: NavSatConfig,
        transforms: Transforms,
        report: Callable[[str], None] = lambda sentence: None,
        inform: Callable[[str], None] = lambda sentence: None,
        today: Callable[[], datetime.date] = datetime.date.today,
        restarts: bool = False,
        topics: Mapping[str, str] = TOPICS,
    ):
        self.config, self.restarts = config, restarts
        self._report, self._inform, self._today = report, inform, today
        self.accounts = {name: InputStatus(name, topic) for name, topic in topics.items()}
        self.world: WorldFrame | None = None
        self.frames = Frames('odom', 'base_link')
        self.heading_words = ''
        self._track, self._imu = Track(), ImuHeading(transforms)
        self._waiting, self._placed = WaitingFixes(transforms, self._track), list[PlacedFix]()
        self._zone: Zone | None = None
        self._by_datum = config.wait_for_datum
        self._began = self._now = None
        self.odometry: OdometryData | None = None
        self._last_status, self._filtered_at = 0, None
        self._told = False  # the newest transform has been given out
        if config.wait_for_datum and config.datum is not None:
            latitude, longitude, heading = config.datum
            self.set_datum(latitude, longitude, 0.0, (0.0, 0.0, math.sin(heading / 2), math.cos(heading / 2)))

    # Messages

    def on_fix(self, fix: FixData, now: float) -> None:
        """A fix that came at the time `now` (s)."""
        account = self.accounts['fix']
        account.received += 1
        good, problems = fixes.usable(fix, self.config.zero_altitude, self.config.assumed_sigma)
        for problem in problems:
            self._problem('fix', *problem)
        if good is not None:
            account.last_stamp = fix.stamp
            self._waiting.add(good, now)

    def on_odometry(self, data: OdometryData) -> None:
        """A pose of the robot in the world frame, mostly a filter's."""
        account = self.accounts['odometry']
        account.received += 1
        frame, base = data.frame_id.lstrip('/'), data.child_frame_id.lstrip('/')
        if not frame:
            self._problem('odometry', 'no_frame', 'a message has no frame_id: dropped')
            return
        if self.odometry is not None and frame != self.frames.world:
            why = f'a message in the frame {frame} is dropped; those before were in {self.frames.world}'
            self._problem('odometry', 'other_frame', f'{why}. Do two nodes publish it?')
            return
        if self._track.newest is not None and 0.0 < data.stamp < self._track.newest.stamp - BACK:
            self._problem('odometry', 'went_back', 'its time went back: what came before is forgotten')
            self._track.clear()
        why = self._track.add(data)
        if why:
            self._problem('odometry', 'not_usable', f'a message is dropped: {why}')
            return
        account.used += 1
        self.frames, self.odometry = Frames(frame, base or self.frames.base), data

    @property
    def needs_imu(self) -> bool:
        """Whether the IMU's heading is waited for; messages that come otherwise are of no use."""
        return self.world is None and not self.config.use_odometry_yaw and not self._by_datum

    def on_imu(self, data: ImuData) -> None:
        """A heading of the robot."""
        account = self.accounts['imu']
        account.received += 1
        if not self.needs_imu or self.odometry is None:  # nobody knows yet which frame the robot's is
            return
        problem = self._imu.add(data, self.frames.base)
        if problem is None:
            account.used += 1
        else:
            self._problem('imu', *problem)

    # The services

    def set_datum(self, latitude: float, longitude: float, altitude: float, orientation: Sequence[float]) -> None:
        """The origin of the world frame is there (deg, m; NaN counts as 0), its x axis turned by the yaw of
        `orientation` (x, y, z, w) from east. Raises ValueError.
        """
        try:
            yaw = yaw_from_quaternion(normalised(orientation))
        except ValueError as error:
            raise NoPlace(f'{error}; w = 1 alone heads east') from None
        altitude = altitude if math.isfinite(altitude) else 0.0
        fix = FixData(0.0, '', 0, latitude, longitude, altitude, np.eye(3))
        added = correction(self.config, fix, self._today, measured=False)
        self._lay(Anchor(latitude, longitude, altitude, (0.0, 0.0, 0.0), yaw + added.angle), added.sentence)
        self._by_datum = True

    def set_zone(self, text: str) -> None:
        """Calculate in a UTM zone (31U) from now on, wherever the robot is; the world frame stays where it is on the
        earth. Raises NoPlace.
        """
        if self.config.use_local_cartesian:
            raise NoPlace('use_local_cartesian is true: there is no UTM zone')
        zone = Zone.from_text(text)
        if self.world is not None:
            self._set_world(WorldFrame(self.world.anchor, Utm(zone)))
        self._zone = zone

    def from_ll(self, latitude: float, longitude: float, altitude: float) -> Vector:
        """The point (m) of the world frame at a place (deg, m; NaN: on the ground, z = 0). Raises NoPlace."""
        world = self._known_world()
        ground = world.grid_from_world.translation[2]
        x, y, z = world.from_earth(latitude, longitude, altitude if math.isfinite(altitude) else ground)
        return x, y, 0.0 if self.config.zero_altitude else z

    def to_ll(self, point: Vector) -> tuple[float, float, float]:
        """Latitude, longitude (deg) and altitude (m) of a point (m) of the world frame. Raises NoPlace."""
        return self._known_world().to_earth(point)

    def _known_world(self) -> WorldFrame:
        if self.world is None:
            raise NoPlace(f'where the world frame is on the earth is not known yet: {self.waiting_for()}')
        return self.world

    # Results

    def tick(self, now: float) -> NavSatOutput:
        """What has become known by the time `now` (s)."""
        self._watch_clock(now)
        self._placed += self._waiting.ready(self.frames.base, now)
        for problem in self._waiting.take_problems():
            self._problem('fix', *problem)
        if self.world is None and not self._by_datum and now - self._began >= self.config.delay:
            self._find_world()
        if self.world is None:
            self._forget_impatient(now)
            return NavSatOutput([])
        gps = [answer for placed in self._placed if (answer := self._answer(placed)) is not None]
        self._placed.clear()
        return NavSatOutput(gps, self._filtered(), self._transform(now))

    def _watch_clock(self, now):
        if self._now is not None and now < self._now:
            back = f'the clock went back by {self._now - now:.3f} s: messages from before are forgotten'
            self._problem('odometry', 'clock_went_back', back)
            self._track.clear()
            self._waiting.clear()
            self._placed.clear()
            self._imu.clear()
            self._began = now
            if self.restarts:
                self.odometry, self._told = None, False
                self.world = self.world if self._by_datum else None
        self._now = now
        if self._began is None:
            self._began = now

    def _find_world(self):
        """Lay the world frame by the first fix that waits, as soon as there is a heading."""
        if not self._placed:
            return
        heading = 0.0 if self.config.use_odometry_yaw else self._imu.of_world(self._track)
        if heading is None:
            return
        fix, pose, *_ = placed = self._placed[0]
        added = correction(self.config, fix, self._today, measured=True)
        source = "the odometry's" if self.config.use_odometry_yaw else f"the IMU's, {pose.yaw + heading:.5f} rad"
        anchor = Anchor(fix.latitude, fix.longitude, fix.altitude, placed.antenna, heading + added.angle)
        try:
            self._lay(anchor, f'heading: {source}; {added.sentence}')
        except NoPlace as error:
            self._placed.pop(0)
            self._problem('fix', 'out_of_grid', f'a fix cannot be converted: {error}')

    def _lay(self, anchor, words):
        grid: Grid
        if self.config.use_local_cartesian:
            grid = TangentPlane(anchor.latitude, anchor.longitude)
        else:
            grid = Utm(self._zone or Zone.of(anchor.latitude, anchor.longitude))
        self._set_world(WorldFrame(anchor, grid))
        self.heading_words = words
        self._inform(f'{self.world.description()} ({words})')

    def _set_world(self, world):
        self.world, self._told = world, False

    def _forget_impatient(self, now):
        kept = [placed for placed in self._placed if 0.0 <= now - placed.arrived <= PATIENCE]
        if len(kept) < len(self._placed):
            self._problem('fix', 'too_early', f'fixes are dropped until they can be used: {self.waiting_for()}')
        self._placed = kept

    def _answer(self, placed: PlacedFix) -> OdometryData | None:
        try:
            answer = answers.gps_odometry(self.world, placed, self.frames, self.config.zero_altitude)
        except NoPlace as error:
            self._problem('fix', 'out_of_grid', f'a fix cannot be converted: {error}')
            return None
        self.accounts['fix'].used += 1
        self._last_status = placed.fix.status
        return answer

    def _filtered(self) -> FixData | None:
        """gps/filtered for the newest odometry, once."""
        newest = self._track.newest
        if not self.config.publish_filtered_gps or newest is None or newest.stamp == self._filtered_at:
            return None
        self._filtered_at = newest.stamp
        try:
            return answers.filtered_fix(self.world, self.odometry, newest.pose, self.frames.base, self._last_status)
        except NoPlace as error:
            self._problem('odometry', 'out_of_grid', f'gps/filtered lacks a position: {error}')
            return None

    def _transform(self, now) -> StampedTransform | None:
        """What is broadcast, each time it has changed."""
        if not self.config.broadcast_cartesian_transform or self._told or self.odometry is None:
            return None
        self._told = True
        return answers.grid_transform(self.world, self.config, self.frames.world, now)

    # What is said

    def waiting_for(self) -> str:
        """What keeps the world frame from being laid on the earth; '' where nothing does."""
        if self.world is not None:
            return ''
        if self._by_datum:
            return 'waiting for a datum: call the service datum, or set the parameter datum'
        if self._now is not None and self._now - self._began < self.config.delay:
            return f'waiting for the {self.config.delay:g} s of the parameter delay'
        lacking = ['odometry'] if self.odometry is None else []
        lacking += ['imu'] if self.needs_imu and not self.accounts['imu'].used else []
        lacking += [] if self.accounts['fix'].last_stamp else ['fix']
        topics = [self.accounts[name].topic for name in lacking]
        return 'waiting for ' + (' and '.join(topics) or 'a fix, odometry and heading of the same time')

    def _problem(self, name, kind, sentence):
        said = self.accounts[name].has_problem(kind, sentence)
        if said:
            self._report(said)
