"""The simulator node: a chair behind a Lawicel adapter on a pseudo-terminal, with /clock, and /ground_truth for tests and plots."""

from __future__ import annotations

import sys
import time
from math import cos, sin

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock

from sara_sim.chair import STEP_S, STEPS_PER_S, SimulatedChair
from sara_sim.lawicel import LawicelAdapter
from sara_sim.pacing import Pacer
from sara_sim.settings import SettingsError, SimulatorSettings
from sara_sim.terminal import PortError, Terminal
from sara_sim.world import World, WorldError

GROUND_TRUTH_STEPS = 2  # 50 Hz of simulated time
DIAGNOSTICS_STEPS = 100
WAITING_S = 30.0


class SimulatorNode:
    """Steps the chair at the asked speed; bytes pass both ways between steps."""

    def __init__(self, chair: SimulatedChair, terminal: Terminal, settings: SimulatorSettings):
        self._chair, self._terminal, self._settings = chair, terminal, settings
        self._adapter = LawicelAdapter()
        self._contacts = 0
        self._was_open = False
        self._dropped = 0
        self._ticks = 0
        self._clock = rospy.Publisher('/clock', Clock, queue_size=100)
        self._truth = rospy.Publisher('/ground_truth', Odometry, queue_size=10)
        self._diagnostics = rospy.Publisher('/diagnostics', DiagnosticArray, queue_size=5)

    def run(self) -> None:
        """Until ROS shuts down."""
        self._pacer = pacer = Pacer(STEP_S / self._settings.speed, time.monotonic())
        while not rospy.is_shutdown():
            self._listen(pacer.wait(time.monotonic()))
            if pacer.wait(time.monotonic()) > 0.0:
                continue
            self._step()
            pacer.stepped(time.monotonic())

    def _listen(self, timeout: float) -> None:
        data = self._terminal.read(timeout)
        if not data:
            return
        switched = self._adapter.switched
        answer, frames = self._adapter.feed(data)
        if self._adapter.switched != switched:
            # What an earlier reader left unread is old: a new one must not take it for news.
            self._terminal.discard()
        if answer:
            self._write(answer)
        for frame in frames:
            self._chair.receive(frame)
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
        if self._ticks % GROUND_TRUTH_STEPS == 0:
            self._truth.publish(self._ground_truth(stamp))
        if self._chair.contacts != self._contacts:
            self._contacts = self._chair.contacts
            rospy.logwarn('contact %d: the chair touches a wall at x %.2f m, y %.2f m', self._contacts, *self._chair.pose[:2])
        if self._ticks % DIAGNOSTICS_STEPS == 0:
            self._diagnostics.publish(self._status(stamp))
            if not self._adapter.is_open:
                rospy.loginfo_throttle(WAITING_S, 'waiting for somebody to open the CAN channel on %s' % self._settings.port)

    def _write(self, data: bytes) -> None:
        if not self._terminal.write(data):
            self._adapter.overrun()
            self._dropped += len(data)
            rospy.logwarn_throttle(10.0, 'nobody reads %s: frames are dropped (%d bytes so far)' % (self._settings.port, self._dropped))

    def _ground_truth(self, stamp) -> Odometry:
        message = Odometry()
        message.header.stamp, message.header.frame_id, message.child_frame_id = stamp, 'map', 'base_link'
        x, y, yaw = self._chair.pose
        message.pose.pose.position.x, message.pose.pose.position.y = x, y
        message.pose.pose.orientation.z, message.pose.pose.orientation.w = sin(yaw / 2), cos(yaw / 2)
        message.twist.twist.linear.x, message.twist.twist.angular.z = self._chair.velocity
        return message

    def _status(self, stamp) -> DiagnosticArray:
        chair, adapter = self._chair, self._adapter
        values = {
            'port': self._settings.port, 'channel': adapter.state, 'contacts': chair.contacts, 'touching': chair.drive.touching,
            'modoPC': chair.motor.mode, 'bytes dropped': self._dropped, 'steps late': self._pacer.slips,
            'seconds given up': round(self._pacer.lost, 3), **{f'adapter: {k}': v for k, v in sorted(adapter.counts.items())},
            **{f'bus: {k}': v for k, v in sorted(chair.counts.items())}, **{f'motor node: {k}': v for k, v in sorted(chair.motor.counts.items())},
        }
        level, text = DiagnosticStatus.OK, 'running'
        if not adapter.is_open:
            level, text = DiagnosticStatus.WARN, 'nobody has opened the CAN channel'
        elif chair.drive.touching:
            level, text = DiagnosticStatus.WARN, 'the chair touches a wall'
        message = DiagnosticArray()
        message.header.stamp = stamp
        message.status = [DiagnosticStatus(level=level, name='simulator: chair', message=text, hardware_id='simulated',
                                           values=[KeyValue(key, str(value)) for key, value in values.items()])]
        return message


def main() -> None:
    """Entry point of nodes/simulator."""
    # This node makes the time the others live in.
    rospy.init_node('simulator', disable_rostime=True)
    try:
        settings = SimulatorSettings.from_params(rospy.get_param('~', {}))
        world = World.from_yaml(settings.map) if settings.map else World.empty()
        chair = SimulatedChair(world, settings.seed, settings.start)
        terminal = Terminal(settings.port)
    except (SettingsError, WorldError, PortError) as error:
        rospy.logfatal('the simulator cannot start: %s', error)
        sys.exit(1)
    for name, (value, default) in chair.config.changes().items():
        rospy.logwarn('this is not the reference chair: %s is %r, not %r', name, value, default)
    rospy.loginfo('simulating chair %d on %s, at %g times real time, adapter at %s', settings.seed, settings.map or 'an empty floor',
                  settings.speed, settings.port)
    with terminal:
        SimulatorNode(chair, terminal, settings).run()
