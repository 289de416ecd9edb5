"""Where the calibration file lies, and what a node takes from it at start."""

from __future__ import annotations

import os
from datetime import UTC, datetime
from pathlib import Path

import rospkg
import rospy

from canserial.calibration import calibration_file
from canserial.calibration.calibration_file import Calibration, CalibrationFileError
from canserial.reader.config import ReaderConfig
from canserial.ros.node import stop
from sara_common.platforms import chosen


def resolve(name: str) -> Path:
    """The path of a calibration file ('': the robot's): `~` is the home, a relative one lies in ROS_HOME (~/.ros)."""
    return Path(rospkg.get_ros_home()) / os.path.expanduser(name or f'{chosen().name}_calibration.yaml')


def resolve_for(node: str, name: str) -> Path:
    """The same; '': that of a running read.py, the robot's where that names none."""
    return resolve(name or str(rospy.get_param(f'{rospy.resolve_name(node)}/calibration_file', '')))


def load_at_start(path: Path, config: ReaderConfig) -> Calibration | None:
    """The Calibration to start with, or None; ends the node where the settings need a file that is no good.

    A damaged file is never ignored: with calibration 'measure' it could still hold the chair's gain, so
    only a gain that is given makes it needless.
    """
    try:
        if config.calibration == 'saved':
            return calibration_file.load_offset(path)
        return calibration_file.load(path)
    except FileNotFoundError:
        return None
    except CalibrationFileError as error:
        if config.calibration == 'saved':
            stop(f'{rospy.get_name()} cannot take the saved calibration: {error}')
        if config.gain is None:
            stop(f'{rospy.get_name()} cannot take the gain: {error}; mend it, delete it, or give ~gain')
        rospy.logwarn('%s; not needed: it is measured and ~gain is given', error)
        return None


def update(path: Path, **changes) -> None:
    """Change these fields of the file, which is made if there is none. Raises CalibrationFileError."""
    try:
        stored = calibration_file.load(path)
    except FileNotFoundError:
        stored = Calibration()
    calibration_file.save(path, stored.updated(**changes))


def now_in_words() -> str:
    """The time of the day for the file; wall time, for people."""
    return datetime.now(UTC).isoformat(timespec='seconds')
