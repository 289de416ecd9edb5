"""Opens what the commands are connected to, and says in one sentence what to do where that fails."""

from __future__ import annotations

import importlib
import os
import sys
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import serial

I2C_METHODS = ('read_byte_data', 'read_i2c_block_data', 'write_byte_data', 'write_i2c_block_data')


class I2cBus(Protocol):
    """The methods of smbus2.SMBus that the chips' modules call. They raise OSError."""

    def read_byte_data(self, address: int, register: int) -> int: ...

    def read_i2c_block_data(self, address: int, register: int, length: int) -> list[int]: ...

    def write_byte_data(self, address: int, register: int, value: int) -> None: ...

    def write_i2c_block_data(self, address: int, register: int, data: list[int]) -> None: ...


class HardwareError(RuntimeError):
    """Something cannot be opened; the text says what, why and what to do."""


def open_i2c(name: str) -> I2cBus:
    """An object with smbus2's methods: of a device such as /dev/i2c-1, or what MODULE:FACTORY returns. Raises
    HardwareError.
    """
    if ':' in name:
        return _from_factory(name)
    try:
        from smbus2 import SMBus
    except ImportError:
        raise HardwareError('the Python module smbus2 is missing: sudo apt install python3-smbus2') from None
    try:
        return SMBus(name)
    except FileNotFoundError:
        raise HardwareError(
            f'there is no {name}: switch I2C on (sudo raspi-config, Interface Options, I2C; or dtparam=i2c_arm=on in '
            'config.txt) and start anew; "ls /dev/i2c-*" shows what there is'
        ) from None
    except PermissionError:
        raise HardwareError(f'no permission for {name}: sudo usermod -aG i2c {_user()}, then log in anew') from None
    except OSError as error:
        raise HardwareError(f'{name} cannot be opened: {error}') from error


def _from_factory(name: str):
    module_name, _, factory_name = name.partition(':')
    if '' not in sys.path and os.getcwd() not in sys.path:
        sys.path.append(os.getcwd())
    try:
        factory = getattr(importlib.import_module(module_name), factory_name)
    except (ImportError, ValueError) as error:
        raise HardwareError(f'--i2c {name}: the module {module_name!r} cannot be imported: {error}') from error
    except AttributeError:
        raise HardwareError(f'--i2c {name}: the module {module_name!r} has no {factory_name!r}') from None
    i2c = factory()
    missing = [method for method in I2C_METHODS if not callable(getattr(i2c, method, None))]
    if missing:
        raise HardwareError(
            f"--i2c {name} gave a {type(i2c).__name__} without {', '.join(missing)}: smbus2's methods are needed"
        )
    return i2c


def open_amplifier_port(name: str) -> serial.Serial:
    """A serial port at 9600 baud, 7 data bits, even parity, that never waits to be read. Raises HardwareError."""
    import serial

    try:
        return serial.Serial(
            name,
            9600,
            bytesize=serial.SEVENBITS,
            parity=serial.PARITY_EVEN,
            stopbits=serial.STOPBITS_ONE,
            timeout=0,
            write_timeout=0.05,
            exclusive=True,
        )
    except (OSError, ValueError) as error:
        raise HardwareError(_device_problem(name, error, 'dialout')) from error


def open_joystick(name: str) -> int:
    """A file descriptor of a Linux joystick device, non-blocking. Raises HardwareError."""
    try:
        return os.open(name, os.O_RDONLY | os.O_NONBLOCK)
    except OSError as error:
        raise HardwareError(_device_problem(name, error, 'input')) from error


def _device_problem(name: str, error: Exception, group: str) -> str:
    text = str(error)
    if isinstance(error, FileNotFoundError) or 'No such file' in text:
        return f'there is no {name}: is it plugged in? "ls /dev" shows what there is'
    if isinstance(error, PermissionError) or 'Permission denied' in text:
        return f'no permission for {name}: sudo usermod -aG {group} {_user()}, then log in anew'
    return f'{name} cannot be opened: {text}'


def _user() -> str:
    return os.environ.get('USER') or '$USER'
