"""A joystick or gamepad as Linux gives it: /dev/input/js0, events of 8 bytes, no library needed.

Format: Linux kernel, Documentation/input/joydev/joystick-api.rst: uint32 time (ms), int16 value, uint8 type (1 button,
2 axis, with 0x80 added for the state at opening), uint8 number. Axes run -32767..32767, right and down (towards the
user) positive. Any USB joystick is such a device, so no analogue converter and no driver of ours are needed; an
analogue stick needs only another source of (x, y).
"""

from __future__ import annotations

import struct

_EVENT = struct.Struct('<IhBB')
BUTTON, AXIS, INITIAL = 0x01, 0x02, 0x80


class JoystickState:
    """`axes`: {number: -32767..32767}, `buttons`: {number: pressed}, as far as events said."""

    def __init__(self, x_axis: int = 0, y_axis: int = 1, hold_button: int | None = None) -> None:
        """`x_axis`, `y_axis`: numbers of the axes. `hold_button`: the stick counts only while this one is pressed;
        always if None.
        """
        self.axes: dict[int, int] = {}
        self.buttons: dict[int, bool] = {}
        self._x, self._y, self._hold = x_axis, y_axis, hold_button
        self._rest = b''

    def feed(self, data: bytes) -> None:
        """Bytes read from the device, in any portions."""
        data = self._rest + data
        whole = len(data) - len(data) % _EVENT.size
        self._rest = data[whole:]
        for _, value, kind, number in _EVENT.iter_unpack(data[:whole]):
            kind &= ~INITIAL
            if kind == AXIS:
                self.axes[number] = value
            elif kind == BUTTON:
                self.buttons[number] = bool(value)

    @property
    def stick(self) -> tuple[int, int]:
        """(x right positive, y forward positive) in the chair's counts, 0..1023 around 512."""
        if self._hold is not None and not self.buttons.get(self._hold, False):
            return 512, 512
        return _counts(self.axes.get(self._x, 0)), _counts(-self.axes.get(self._y, 0))


def _counts(value: int) -> int:
    return min(max(512 + round(value * 512 / 32767), 0), 1023)
