"""A FilterEngine driven by the messages of a bag, in lockstep with the times at which they were recorded.

Messages are delivered in the order and at the times they were received; tick k comes k/frequency after the first used
message (/tf counts) and runs after all that was received by then; five ticks follow the last. Transforms come from the
bag's /tf and /tf_static, from outside, and from the filter itself, whose own enter right after the tick that gives
them. Times further apart than LONGEST_STEP are those of a clock that was set, and no ticks come between.
"""

from __future__ import annotations

import rospy

from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.engine import FilterEngine
from sara_localization.filters.estimator import LONGEST_STEP
from sara_localization.geometry.stamps import Stamp
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.inputs.data import FilterOutput
from sara_localization.ros import conversions
from sara_localization.ros.bags import bag_tools
from sara_localization.ros.bags.bag_tools import TF_TOPICS, Unread
from sara_localization.ros.inputs import KINDS, resolved

TICKS_AFTER_LAST = 5
SET_POSE, CONTROL = '/set_pose', '/cmd_vel'


class BagFilter:
    """The lockstep rule around a FilterEngine.

    Args:
        config: FilterConfig; static: list of (parent, child, Transform).
        on_output: called with (time of the tick in s, FilterOutput) for every output.
        on_input: called with (InputConfig, data) for every message of an input.
        report: called with a sentence for the user when something is wrong.
    """

    def __init__(self, config: FilterConfig, static=(), on_output=None, report=None, on_input=None):
        self.config, self.buffer = config, TransformBuffer()
        for parent, child, transform in static:
            self.buffer.set_transform(parent, child, transform)
        self.report = report or (lambda sentence: None)
        self.engine = FilterEngine(config, self.buffer, self.report)
        self.on_output = on_output or (lambda now, output: None)
        self.on_input = on_input or (lambda i, data: None)
        self._by_topic = bag_tools.by_topic(config)
        self.start = self._next = None  # ns: of the first used message, of the next tick
        self.ticks = self.messages = 0
        self.last = None

    @property
    def topics(self) -> list[str]:
        """All topics to be read from the bag, with a leading slash."""
        return [*self._by_topic, *TF_TOPICS, SET_POSE] + ([CONTROL] if self.config.control is not None else [])

    def deliver(self, topic: str, msg: object, received: rospy.Time | Stamp) -> None:
        """One message of the bag, or a bag_tools.Unread, at the time (rospy.Time or Stamp) it was received."""
        topic = resolved(topic)
        read = msg.message if isinstance(msg, Unread) and topic in (*TF_TOPICS, SET_POSE, CONTROL) else msg
        now = received if isinstance(received, Stamp) else conversions.seconds(received)
        nanoseconds = now.nanoseconds
        if self.start is None and (topic in self._by_topic or topic == '/tf'):
            self.start = nanoseconds
            self._next = self._tick_time(1)
        if self.start is not None:
            while self._next < nanoseconds:
                self._tick()
                if nanoseconds - self._next > LONGEST_STEP * 1e9:
                    self._skip_to(now)
        self.engine.clock(now)
        if topic in TF_TOPICS:
            bag_tools.enter_transforms(self.buffer, topic, read)
        elif topic == SET_POSE:
            refused = self.engine.set_pose(conversions.pose(read), now)
            if refused:
                self.report(refused)
        elif topic == CONTROL and self.config.control is not None:
            try:
                stamp, command = conversions.command(read, now, self.config.base_link_frame)
            except ValueError as error:
                self.report(str(error))
            else:
                self.engine.add_control(command, stamp)
        for i in self._by_topic.get(topic, ()):
            self._give(i, bag_tools.converted(i, topic, msg))

    def _enter(self, topic: str, data: object) -> None:
        """Plain data to every input of a topic."""
        for i in self._by_topic.get(topic, ()):
            self._give(i, data)

    def _give(self, i, data):
        getattr(self.engine, KINDS[i.kind].method)(i.name, data)
        self.on_input(i, data)
        self.messages += 1

    def finish(self) -> None:
        """The ticks after the last message."""
        if self.start is not None:
            for _ in range(TICKS_AFTER_LAST):
                self._tick()

    def _skip_to(self, now):
        """The clock was set while the bag was recorded: there was no time between, and no ticks."""
        self.report(
            f"the bag's clock was set from {1e-9 * self._next:.3f} to {now:.3f} s: the filter goes on from there"
        )
        self.start += now.nanoseconds - self._next
        self._next = now.nanoseconds

    def _tick_time(self, k):
        return self.start + round(k * 1e9 / self.config.frequency)

    def _tick(self):
        self.ticks += 1
        now = Stamp(*divmod(self._next, 10**9))
        self._next = self._tick_time(self.ticks + 1)
        output = self.engine.tick(now)
        if output is None:
            return
        self.last = output
        if output.transform is not None:
            t = output.transform
            self.buffer.set_transform(t.parent, t.child, t.transform, t.stamp)
        self.on_output(now, output)
        self._took(now, output)

    def _took(self, now: Stamp, output: FilterOutput) -> None:
        """After an output has been given out at `now`."""
