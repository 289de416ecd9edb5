"""The file that keeps a chair's calibration: the gyroscope's offset, the gain on the turned angle and the compass's
iron, as YAML for people.

It is written atomically (a new file takes the old one's place), so that a power cut leaves the old or the new one,
never half.
It is read with suspicion: a file that is damaged or that no MPU6050 could have given is an error of one sentence.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import yaml

from canserial.calibration.calibration import MAX_OFFSET
from canserial.calibration.iron import Iron
from sara_common.config import is_number
from sara_common.files import write_whole

GAIN_LIMITS = 0.5, 2.0  # beyond: no scale error of a gyroscope but a wrong measurement
HEAD = """\
# A chair's calibration, written by canserial (read.py, calibrate_gain, calibrate_compass).
# gyro_offset, gyro_sigma: deg/s, x y z, at rest. gain: factor on the turned angle. Times: UTC.
# compass_...: field = matrix (measured - offset), uT; horizontal, down: the earth's field there; yaw_sigma: deg.
"""


class CalibrationFileError(ValueError):
    """One sentence: which file, what is wrong with it."""


@dataclass(frozen=True)
class Calibration:
    """What is known of a chair's gyroscope; None for what was not measured.

    gyro_offset, gyro_sigma: three rates, deg/s. gyro_frames: how many frames they are the mean and deviation of. gain:
    k of the turned angle; gain_error: its standard error. gyro_measured, gain_measured, compass_measured: when, as
    text. compass_...: the fields of iron.Iron, all or none.
    """

    gyro_offset: tuple = None
    gyro_sigma: tuple = None
    gyro_frames: int | None = None
    gyro_measured: str | None = None
    gain: float | None = None
    gain_error: float | None = None
    gain_measured: str | None = None
    compass_offset: tuple | None = None
    compass_matrix: tuple | None = None
    compass_horizontal: float | None = None
    compass_down: float | None = None
    compass_motors: tuple | None = None
    compass_lean: tuple | None = None
    compass_gain: float | None = None
    compass_yaw_sigma: float | None = None
    compass_measured: str | None = None

    @property
    def iron(self) -> Iron | None:
        """The chair's iron, None before it was measured."""
        values = {name: getattr(self, f'compass_{name}') for name in Iron.__dataclass_fields__}
        return None if all(value is None for value in values.values()) else Iron(**values)

    def faults(self) -> list[str]:
        """Sentences about what cannot be, empty if it is plausible."""
        faults = []
        for name, low, high, allowed in (
            ('gyro_offset', -MAX_OFFSET, MAX_OFFSET, f'-{MAX_OFFSET:g} to {MAX_OFFSET:g}'),
            ('gyro_sigma', 0.0, MAX_OFFSET, f'0 to {MAX_OFFSET:g}'),
        ):
            value = getattr(self, name)
            if value is not None and not (
                isinstance(value, (list, tuple))
                and len(value) == 3
                and all(is_number(v) and low <= v <= high for v in value)
            ):
                faults.append(f'{name} is {value!r}, allowed are three numbers of {allowed}')
        if self.gyro_frames is not None and not (is_number(self.gyro_frames) and self.gyro_frames >= 1):
            faults.append(f'gyro_frames is {self.gyro_frames!r}, allowed are whole numbers of 1 or more')
        low, high = GAIN_LIMITS
        if self.gain is not None and not (is_number(self.gain) and low <= self.gain <= high):
            faults.append(f'gain is {self.gain!r}, allowed is {low:g} to {high:g}')
        if self.gain_error is not None and not (is_number(self.gain_error) and self.gain_error >= 0.0):
            faults.append(f'gain_error is {self.gain_error!r}, allowed are numbers of 0 or more')
        iron = self.iron
        return faults if iron is None else faults + [f'compass_{text}' for text in iron.faults()]

    def updated(self, **changes) -> Calibration:
        """A copy with these fields changed."""
        return replace(self, **changes)


def load(path: str | Path) -> Calibration:
    """The Calibration in the file `path`. Raises FileNotFoundError where there is none, CalibrationFileError."""
    try:
        text = Path(path).read_text(encoding='utf-8')
    except FileNotFoundError:
        raise
    except (OSError, UnicodeDecodeError) as error:
        raise CalibrationFileError(f'the calibration file {path} cannot be read: {error}') from error
    try:
        content = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise CalibrationFileError(f'the calibration file {path} is damaged: {" ".join(str(error).split())}') from error
    if not isinstance(content, dict) or not content:
        raise CalibrationFileError(f'the calibration file {path} is damaged: it holds no fields')
    unknown = sorted(map(str, content.keys() - Calibration.__dataclass_fields__.keys()))
    if unknown:
        raise CalibrationFileError(f'the calibration file {path} is damaged: it holds {", ".join(unknown)}')
    calibration = Calibration(
        **{name: tuple(value) if isinstance(value, list) else value for name, value in content.items()}
    )
    faults = calibration.faults()
    if faults:
        raise CalibrationFileError(f'the calibration file {path} is implausible: {"; ".join(faults)}')
    return calibration


def load_offset(path: str | Path) -> Calibration:
    """load(), for those who need the offset: that there is no file or no offset in it is a CalibrationFileError too."""
    try:
        calibration = load(path)
    except FileNotFoundError:
        raise CalibrationFileError(f'there is no calibration file {path}: measure once, and save') from None
    if calibration.gyro_offset is None:
        raise CalibrationFileError(f'the calibration file {path} holds no gyro_offset: measure once, and save')
    return calibration


def save(path: str | Path, calibration: Calibration) -> None:
    """Write atomically; folders are made. Raises CalibrationFileError."""
    faults = calibration.faults()
    if faults:
        raise CalibrationFileError(f'an implausible calibration is not saved: {"; ".join(faults)}')
    fields = {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in vars(calibration).items()
        if value is not None
    }
    try:
        write_whole(path, HEAD + yaml.safe_dump(fields, sort_keys=False, default_flow_style=None))
    except OSError as error:
        raise CalibrationFileError(f'the calibration file {path} cannot be written: {error}') from error
