"""The filter as a machine: data in as it arrives, an estimate out at every tick; no ROS, no clock, no threads.

What happens when is robot_localization's: a message is brought into the filter's frames at once and waits in a queue; a
tick takes all that is not from the future, oldest first; with nothing to take for sensor_timeout it predicts. Where
that node is known to go wrong this one does not follow: see measurement.py, history.py, estimator.py, and set_pose
below.

    engine = FilterEngine(FilterConfig.from_params(params, 'ekf'), transforms)
    engine.clock(now)                   # what is added and dated clearly later is dropped
    engine.add_odometry('odom0', OdometryData(...)); engine.add_imu('imu0', ImuData(...))
    output = engine.tick(now)           # FilterOutput, or None before there is anything to say
"""

from __future__ import annotations

import heapq

import numpy as np

from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine import debug_log as trace
from sara_localization.engine import set_pose as placing
from sara_localization.engine.history import History
from sara_localization.engine.make_filter import make_filter
from sara_localization.engine.output import Output
from sara_localization.engine.sensor_timeout import Silence
from sara_localization.filters import kernel
from sara_localization.filters.control import Control
from sara_localization.filters.state import RATES, SIZE
from sara_localization.inputs import raw_measurement
from sara_localization.inputs.data import FilterOutput, ImuData, OdometryData, PoseData, TwistData
from sara_localization.inputs.measurement import STANDSTILL
from sara_localization.inputs.preprocessing import Motion, Preprocessor
from sara_localization.inputs.status import InputStatus


class FilterEngine:
    """One filter.

    Args:
        config: FilterConfig.
        transforms: what gives transforms (transforms.Transforms); its `lookup` must not block.
        report: called with a sentence for the user when something is wrong with the data, once per kind.
        restarts: whether time that goes back is that of a simulation that begins anew, not a computer's that was set.
    """

    def __init__(self, config: FilterConfig, transforms, report=None, restarts: bool = True):
        kernel.warm(config.filter)
        raw_measurement.warm()
        self.config, self.transforms = config, transforms
        self._report, self.restarts = report or (lambda sentence: None), restarts
        self.control = Control(config.control) if config.control else None
        self.preprocessor = Preprocessor(config, transforms, self._report)
        self.filter = make_filter(config, self.control, self.preprocessor.biases)
        self.history = History(config.history_length) if config.smooth_lagged_data and config.history_length else None
        self.enabled, self.on = not config.disabled_at_startup, True
        self.time_jumps = self.not_finite = self.before_history = 0
        self.output = Output(config, transforms, self._report)
        self.silence = Silence(config.hold_after, config.inputs, self._report) if config.hold_after else None
        self.trace = trace.opened(config, self._report)
        self._last_tick = self._seen = None
        self._forget()

    @property
    def inputs(self) -> dict[str, InputStatus]:
        """The account of every input, by name."""
        return self.preprocessor.inputs

    @property
    def missing_transform(self) -> str | None:
        """The sentence that says which transform the output lacks, or None."""
        return self.output.missing_transform

    @property
    def parked(self) -> bool:
        """Whether the robot is known to stand still; False where no extension asks for it."""
        standstill = self.preprocessor.standstill
        return standstill is not None and standstill.parked

    def gyro_bias(self, name: str) -> np.ndarray:
        """The estimated bias of the IMU `name`, (3,) rad/s: in the sensor's frame with 'standstill', about the robot's
        axes with 'state'; zeros where none is estimated.
        """
        states = self.preprocessor.biases.get(name)
        if states:
            bias = np.zeros(3)
            for rate, index in states.items():
                bias[rate - RATES.start] = self.filter.x[index]
            return bias
        standstill = self.preprocessor.standstill
        return standstill.gyros[name].bias.copy() if standstill and name in standstill.gyros else np.zeros(3)

    def reset(self) -> None:
        """As if nothing had ever come in; the counters stay."""
        self.filter.reset()
        self._last_tick = None
        self._forget()

    def _forget(self):
        self._queue, self._sequence, self._seen = [], 0, None
        self.preprocessor.forget()
        if self.history:
            self.history.forget()
        self.output.forget()
        if self.silence:
            self.silence.forget()

    def enable(self) -> bool:
        """Start a filter that was disabled at startup; False if it was running."""
        was, self.enabled = self.enabled, True
        return not was

    def toggle(self, on: bool) -> bool:
        """Stop or resume the use of measurements while output goes on; False if it was so already."""
        changed, self.on = bool(on) != self.on, bool(on)
        return changed

    # Inputs

    def clock(self, now: float) -> None:
        """What is added next comes at `now` (s; 0: unknown): what is dated later is dropped. A tick says so, too."""
        if now > 0.0:
            self.preprocessor.now = now

    def add_odometry(self, name: str, data: OdometryData) -> None:
        """A message of input `name` (odomN); never raises for what the data holds."""
        self._enqueue(name, self.preprocessor.odometry(name, data, self._motion()))

    def add_pose(self, name: str, data: PoseData) -> None:
        """A message of input `name` (poseN)."""
        self._enqueue(name, self.preprocessor.pose(name, data, self._motion()))

    def add_twist(self, name: str, data: TwistData) -> None:
        """A message of input `name` (twistN)."""
        self._enqueue(name, self.preprocessor.twist(name, data, self._motion()))

    def add_imu(self, name: str, data: ImuData) -> None:
        """A message of input `name` (imuN)."""
        self._enqueue(name, self.preprocessor.imu(name, data, self._motion()))

    def add_control(self, command: np.ndarray, stamp: float) -> None:
        """A command (6,) vx vy vz vroll vpitch vyaw in the robot's frame, given at a time (s); one that is not finite
        is dropped.
        """
        if self.control is None:
            return
        if not (np.isfinite(command).all() and np.isfinite(stamp)):
            if not self.control.refused:
                self._report('a command that is not a number is ignored')
            self.control.refused += 1
            return
        self.control.set(command, stamp)
        if self.history:
            self.history.commanded(stamp, self.control.command)

    def _motion(self):
        """The Motion that messages see until the next tick: the state itself, not a copy."""
        if self._seen is None:
            self._seen = Motion(self.filter.x[:SIZE], self.output.turning)
        return self._seen

    def _enqueue(self, name, measurements):
        if not self.enabled:
            return
        for m in measurements:
            self._sequence += 1
            heapq.heappush(self._queue, (m.stamp, self._sequence, name, m))

    def set_pose(self, data: PoseData, now: float) -> str | None:
        """Put the robot at a pose, at rest, at the time `now` (s); whatever was measured before its stamp is ignored.

        A stamp of zero or from the future counts as now. Returns None, or a sentence that says why it was not done:
        robot_localization jumps to the origin when the frame is unknown, and lets the first measurement overwrite a
        pose set before it; here the former is refused and the latter is fused.
        """
        try:
            stamp, x, P = placing.placed(data, now, self.config, self.transforms)
        except placing.Refused as refused:
            return str(refused)
        self.filter.set_state(x, P)
        self.filter.initialised = True
        self.filter.last_measurement_time = now
        self._queue, self._seen = [], None
        self.preprocessor.forget_poses(stamp)
        if self.silence:
            self.silence.forget()
        if self.history:
            self.history.clear()
        self.output.at_rest()
        return None

    # Output

    def tick(self, now: float) -> FilterOutput | None:
        """Take what is in the queue up to `now` (s) and give the estimate; None before the first measurement."""
        if self._last_tick is not None and now < self._last_tick:
            self._time_went_back(now)
        self._last_tick, self._seen = now, None
        self.clock(now)
        if not self.enabled:
            return None
        (self._integrate if self.on else self._idle)(now)
        if self.trace:
            self.trace.tick(now, self.filter)
        if not self.filter.initialised:
            return None
        if not kernel.all_finite(self.filter.x, self.filter.P):
            self.not_finite += 1
            self._report('the state is no longer finite: the filter starts anew; check the covariances of the inputs')
            self.reset()
            return None
        output = self.output.of(self.filter, now if self.on else None)
        if self.silence and self.silence.fresh:
            self.silence.anchor(self.output.world_from_odom(output))
        return output

    def _idle(self, now):
        """Switched off: what came in is forgotten, and the state is as of now."""
        self._queue = []
        if self.history:
            self.history.clear()
        if self.filter.initialised:
            self.filter.last_measurement_time = now

    def _integrate(self, now):
        kf, queue = self.filter, self._queue
        # A measurement from far in the future must not keep the filter from predicting.
        idle = not queue or queue[0][0] > now + max(1.0, self.config.sensor_timeout)
        again = self._go_back(queue[0]) if self.history and queue and kf.initialised else ()
        newest = (self.control.command, self.control.stamp) if self.control else None
        if self.silence and self.silence.holding:
            self.silence.follow(kf, self.transforms.lookup(self.config.odom_frame, self.config.base_link_frame, now))
        while queue and queue[0][0] <= now:
            entry = heapq.heappop(queue)
            stamp, sequence, name, m = entry
            if again and self.control:
                self.history.recall(self.control, stamp)
            taken = kf.process(stamp, m.indices, m.z, m.R, m.threshold, m.extra, m.inflation)
            if self.trace:
                self.trace.measurement(m, taken, kf.nis)
            if sequence not in again and m.source != STANDSTILL:
                self.preprocessor.took(name, m, taken, kf.nis)
                if self.silence and taken:
                    self.silence.heard(name, stamp)
            if self.history:
                self.history.done(entry)
                if not queue or queue[0][0] > stamp:
                    self.history.keep(kf.snapshot())
        if again and self.control:
            self.control.set(*newest)
        if not kf.initialised:
            return
        if self.silence:
            self.silence.hold(kf, now)
        late = idle and now - kf.last_measurement_time >= self.config.sensor_timeout
        if (late or self.config.predict_to_current_time) and now > kf.last_measurement_time:
            kf.predict_to(now)
        if self.history:
            self.preprocessor.history_from = self.history.expire(kf.last_measurement_time)

    def _go_back(self, first):
        """For an oldest measurement that is late: back to before it; returns the sequence numbers of what is done
        again.
        """
        if first[0] >= self.filter.last_measurement_time:
            return ()
        snapshot, again, enough = self.history.go_back(first[0])
        if snapshot is not None:
            self.filter.restore(snapshot)
        if not enough:
            self.before_history += 1
            self._say_before_history(*first[::2])
        for entry in again:
            heapq.heappush(self._queue, entry)
        return {entry[1] for entry in again}

    def _say_before_history(self, stamp, name):
        late, kept = self.filter.last_measurement_time - stamp, self.history.length
        why = f'a message comes {late:.3f} s late, history_length is {kept:g} s: it cannot be put in its place'
        sentence = self.inputs[name].has_problem('before_history', why)
        if sentence:
            self._report(sentence)

    def _time_went_back(self, now):
        self.time_jumps += 1
        back = f'time went back from {self._last_tick:.3f} to {now:.3f} s'
        if not self.restarts:
            self._report(f'{back}: the robot is where it was, and what came before is forgotten')
            self.filter.last_measurement_time += now - self._last_tick
            self._forget()
        elif self.config.reset_on_time_jump:
            self._report(f'{back}: the filter starts anew')
            self.reset()
        else:
            self._report(f'{back}: measurements are ignored until it catches up; reset_on_time_jump would start anew')

    def status_lines(self, now: float) -> list[str]:
        """One line per input on what became of its messages, and one for a transform that the output lacks."""
        lines = [status.line(now) for status in self.inputs.values()]
        return lines + ([self.missing_transform] if self.missing_transform else [])
