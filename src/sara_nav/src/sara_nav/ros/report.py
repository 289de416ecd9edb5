"""What move_base says of itself: one sentence and its counts on /diagnostics, once a second."""

from typing import Any

import rospy

from sara_common.diagnostics import ERROR, OK, WARN
from sara_common.ros.diagnostics import Diagnostics
from sara_nav.goals.move_base_config import StepResult


class Report:
    """Reports on a MoveBaseNode."""

    def __init__(self, node: Any):
        self._node = node
        self._diagnostics = Diagnostics('navigation')
        self._at = None

    def forget(self) -> None:
        """Time went back: the next report is due."""
        self._at = None

    def cycle(self, result: StepResult, t: float) -> None:
        """Report on a control cycle at t (s) and its StepResult; what is missed is logged, too."""
        node, machine = self._node, self._node.machine
        doubt = machine.lost.doubt(t, machine.config)
        stale = '; '.join(filter(None, (shell.current(t) for shell in node.shells.values())))
        if node.robot.problem:
            text = (
                f'waiting for the transform {node.settings.global_frame} -> {node.settings.robot_base_frame}: '
                f'{node.robot.problem}'
            )
            (rospy.logwarn_throttle if machine.active else rospy.loginfo_throttle)(5.0, '%s', text)
            self.publish(ERROR if machine.active else WARN, text)
        elif stale:
            self.publish(ERROR if machine.active else WARN, stale)
        elif not node.robot.has_odometry:
            text = f'waiting for odometry on {node.robot.odom_topic}; the velocity is reckoned from the commands'
            rospy.loginfo_throttle(10.0, '%s', text)
            self.publish(WARN, text)
        elif machine.active:
            self.publish(
                WARN if result.text else OK,
                result.text or result.doing or f'{result.phase} ({machine.local_planner.phase})',
            )
        elif doubt:
            self.publish(WARN, doubt)
        else:
            self.publish(OK, 'waiting for a goal on move_base or move_base_simple/goal')

    def publish(self, level: int, text: str) -> None:
        """Publish a level and a sentence, with all counts, unless that was done less than a second ago."""
        now = rospy.Time.now().to_sec()
        if self._at is not None and 0.0 <= now - self._at < 1.0:
            return
        self._at = now
        node = self._node
        values = dict(
            vars(node.machine.counters), refused_goals=node.goals.refused, **node.robot.counts, **node.watch.values()
        )
        for shell in node.shells.values():
            values.update(shell.values())
        values.update(lost=node.machine.lost.probability, last_end=node.goals.last_end, help=node.asked)
        self._diagnostics.publish(level, text, values)
