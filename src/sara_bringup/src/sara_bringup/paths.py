"""Where this package's files lie, in the source tree and in an install space alike."""
import os
from pathlib import Path


def share():
    """The package's share folder: beside the sources if we run from them, else on ROS_PACKAGE_PATH. Raises FileNotFoundError."""
    source = Path(__file__).resolve().parents[2]
    candidates = [source] + [Path(entry) / "sara_bringup" for entry in os.environ.get("ROS_PACKAGE_PATH", "").split(":") if entry]
    for folder in candidates:
        if (folder / "package.xml").is_file() and (folder / "maps").is_dir():
            return folder
    raise FileNotFoundError("sara_bringup's maps and configuration were found nowhere; source the workspace's setup.bash first")


def config_file(name):
    """Path of config/NAME."""
    return share() / "config" / name
