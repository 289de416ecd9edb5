"""Which drives a process makes: the key of robot, sources, parameters and maps."""

from __future__ import annotations

import hashlib
from pathlib import Path

from sara_bringup.paths import share
from sara_common import platforms

REPORT_ONLY = {
    'agreement.py',
    'drive_figures.py',
    'filter_costs.py',
    'orientation_report.py',
    'pages.py',
    'plotting.py',
    'ranking.py',
    'runner.py',
    'sensor_figures.py',
    'square_figures.py',
    'square_findings.py',
    'square_fusions.py',
    'square_odometry.py',
    'variances.py',
    'yaw_at_rest.py',
}  # of experiments/: no run depends on them


def folder_of(out: Path) -> Path:
    """The folder in `out` for what comes of the chosen robot and of the sources as they are."""
    return out / f'{platforms.chosen().name}_{fingerprint()}'


def fingerprint(root: Path | None = None) -> str:
    """Twelve characters that are others once a source, a parameter file or a map of our packages is another, or the
    chosen robot's folder elsewhere. `root`: the folder of the packages, which alone count then.
    """
    robot = None if root else platforms.chosen().folder.resolve()
    root = root or share().parent
    found = hashlib.sha1()
    for path in sorted(root.glob('*/**/*')):
        parts = path.relative_to(root).parts
        if (
            path.suffix in ('.py', '.yaml', '.dbc', '.urdf', '.pgm')
            and 'test' not in parts
            and parts[1:2] != ('docs',)
            and 'ros' not in parts
            and not (path.parent.name == 'experiments' and path.name in REPORT_ONLY)
        ):
            found.update(_entry(path, root))
    if robot and not robot.is_relative_to(root.resolve()):
        for path in sorted(path for path in robot.rglob('*') if path.is_file()):
            found.update(_entry(path, robot))
    return found.hexdigest()[:12]


def _entry(path, folder):
    """A file's name in a folder, and what it holds."""
    return str(path.relative_to(folder)).encode() + b'\0' + path.read_bytes()
