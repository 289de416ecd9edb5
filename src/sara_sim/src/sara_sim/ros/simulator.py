"""The simulator node: a chair behind a Lawicel adapter on a pseudo-terminal, with /clock, and /ground_truth for tests
and plots.

Services make faults happen. While the adapter is unplugged the pseudo-terminal is really gone, and its link too;
plugged in again it is a new one under the same name, as with a USB adapter and its udev rule.
"""

from __future__ import annotations

import sys
import threading
import time

import rospy
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Trigger, TriggerResponse
from visualization_msgs.msg import MarkerArray

from canserial.dbc.bus import BusError
from sara_common.config import ConfigError
from sara_common.ros.node import start_node, until_shutdown
from sara_sim.bus.lawicel import LawicelAdapter
from sara_sim.bus.pacing import KEPT, Pacer, Patience, Speedometer
from sara_sim.bus.terminal import PortError, Terminal
from sara_sim.chair import STEP_S, STEPS_PER_S, SimulatedChair
from sara_sim.chips.scanner import PERIOD_STEPS, sweep_of
from sara_sim.config import ChairConfig
from sara_sim.faults.faults import FaultError
from sara_sim.ros import messages
from sara_sim.ros.make_chair import make_chair
from sara_sim.ros.markers import LIFETIME_S, markers
from sara_sim.ros.settings import SettingsError, SimulatorSettings
from sara_sim.srv import Fault, FaultResponse
from sara_sim.world.obstacles import ObstacleError
from sara_sim.world.world import WorldError

GROUND_TRUTH_STEPS = 2  # 50 Hz of simulated time
DIAGNOSTICS_STEPS = 100
MARKER_STEPS = 20
WAITING_S = 30.0
SLOW_S = 30.0
WAIT_S = 0.002  # of the wall clock


class SimulatorNode:
    """Steps the chair at the asked speed; bytes pass both ways between steps."""

    def __init__(self, chair: SimulatedChair, terminal: Terminal, settings: SimulatorSettings):
        self._chair, self._settings = chair, settings
        self._terminal: Terminal | None = terminal
        self._gps = Terminal(settings.gps_port) if settings.gps_port else None
        self._adapter = LawicelAdapter(settings.bitrate)
        # Services are called by other threads.
        self._lock = threading.Lock()
        self._contacts = 0
        self._was_open = False
        self._dropped = 0
        self._ticks = 0
        self._pacer = Pacer(STEP_S / settings.speed, time.monotonic())
        self._patience = Patience()
        self._speedometer = Speedometer()
        self._clock = rospy.Publisher('/clock', Clock, queue_size=100)
        self._truth = rospy.Publisher('/ground_truth', Odometry, queue_size=10)
        self._diagnostics = rospy.Publisher('/diagnostics', DiagnosticArray, queue_size=5)
        self._scan = rospy.Publisher('scan', LaserScan, queue_size=5) if chair.scanner else None
        self._markers = rospy.Publisher('~obstacles', MarkerArray, queue_size=2)
        rospy.Service('~fault', Fault, self._on_fault)
        rospy.Service('~clear_faults', Trigger, self._on_clear)
        rospy.Service('~calibrate', Trigger, self._on_calibrate)

    def run(self) -> None:
        """Until ROS shuts down."""
        pacer, patience = self._pacer, self._patience
        while not rospy.is_shutdown():
            self._listen(pacer.wait(time.monotonic()))
            if pacer.wait(time.monotonic()) > 0.0:
                continue
            if patience.waiting(self._chair.time, self._unread(), time.monotonic()):
                self._listen(WAIT_S)
                continue
            with self._lock, until_shutdown():
                self._plug()
                self._step()
            now = time.monotonic()
            patience.stepped(self._chair.time, now)
            pacer.stepped(now, patience.step_takes(STEP_S, now))

    def close(self) -> None:
        """Take the terminals and their links away."""
        self._unplug()
        if self._gps:
            self._gps.close()

    def _unplug(self) -> None:
        if self._terminal:
            self._terminal.close()
            self._terminal = None
        self._patience.forget()

    def _on_fault(self, request) -> FaultResponse:
        try:
            arguments = yaml.safe_load(request.arguments) if request.arguments.strip() else {}
            if not isinstance(arguments, dict) or not all(isinstance(name, str) for name in arguments):
                raise FaultError(f'arguments is {request.arguments!r}, allowed is a YAML set of names and values')
            with self._lock:
                text = str(self._chair.faults.add(request.name, **arguments))
        except (FaultError, yaml.YAMLError) as error:
            return FaultResponse(False, str(error))
        rospy.logwarn('fault on command: %s', text)
        return FaultResponse(True, text)

    def _on_clear(self, _) -> TriggerResponse:
        with self._lock:
            ended = self._chair.faults.clear()
        rospy.loginfo('faults on command: %d ended', ended)
        return TriggerResponse(True, f'{ended} faults ended')

    def _on_calibrate(self, _) -> TriggerResponse:
        with self._lock:
            self._chair.calibrate()
        return TriggerResponse(True, "the sensor node's push-button is pressed")

    def _plug(self) -> None:
        """Let the terminal come and go with the adapter."""
        if self._terminal and not self._chair.plugged:
            rospy.logwarn('the adapter is unplugged: %s is gone', self._settings.port)
            self._unplug()
            self._adapter = LawicelAdapter(self._settings.bitrate)  # it has lost its supply
            self._was_open = False
        elif not self._terminal and self._chair.plugged:
            try:
                self._terminal = Terminal(self._settings.port)
            except PortError as error:
                rospy.logerr_throttle(10.0, f'the adapter cannot be plugged in: {error}')
                return
            rospy.loginfo('the adapter is plugged in again at %s', self._settings.port)

    def _unread(self) -> int:
        return self._terminal.unread() if self._terminal and self._adapter.is_open else 0

    def _listen(self, timeout: float) -> None:
        if not self._terminal:
            time.sleep(timeout)
            return
        data = self._terminal.read(timeout)
        if not data:
            return
        closed = self._adapter.closed
        answer, frames = self._adapter.feed(data)
        if self._adapter.closed != closed:
            # What who closes the channel leaves unread is old: the next one must not take it for news. Not when it is
            # opened: that one may be reading already, and is told of a broken port by what vanishes under its hands.
            self._terminal.discard()
        if answer:
            self._write(answer)
        with self._lock:
            for frame in frames:
                self._patience.commanded(self._chair.time, time.monotonic())
                self._chair.receive(frame)
        if not self._adapter.is_open:
            self._patience.forget()
        if self._adapter.is_open != self._was_open:
            self._was_open = self._adapter.is_open
            rospy.loginfo('the CAN channel on %s is now %s', self._settings.port, self._adapter.state)

    def _step(self) -> None:
        frames = self._chair.step()
        self._ticks += 1
        seconds, steps = divmod(self._ticks, STEPS_PER_S)
        stamp = rospy.Time(seconds, steps * (1_000_000_000 // STEPS_PER_S))
        # The clock first: whoever receives the bytes stamps them with it.
        self._clock.publish(Clock(clock=stamp))
        data = b''.join(map(self._adapter.frame_bytes, frames))
        if data:
            self._write(data)
        if self._gps and self._chair.gps.sent:
            self._gps.write(self._chair.gps.sent)  # a receiver does not mind whether anybody reads
        if self._ticks % GROUND_TRUTH_STEPS == 0:
            self._truth.publish(messages.ground_truth(self._chair, stamp))
        if self._scan and self._chair.scanner.scan:
            sweep = sweep_of(self._chair.scanner.scan, self._chair.scanner.optics)
            self._scan.publish(messages.laser_scan(sweep, 'scan', PERIOD_STEPS * STEP_S))
        if self._chair.contacts != self._contacts:
            self._contacts = self._chair.contacts
            rospy.logwarn(
                'contact %d: the chair touches a wall or an obstacle at x %.2f m, y %.2f m',
                self._contacts,
                *self._chair.pose[:2],
            )
        world = self._chair.world
        if (
            self._ticks % MARKER_STEPS == 0
            and (world.obstacles.all or world.ramps or world.thresholds)
            and self._markers.get_num_connections()
        ):
            self._markers.publish(markers(world, stamp, rospy.Duration(LIFETIME_S)))
        if self._ticks % DIAGNOSTICS_STEPS == 0:
            self._report(stamp)

    def _report(self, stamp: rospy.Time) -> None:
        """Diagnostics, and a word to who has not opened the channel."""
        self._diagnostics.publish(messages.status(self._chair, self._adapter, stamp, self._values(), self._slow()))
        if self._terminal and not self._adapter.is_open:
            rospy.loginfo_throttle(WAITING_S, f'waiting for somebody to open the CAN channel on {self._settings.port}')

    def _write(self, data: bytes) -> None:
        if self._terminal and not self._terminal.write(data):
            self._adapter.overrun()
            self._dropped += len(data)
            rospy.logwarn_throttle(
                10.0, f'nobody reads {self._settings.port}: frames are dropped ({self._dropped} bytes so far)'
            )

    def _values(self) -> dict[str, object]:
        """What the node itself counts, for /diagnostics."""
        return {
            'port': self._settings.port,
            'speed asked': self._settings.speed,
            'speed reached': round(self._speedometer.speed, 2),
            'waits for the PC': self._patience.waits,
            'seconds waited for the PC': round(self._patience.waited, 3),
            'longest delay of the PC': round(self._patience.delay(time.monotonic()), 4),
            'steps late': self._pacer.slips,
            'seconds given up': round(self._pacer.lost, 3),
            'bytes dropped': self._dropped,
        }

    def _slow(self) -> str:
        """A sentence if simulated time does not go as fast as it was asked to, else empty; logged now and then."""
        self._speedometer.mark(self._chair.time, time.monotonic())
        speed, asked = self._speedometer.speed, self._settings.speed
        if not self._speedometer.full or speed >= KEPT * asked:
            return ''
        reason = 'the PC no longer commands' if self._patience.failed else 'this machine is not faster'
        text = f'simulated at {speed:.2f} times real time instead of {asked:g}: {reason}'
        rospy.logwarn_throttle(SLOW_S, text)
        return text


def main() -> None:
    """Entry point of nodes/simulator."""
    # This node makes the time the others live in.
    start_node('simulator', disable_rostime=True)
    try:
        settings = SimulatorSettings.from_params(rospy.get_param('~', {}))
        chair = make_chair(settings)
        node = SimulatorNode(chair, Terminal(settings.port), settings)
    except (SettingsError, WorldError, ObstacleError, BusError, ConfigError, OSError) as error:
        rospy.logfatal('the simulator cannot start: %s', error)
        sys.exit(1)
    for name, (value, default) in {
        **chair.config.changes(ChairConfig.of(chair.platform)),
        **chair.options.changes(),
    }.items():
        rospy.logwarn('this is not the reference chair: %s is %r, not %r', name, value, default)
    rospy.loginfo(
        'simulating %s, number %d, on %s, at %g times real time, adapter at %s',
        chair.platform.name,
        settings.seed,
        settings.map or 'an empty floor',
        settings.speed,
        settings.port,
    )
    try:
        node.run()
    finally:
        node.close()
        if chair.wire.log:
            chair.wire.log.close()
