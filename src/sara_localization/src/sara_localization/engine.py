"""The filter as a machine: data in as it arrives, an estimate out at every tick; no ROS, no clock, no threads.

What happens when is robot_localization's: a message is brought into the filter's frames at once and waits in a queue; a
tick takes all that is not from the future, oldest first; with nothing to take for sensor_timeout it predicts. Where that
node is known to go wrong this one does not follow: see measurement.py, and set_pose below.

    engine = FilterEngine(FilterConfig.from_params(params), transforms)
    engine.add_odometry('odom0', OdometryData(...)); engine.add_imu('imu0', ImuData(...))
    output = engine.tick(now)           # FilterOutput, or None before there is anything to say
"""
from __future__ import annotations

import heapq
from typing import Dict, List, Optional

import numpy as np

from . import measurement
from .config import FilterConfig
from .data import FilterOutput, ImuData, OdometryData, PoseData, StampedTransform, TwistData
from .ekf import Ekf
from .geometry import Transform
from .measurement import MissingTransform
from .state import ANGLES, POSE, POSITION, RATES, SIZE, TWIST
from .status import InputStatus

SET_POSE_VARIANCE = 1e-6
SMALLEST_SET_POSE_VARIANCE = 1e-9


class FilterEngine:
    """One filter.

    Args:
        config: FilterConfig.
        transforms: what gives transforms (transforms.Transforms); its `lookup` must not block.
        report: called with a sentence for the user when something is wrong with the data, once per kind.
    """

    def __init__(self, config: FilterConfig, transforms, report=None):
        self.config, self.transforms = config, transforms
        self._report = report or (lambda sentence: None)
        self.filter = Ekf(config.process_noise_covariance, config.initial_estimate_covariance, config.initial_state)
        self.inputs: Dict[str, InputStatus] = {i.name: InputStatus(i.name, i.topic) for i in config.inputs}
        self._configs = {i.name: i for i in config.inputs}
        self.time_jumps = 0
        self.not_finite = 0
        self.missing_transform: Optional[str] = None
        self._last_tick = None
        self._forget()

    def reset(self):
        """As if nothing had ever come in; the counters stay."""
        self.filter.reset()
        self._last_tick = None
        self._forget()

    def _forget(self):
        self._queue, self._sequence = [], 0
        self._last_stamps: Dict[str, float] = {}
        self._ignore_until = 0.0
        self._published_stamp = 0.0
        self._rates, self._rates_time = np.zeros(3), 0.0
        self._angular_acceleration, self._angular_acceleration_covariance = np.zeros(3), np.zeros((3, 3))

    # Inputs

    def add_odometry(self, name: str, data: OdometryData):
        """A message of input `name` (odomN); never raises for what the data holds."""
        mask = self._configs[name].mask
        if self._accept(name, data.stamp):
            self._add_pose(name, data.pose, mask[POSE])
            self._add_twist(name, data.twist, mask[TWIST])

    def add_pose(self, name: str, data: PoseData):
        """A message of input `name` (poseN)."""
        if self._accept(name, data.stamp):
            self._add_pose(name, data, self._configs[name].mask[POSE])

    def add_twist(self, name: str, data: TwistData):
        """A message of input `name` (twistN)."""
        if self._accept(name, data.stamp):
            self._add_twist(name, data, self._configs[name].mask[TWIST])

    def add_imu(self, name: str, data: ImuData):
        """A message of input `name` (imuN)."""
        if not self._accept(name, data.stamp):
            return
        config, mask = self._configs[name], self._configs[name].mask
        frame, two_d = self.config.base_link_frame, self.config.two_d_mode
        if any(mask[ANGLES]) and measurement.measures(data.orientation_covariance):
            self._enqueue(name, '_pose', data.stamp, lambda source: measurement.imu_orientation(
                data, mask[ANGLES], source, self.transforms, frame, two_d, config.pose_threshold))
        if any(mask[RATES]) and measurement.measures(data.angular_velocity_covariance):
            covariance = np.zeros((6, 6))
            covariance[3:, 3:] = np.reshape(data.angular_velocity_covariance, (3, 3))
            turning = TwistData(data.stamp, data.frame_id, (0.0, 0.0, 0.0), data.angular_velocity, covariance)
            self._add_twist(name, turning, (False, False, False) + tuple(mask[RATES]))
        if any(mask[12:]) and measurement.measures(data.linear_acceleration_covariance):
            gravity = self.config.gravitational_acceleration if config.remove_gravity else None
            self._enqueue(name, '_acceleration', data.stamp, lambda source: measurement.acceleration(
                data, mask[12:], source, self.transforms, frame, self.filter.x, self._angular_acceleration, gravity, two_d,
                config.acceleration_threshold))

    def _add_pose(self, name, data, mask):
        if any(mask):
            threshold = self._configs[name].pose_threshold
            self._enqueue(name, '_pose', data.stamp, lambda source: measurement.pose(
                data, mask, source, self.transforms, self.config.world_frame, self.config.two_d_mode, threshold))

    def _add_twist(self, name, data, mask):
        if any(mask):
            threshold = self._configs[name].twist_threshold
            self._enqueue(name, '_twist', data.stamp, lambda source: measurement.twist(
                data, mask, source, self.transforms, self.config.base_link_frame, self.filter.x[RATES],
                self.config.two_d_mode, threshold))

    def _accept(self, name, stamp) -> bool:
        status = self.inputs[name]
        status.received += 1
        if not np.isfinite(stamp) or stamp <= 0.0:
            self._problem(status, 'no_stamp', 'the message has no time stamp')
        elif stamp <= self._ignore_until:
            self._problem(status, 'before_set_pose', 'the message is not newer than the last set_pose: ignored')
        else:
            status.last_stamp = stamp
            return True
        return False

    def _enqueue(self, name, part, stamp, prepare):
        """Prepare one part of a message and put it into the queue, unless it is older than its predecessor."""
        status, source = self.inputs[name], name + part
        if stamp < self._last_stamps.get(source, stamp):
            self._problem(status, 'out_of_order', 'the message at %.3f s is older than the one before it: ignored' % stamp)
            return
        self._last_stamps[source] = stamp
        try:
            prepared, problems = prepare(source)
        except MissingTransform as error:
            self._say(status.lacks(str(error), stamp))
            return
        status.missing = None
        for problem in problems:
            self._problem(status, problem.kind, problem.sentence)
        if prepared is not None:
            self._sequence += 1
            heapq.heappush(self._queue, (stamp, self._sequence, name, prepared))

    def _problem(self, status, kind, sentence):
        self._say(status.has_problem(kind, sentence))

    def _say(self, sentence):
        if sentence:
            self._report(sentence)

    # set_pose

    def set_pose(self, data: PoseData, now: float) -> Optional[str]:
        """Put the robot at a pose, at rest, at the time `now` (s); whatever was measured before its stamp is ignored.

        A stamp of zero or from the future counts as now. Returns None, or a sentence that says why it was not done:
        robot_localization jumps to the origin when the frame is unknown, and lets the first measurement overwrite a pose
        set before it; here the former is refused and the latter is fused.
        """
        mask = (True,) * 6
        covariance = np.array(data.covariance, dtype=float).reshape(6, 6)
        if not np.isfinite(covariance).all() or not np.isfinite([*data.position, *data.orientation]).all():
            return 'set_pose holds something that is not a number: ignored'
        np.fill_diagonal(covariance, np.maximum(covariance.diagonal(), SMALLEST_SET_POSE_VARIANCE))
        stamp = data.stamp if 0.0 < data.stamp <= now else now
        frame = data.frame_id or self.config.world_frame
        pose = PoseData(stamp, frame, data.position, data.orientation, covariance)
        try:
            prepared, problems = measurement.pose(pose, mask, 'set_pose', self.transforms, self.config.world_frame,
                                                  self.config.two_d_mode)
        except MissingTransform as error:
            return 'set_pose is ignored: %s' % error
        bad = [p.sentence for p in problems if p.kind == 'bad_orientation']
        if bad:
            return 'set_pose is ignored: %s' % bad[0]
        x, P = np.zeros(SIZE), np.eye(SIZE) * SET_POSE_VARIANCE
        inside = [k for k, i in enumerate(prepared.indices) if i < POSE.stop]
        indices = np.array(prepared.indices)[inside]
        x[indices] = prepared.z[inside]
        P[indices[:, None], indices] = prepared.R[np.ix_(inside, inside)]
        self.filter.set_state(x, P)
        self.filter.initialised = True
        self.filter.last_measurement_time = now
        self._queue = []
        self._ignore_until = stamp
        self._rates = np.zeros(3)
        return None

    # Output

    def tick(self, now: float) -> Optional[FilterOutput]:
        """Take what is in the queue up to `now` (s) and give the estimate; None before the first measurement."""
        if self._last_tick is not None and now < self._last_tick:
            self._time_went_back(now)
        self._last_tick = now
        self._integrate(now)
        if not self.filter.initialised:
            return None
        if not (np.isfinite(self.filter.x).all() and np.isfinite(self.filter.P).all()):
            self.not_finite += 1
            self._report('the state is no longer finite: the filter starts anew; check the covariances of the inputs')
            self.reset()
            return None
        self._differentiate(now)
        return self._output()

    def _integrate(self, now):
        ekf, queue = self.filter, self._queue
        # A measurement from far in the future must not keep the filter from predicting.
        idle = not queue or queue[0][0] > now + max(1.0, self.config.sensor_timeout)
        while queue and queue[0][0] <= now:
            stamp, _, name, m = heapq.heappop(queue)
            if ekf.process(stamp, m.indices, m.z, m.R, m.threshold):
                self.inputs[name].used += 1
            else:
                self.inputs[name].rejected += 1
        if not ekf.initialised:
            return
        late = idle and now - ekf.last_measurement_time >= self.config.sensor_timeout
        if late or self.config.predict_to_current_time:
            ekf.predict_to(now)

    def _differentiate(self, now):
        """Angular acceleration from the rates of two ticks, for sensors off the robot's centre."""
        dt = now - self._rates_time
        rates = self.filter.x[RATES].copy()
        if dt > 0.0:
            self._angular_acceleration = (rates - self._rates) / dt
            self._angular_acceleration_covariance = self.filter.P[RATES, RATES] * (2.0 / (dt * dt))
        self._rates, self._rates_time = rates, now

    def _output(self) -> FilterOutput:
        config, stamp, x = self.config, self.filter.last_measurement_time, self.filter.x
        pose = Transform.from_xyz_rpy(*x[POSITION].tolist(), *x[ANGLES].tolist())
        fresh = config.permit_corrected_publication or stamp > self._published_stamp
        transform = self._transform(stamp, pose) if config.publish_tf and fresh else None
        self._published_stamp = stamp
        return FilterOutput(stamp, config.world_frame, config.base_link_frame_output, x, self.filter.P, pose, transform,
                            fresh, self._angular_acceleration, self._angular_acceleration_covariance)

    def _transform(self, stamp, pose) -> Optional[StampedTransform]:
        config, dated = self.config, stamp + self.config.transform_time_offset
        if config.invert_tf:
            return StampedTransform(dated, config.base_link_frame_output, config.world_frame, pose.inverse())
        if not config.publishes_map_to_odom:
            return StampedTransform(dated, config.world_frame, config.base_link_frame_output, pose)
        base_from_odom = self.transforms.lookup(config.base_link_frame, config.odom_frame, stamp)
        if base_from_odom is None:
            missing = 'no transform %s -> %s: %s -> %s cannot be published' % (
                config.odom_frame, config.base_link_frame, config.map_frame, config.odom_frame)
            if self.missing_transform is None:
                self._report(missing)
            self.missing_transform = missing
            return None
        self.missing_transform = None
        return StampedTransform(dated, config.map_frame, config.odom_frame, pose @ base_from_odom)

    def _time_went_back(self, now):
        self.time_jumps += 1
        if self.config.reset_on_time_jump:
            self._report('time went back from %.3f to %.3f s: the filter starts anew' % (self._last_tick, now))
            self.reset()
        else:
            self._report('time went back from %.3f to %.3f s: measurements are ignored until it catches up; '
                         'reset_on_time_jump would start anew' % (self._last_tick, now))

    def status_lines(self, now: float) -> List[str]:
        """One line per input on what became of its messages, and one for a transform that the output lacks."""
        lines = [status.line(now) for status in self.inputs.values()]
        return lines + ([self.missing_transform] if self.missing_transform else [])
