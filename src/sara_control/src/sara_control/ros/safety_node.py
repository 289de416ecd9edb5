"""safety_gate: `cmd_vel_in` to `cmd_vel_out`, smoothed, slowed or stopped, by the readings of the chair's sensors."""

import threading
import time
from collections.abc import Callable, Sequence
from functools import partial

import genpy
import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, LaserScan, Range
from std_msgs.msg import Bool, String, UInt8
from std_srvs.srv import Trigger, TriggerResponse

from canserial.msg import Encoder
from canserial.ros.conversions import has_estimate
from canserial.ros.node import stop
from sara_common.config import ConfigError
from sara_common.diagnostics import ERROR, OK, WARN
from sara_common.ros.diagnostics import Diagnostics
from sara_common.ros.node import on_shutdown, start_node
from sara_common.ros.scans import sweep_of
from sara_control.gate.backlog import Backlog
from sara_control.gate.gate_config import SafetyConfig
from sara_control.gate.guard import Guard
from sara_control.gate.reasons import Announcer, Reason, State, sentence
from sara_control.zones.zone_config import RangeSensor

LEVELS = {State.IDLE: OK, State.DRIVING: OK, State.BRAKING: ERROR, State.HELD: ERROR}
WAITS_PERIOD = 0.5  # s between two words that it waits
SENSORS = (Reason.BUS, Reason.ENCODERS, Reason.IMU, Reason.RANGES)


class SafetyNode:
    """The shell around Guard."""

    def __init__(self) -> None:
        try:
            config = SafetyConfig.from_params(rospy.get_param('~', {}))
        except ConfigError as error:
            stop(f'wrong configuration of {rospy.get_name()}: {error}')
        self.guard = Guard(config)
        self.backlog = Backlog(1.0 / config.rate)
        self.announcer = Announcer()
        self.decision = None
        self.lock = threading.Lock()
        self.stopping = threading.Event()
        self.diagnostics = Diagnostics('safety', 'wheelchair')
        self.out = rospy.Publisher('cmd_vel_out', Twist, queue_size=1, tcp_nodelay=True)
        self.status = rospy.Publisher('~status', String, queue_size=10, latch=True, tcp_nodelay=True)
        self.give_up = rospy.Publisher('~give_up', String, queue_size=10, tcp_nodelay=True)
        self.waits, self.said_to_wait = rospy.Publisher('~waits', Bool, queue_size=1, tcp_nodelay=True), -WAITS_PERIOD
        self.cancel = [rospy.Publisher(topic, GoalID, queue_size=1, tcp_nodelay=True) for topic in config.cancel_topics]
        self.subscribe(config)
        rospy.Service('emergency_stop/reset', Trigger, self.on_reset)
        # reset: a simulation that is started anew sets the clock back, which would kill the timer.
        self.timer = rospy.Timer(rospy.Duration(1.0 / config.rate), lambda _: self.step(), reset=True)
        on_shutdown(self.on_shutdown)

    def subscribe(self, config: SafetyConfig) -> None:
        """Subscribes to the commands and to every input that is watched."""
        gate = config.gate
        self.listen('cmd_vel_in', Twist, lambda now, m: self.guard.on_command(now, m.linear.x, m.angular.z))
        self.listen('emergency_stop', Bool, lambda _, m: self.guard.on_emergency_stop(m.data), at_once=True)
        self.listen('impact', Bool, lambda now, m: self.guard.on_impact(now, m.data), at_once=True)
        self.listen('~profile', String, self.on_profile)
        self.listen('~expect_people', Bool, self.on_expect_people)
        if config.handshake:
            self.listen('mode', UInt8, lambda now, m: self.guard.on_mode(now, m.data), at_once=True)
        if gate.encoder_timeout:
            self.listen(
                'encoders',
                Encoder,
                lambda now, m: self.guard.on_encoder(_stamp(m, now), m.wheel, m.steps, m.time_100us),
            )
        if gate.imu_timeout:
            self.listen(
                'imu/data',
                Imu,
                lambda now, m: self.guard.on_imu(
                    _stamp(m, now),
                    (m.angular_velocity.x, m.angular_velocity.y, m.angular_velocity.z),
                    frozen=not has_estimate(m.angular_velocity_covariance),
                ),
            )
        if gate.range_timeout:
            self.subscribe_ranges(config.zones.sensors)
        if config.scan.enabled:
            self.listen('scan', LaserScan, lambda now, m: self.guard.on_scan(now, sweep_of(m)))
        if gate.localization_timeout:
            self.listen('cmd_vel_mux/active', String, lambda _, m: self.guard.on_source(m.data))
            self.listen(
                'odometry/filtered', Odometry, lambda now, m: self.guard.on_localization(_stamp(m, now), *_numbers(m))
            )

    def subscribe_ranges(self, sensors: Sequence[RangeSensor]) -> None:
        """The filtered ranges, a topic for each sensor, and the raw ones."""
        for sensor in sensors:
            self.listen(
                f'{sensor.name}_range',
                Range,
                lambda now, m, name=sensor.name: self.guard.on_range(_stamp(m, now), name, m.range),
            )
        self.listen(
            'raw_ranges',
            Range,
            lambda now, m: self.guard.on_raw_range(_stamp(m, now), m.header.frame_id.rsplit('_frame', 1)[0], m.range),
        )

    def listen(self, topic: str, kind: type, handle: Callable, at_once: bool = False) -> None:
        """Calls handle(now, message) for each message; at_once: a step follows without waiting for the next cycle."""
        rospy.Subscriber(topic, kind, partial(self.on_message, handle, at_once), queue_size=10, tcp_nodelay=True)

    def on_message(self, handle: Callable, at_once: bool, message: genpy.Message) -> None:
        """Something came."""
        with self.lock:
            handle(rospy.get_time(), message)
        if at_once:
            self.step()

    def on_profile(self, _now: float, message: String) -> None:
        """Another rider."""
        if self.guard.set_profile(message.data):
            rospy.loginfo('the profile is %s, from the next rest on', message.data)
        else:
            rospy.logwarn('there is no profile %s; there are: %s', message.data, ', '.join(self.guard.config.profiles))

    def on_expect_people(self, _now: float, message: Bool) -> None:
        """Whoever is with the chair knows that people are about, or that they have gone."""
        if self.guard.zones.caution.expect(message.data):
            rospy.loginfo('people are expected' if message.data else 'people are not expected')
        else:
            rospy.logwarn('people cannot be expected: caution/memory is 0')

    def on_reset(self, _request: object) -> TriggerResponse:
        """The explicit release of the emergency stop."""
        with self.lock:
            done, why = self.guard.reset()
        rospy.loginfo(why)
        return TriggerResponse(success=done, message=why)

    def step(self) -> None:
        """Tell the wheels what to do, and the rider why."""
        with self.lock:
            if self.stopping.is_set():  # asked and published under one lock: nothing follows the last stop
                return
            now = rospy.get_time()
            backlog = self.backlog.explains(time.monotonic(), self.guard.late(now))
            decision = self.decision = self.guard.step(now, backlog)
            message = Twist()
            message.linear.x, message.angular.z = decision.v, decision.w
            self.out.publish(message)
            text = self.announcer.say(now, decision.state, decision.reason)
        if decision.waits and not 0.0 <= now - self.said_to_wait < WAITS_PERIOD:
            self.said_to_wait = now
            self.waits.publish(Bool(True))
        if decision.give_up:
            self.give_up.publish(sentence(decision.state, decision.reason))
            for topic in self.cancel:
                topic.publish(GoalID())
        if text is not None:
            self.status.publish(text)
            log = rospy.loginfo if LEVELS.get(decision.state, WARN) == OK else rospy.logwarn
            log(text)

    def on_shutdown(self) -> None:
        """The last word is stop."""
        with self.lock:
            self.stopping.set()
            self.out.publish(Twist())
        rospy.rostime.wallsleep(0.1)

    def run(self) -> None:
        """Diagnostics once a second of wall time until ROS shuts down."""
        warned = set()
        while not self.stopping.wait(1.0):
            with self.lock:
                decision, dropped = self.decision, dict(self.guard.dropped)
                missing = self.guard.missing(rospy.get_time())
                latched = self.guard.gate.latched
            for kind in sorted(dropped.keys() - warned):
                rospy.logwarn('dropped: %s; counted in /diagnostics', kind)
                warned.add(kind)
            if decision is None:
                self.diagnostics.publish(WARN, 'waiting for the clock', {})
                continue
            if 'scan' in missing:
                rospy.logwarn_throttle(10.0, 'the laser scanner does not answer: the chair goes by its sonars alone')
            if decision.reason in SENSORS and missing:
                rospy.logwarn_throttle(10.0, 'waiting for ' + ', '.join(missing))
            values = {
                **dropped,
                'state': decision.state.value,
                'emergency stop': latched,
                'profile': self.guard.profile,
                'v': f'{decision.v:.3f}',
                'w': f'{decision.w:.3f}',
                'missing': ', '.join(missing),
            }
            level = LEVELS.get(decision.state, WARN)
            self.diagnostics.publish(
                max(level, WARN) if dropped or 'scan' in missing else level,
                sentence(decision.state, decision.reason),
                values,
            )


def _stamp(message, now):
    """The stamp of a message; now, where it has none."""
    stamp = message.header.stamp.to_sec()
    return stamp if stamp > 0.0 else now


def _numbers(odometry):
    """What must be finite in a pose."""
    pose = odometry.pose.pose
    return (pose.position.x, pose.position.y, pose.orientation.z, pose.orientation.w)


def main() -> None:
    """Run the node."""
    start_node('safety_gate')
    SafetyNode().run()
    rospy.spin()  # until rospy has ended its own shutdown: leaving earlier would cut off the last stop
