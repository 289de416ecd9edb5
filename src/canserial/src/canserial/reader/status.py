"""How the reader is: one level and one line for people, and the figures behind it, for /diagnostics."""

from __future__ import annotations

import math
from typing import NamedTuple

from canserial.reader.reader import Reader
from sara_common.diagnostics import ERROR, OK, WARN

IMU = None  # the period of the IMU frames, which the reader learns
PERIODS_SILENT = 5  # a frame is silent after so many periods, and never before max_gap
POWER_UP = 60.0  # s; the sensor node calibrates itself for 30 s after it is switched on, longer if it is moved
KINDS_SHOWN = 4  # of what was dropped lately; all are in the figures
RECENT = 10.0  # s; what was dropped so long ago still counts as "lately"
DISTURBED = 10.0  # s
NO_HEADING = 'no imu/heading yet: the compass waits for 2 s at rest in the undisturbed field of the earth'
SENSOR_NODE = 'the sensor node calibrates itself for 30 s after it is switched on: keep the chair still'


class Expected(NamedTuple):
    """A frame that should come: its period in s, the level when it does not, and whether it may never come at all."""

    period: float
    level: int
    optional: bool = False


EXPECTED = {
    'ENCODER_RIGHT': Expected(0.1, ERROR),
    'ENCODER_LEFT': Expected(0.1, ERROR),
    'MODO_PC': Expected(0.2, ERROR),
    'RANGE_ACCEL': Expected(IMU, ERROR),
    'IMPACT_GYRO': Expected(IMU, ERROR),
    'COMPLEMENTARY': Expected(IMU, ERROR),
    'RANGES_1': Expected(0.2, WARN),
    'RANGES_2': Expected(0.2, WARN),
    'BATTERY': Expected(1.0, WARN),
    'JOYSTICK': Expected(0.1, WARN, optional=True),
    'MADGWICK': Expected(IMU, WARN, optional=True),
    'COMPASS': Expected(0.1, WARN),
}
IMU_FRAMES = tuple(name for name, expected in EXPECTED.items() if expected.period is IMU and not expected.optional)


class ReaderStatus(NamedTuple):
    """level: OK, WARN or ERROR. text: one line. values: {name: figure}. silent: names of the frames that are due."""

    level: int
    text: str
    values: dict
    silent: tuple


def status_of(reader: Reader, now: float) -> ReaderStatus:
    """The ReaderStatus of a Reader at `now` (s, the clock of its frames)."""
    if not reader.frames:
        return ReaderStatus(ERROR, 'waiting for frames', _values(reader, now, {}), ())
    silent = _silent(reader, now)
    parts = [_silent_text(reader, now, silent)] if silent else []
    parts += _calibration_texts(reader)
    if reader.yaw_doubtful:
        parts.append((WARN, 'the chair may have turned unseen: give its yaw on /set_pose'))
    if reader.imu_frozen and 'IMPACT_GYRO' not in silent:
        parts.append((ERROR, 'the IMU is frozen: its six axes are the same to the last bit'))
    elif reader.imu_stamp is not None and reader.ready and 'IMPACT_GYRO' not in silent:
        missing = now - reader.imu_stamp
        if missing > max(reader.config.max_gap, PERIODS_SILENT * reader.period):
            parts.append((ERROR, f'no imu/data for {missing:.1f} s'))
    lately = sorted(
        (kind for kind, stamp in reader.last_fault.items() if 0.0 <= now - stamp <= RECENT),
        key=lambda kind: (-reader.last_fault[kind], kind),
    )
    if lately:
        shown = [f'{reader.kinds[kind]} ({reader.counters[kind]})' for kind in lately[:KINDS_SHOWN]]
        more = [f'and {len(lately) - KINDS_SHOWN} more'] if len(lately) > KINDS_SHOWN else []
        parts.append((WARN, 'dropped lately: ' + ', '.join(shown + more)))
    empty = reader.config.battery_empty
    if empty is not None and reader.battery is not None and reader.battery <= empty:
        parts.append((WARN, f'the battery is empty: {reader.battery:.1f} V'))
    parts += _compass_texts(reader, now, silent)
    level = max((level for level, _ in parts), default=OK)
    text = '; '.join(text for _, text in parts) or 'publishing'
    return ReaderStatus(level, text, _values(reader, now, silent), tuple(silent))


def _silent(reader, now):
    """{name: seconds since the last one, or None if none ever came} of the frames that are overdue."""
    silent = {}
    for name, expected in EXPECTED.items():
        if name not in reader.bus.names:
            continue
        limit = max(
            reader.config.max_gap, PERIODS_SILENT * (reader.period if expected.period is IMU else expected.period)
        )
        stamp = reader.seen.get(name)
        if stamp is None:
            if not expected.optional and now - reader.first_stamp > limit:
                silent[name] = None
        elif now - stamp > limit:
            silent[name] = now - stamp
    return silent


def _silent_text(reader, now, silent):
    """(level, line) about the silent frames."""
    imu_never = [name for name in IMU_FRAMES if name in silent and silent[name] is None]
    others = [name for name in silent if name not in imu_never]
    texts, level = [], OK
    if imu_never:
        awaited = now - reader.first_stamp
        level = WARN if awaited <= POWER_UP else ERROR
        texts.append(f'waiting for {_list(reader, imu_never)} for {awaited:.0f} s ({SENSOR_NODE})')
    if others:
        level = max(level, *(EXPECTED[name].level for name in others))
        came = [name for name in others if silent[name] is not None]
        if came:
            seconds = max(silent[name] for name in came)
            texts.append(f'silent for {seconds:.1f} s: {_list(reader, came)}')
        never = [name for name in others if silent[name] is None]
        if never:
            texts.append(f'never came: {_list(reader, never)}')
        if 'IMPACT_GYRO' in came and 'RANGES_1' not in silent:
            texts.append(f'so no imu/data ({SENSOR_NODE})')
    return level, ', '.join(texts)


def _list(reader, names):
    return ', '.join(f'0x{reader.bus.id_of(name):X} {name}' for name in names)


def _calibration_texts(reader):
    if not reader.calibrating:
        return []
    calibration = reader.calibration
    text = f'calibrating the gyroscope at rest: {calibration.elapsed:.0f} of {calibration.duration:g} s'
    if calibration.restarts:
        text += f' (started over {calibration.restarts} times, last because {calibration.reason})'
    return [(OK if reader.ready else WARN, text)]


def _compass_texts(reader, now, silent):
    """About the heading."""
    compass = reader.compass
    if compass is None or 'COMPASS' in silent:
        return []
    if compass.filter is None:
        return [(WARN, 'the compass is not calibrated (calibrate_compass), so no imu/heading')]
    if compass.waits:
        return [(WARN, NO_HEADING)]
    away = now - compass.clear_stamp
    if away > DISTURBED:
        sigma = math.degrees(math.sqrt(compass.filter.yaw_variance))
        return [
            (OK, f"the field is not the earth's for {away:.0f} s: the heading is the gyroscope's, +- {sigma:.1f} deg")
        ]
    return []


def _values(reader, now, silent):
    values = {
        'frames': reader.frames,
        'gain': f'{reader.gain:.5g}',
        'imu_period': f'{reader.period:.3g}',
        **reader.counters,
    }
    if reader.offset is not None:
        values['gyro_offset'] = ', '.join(f'{value:.4f}' for value in reader.offset) + ' deg/s'
    if reader.compass is not None and reader.compass.filter is not None and reader.compass.filter.started:
        values['heading'] = f'{math.degrees(reader.compass.filter.yaw):.2f} deg'
        values['heading_sigma'] = f'{math.degrees(math.sqrt(reader.compass.filter.yaw_variance)):.2f} deg'
    if reader.calibration is not None:
        values['calibration'] = f'{reader.calibration.elapsed:.1f} of {reader.calibration.duration:g} s'
        values['calibration_restarts'] = reader.calibration.restarts
    for name in EXPECTED.keys() & set(reader.bus.names):
        stamp = reader.seen.get(name)
        age = 'never' if stamp is None else f'{now - stamp:.1f} s ago'
        values[f'frame {name}'] = f'silent, {age}' if name in silent else age
    return values
