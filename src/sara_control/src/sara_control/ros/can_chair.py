"""The chair on its CAN bus as a WheelBase: `encoders`, `mode` and, where the PC helps the chair's joystick, `joystick`
(canserial's read.py) in, `cantx` out.
"""

import threading
from collections import deque

import rospy
from sensor_msgs.msg import Joy
from std_msgs.msg import UInt8

from canserial.dbc.bus import BusDescription
from canserial.dbc.modes import OFF
from canserial.msg import CAN, Encoder
from canserial.reader.readings import EncoderReading
from canserial.ros.conversions import frame_to_msg
from sara_control.wheels.base import WheelBase, WheelPositions
from sara_control.wheels.can_base import CanBase
from sara_control.wheels.config import ControllerConfig


class CanChair(WheelBase):
    """One joint a side. params: `dbc`, the bus as canserial names it, and `assists`, whether shared control runs."""

    def __init__(self, config: ControllerConfig, params: dict) -> None:
        super().__init__(config, params)
        if len(config.left_joints) != 1:
            raise ValueError(
                f'left_wheel and right_wheel are {config.left_joints} and {config.right_joints}, '
                'allowed is one joint a side'
            )
        assists = params.get('assists', False)
        if not isinstance(assists, bool):
            raise ValueError(f'assists is {assists!r}, allowed are true and false')
        bus = BusDescription.named(params['dbc']) if params.get('dbc') else BusDescription.default()
        self.can = CanBase.from_config(bus, config, assists)
        self.counters = self.can.counters
        self._lock = threading.Lock()
        self._positions = deque(maxlen=100)
        self._cantx = rospy.Publisher('cantx', CAN, queue_size=10, tcp_nodelay=True)
        rospy.Subscriber('mode', UInt8, self._on_mode, queue_size=10, tcp_nodelay=True)
        if assists:
            rospy.Subscriber('joystick', Joy, self._on_joystick, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber('encoders', Encoder, self._on_encoder, queue_size=20, tcp_nodelay=True)

    def read(self, t: float) -> list[WheelPositions]:
        """What came since the last call."""
        with self._lock:
            positions = list(self._positions)
            self._positions.clear()
        return positions

    def write(self, left: float, right: float, t: float) -> None:
        """A command frame; while the joystick drives, the question for control."""
        with self._lock:
            frame = self.can.command(left, right)
        self._cantx.publish(frame_to_msg(frame))

    def stop(self, t: float) -> None:
        """The frame that stops both wheels."""
        self._cantx.publish(frame_to_msg(self.can.stop()))

    @property
    def may_drive(self) -> bool:
        """Whether modoPC allows it."""
        return self.can.may_drive

    @property
    def state(self) -> str:
        """Who drives."""
        mode = self.can.mode
        if self.may_drive:
            return 'the PC drives'
        who = 'nobody' if mode == OFF else 'the joystick'
        return f'{who} drives (modoPC is {"unknown" if mode is None else mode})'

    def _on_mode(self, message):
        with self._lock:
            before = self.can.mode
            self.can.on_mode(message.data)
        if before != message.data:
            rospy.loginfo('modoPC is %d: %s', message.data, self.state)

    def _on_joystick(self, message):
        if message.buttons:
            with self._lock:
                self.can.on_switch(message.buttons[0])

    def _on_encoder(self, message):
        reading = EncoderReading(message.header.stamp.to_sec(), message.wheel, message.steps, message.time_100us)
        with self._lock:
            positions = self.can.on_encoder(reading)
            if positions is None:
                return
            self._positions.append(positions)
        self.news()
