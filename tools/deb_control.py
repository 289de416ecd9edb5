"""Names, dependencies and control files of the Debian packages, read from the catkin packages' package.xml.

The package `sara_nav` becomes `sara-nav`, `canserial` becomes `sara-canserial`. All need `sara-python`: setup.bash, the
Python packages that Debian lacks, machine code.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from catkin_pkg.package import parse_package

BASE = 'sara-python'
CONDITIONS = {'ROS_VERSION': '1', 'ROS_DISTRO': 'noetic', 'ROS_PYTHON_VERSION': '3'}
# Debian calls the Python part of the ROS package `some_name` python3-some-name, but for these:
DEBIAN = {
    'espeak-ng': ('espeak-ng',),
    'message_runtime': ('python3-genpy',),
    'robot_state_publisher': ('ros-robot-state-publisher',),
    'rviz': ('rviz',),
}
OPTIONAL = {'espeak-ng', 'rviz'}  # what the stack does its work without: Recommends
HEADING = re.compile(r'^## (\S+)( \(not released\))?$', re.MULTILINE)
BASE_DEPENDS = ('python3 (>= 3.11)', 'python3 (<< 3.12)', 'libc6', 'python3-numpy', 'rosbash', 'ros-environment')
BASE_RECOMMENDS = ('python3-rosnode', 'python3-rosparam', 'python3-rosservice', 'python3-rostopic')


@dataclass(frozen=True)
class Package:
    """A catkin package; `needs`: what its package.xml wants at run time, catkin packages and rosdep's keys."""

    name: str
    description: str
    maintainer: str
    release: str
    needs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Control:
    """What the control file of a Debian package says."""

    name: str
    version: str
    architecture: str
    maintainer: str
    description: str
    depends: tuple[str, ...] = ()
    recommends: tuple[str, ...] = field(default=())

    def text(self, kibibytes: int) -> str:
        """The file, for contents of that size."""
        synopsis = textwrap.shorten(re.split('[:;.]', self.description)[0], 78, placeholder=' ...')
        lines = [
            f'Package: {self.name}',
            f'Version: {self.version}',
            f'Architecture: {self.architecture}',
            f'Maintainer: {self.maintainer}',
            f'Installed-Size: {kibibytes}',
            f'Depends: {", ".join(self.depends)}',
            *([f'Recommends: {", ".join(self.recommends)}'] if self.recommends else []),
            'Section: science',
            'Priority: optional',
            f'Description: {synopsis}',
            *textwrap.wrap(self.description, 78, initial_indent=' ', subsequent_indent=' '),
        ]
        return '\n'.join(lines) + '\n'


def read_packages(source: Path) -> list[Package]:
    """The catkin packages below a folder, by name. Raises catkin_pkg's InvalidPackage."""
    found = []
    for path in sorted(source.glob('*/package.xml')):
        xml = parse_package(str(path))
        xml.evaluate_conditions(CONDITIONS)
        needs = sorted({need.name for need in xml.exec_depends if need.evaluated_condition})
        person = xml.maintainers[0]
        description = ' '.join(xml.description.split())
        found.append(Package(xml.name, description, f'{person.name} <{person.email}>', xml.version, tuple(needs)))
    return found


def debian_name(package: str) -> str:
    """The Debian package that a catkin package of ours becomes."""
    return package.replace('_', '-') if package.startswith('sara_') else f'sara-{package.replace("_", "-")}'


def debian_packages(need: str) -> tuple[str, ...]:
    """The packages of Debian that give a Python program what package.xml calls by this name."""
    if need in DEBIAN:
        return DEBIAN[need]
    if need.startswith('python3-'):
        return (need,)
    dashed = need.replace('_', '-')
    return (f'python3-{dashed}', *((f'ros-{dashed}',) if need.endswith(('_msgs', '_srvs')) else ()))


def control(package: Package, ours: Iterable[str], version: str) -> Control:
    """The control file of a catkin package; `ours`: names of all of them. They fit each other in one version only."""
    names = set(ours)
    own = [debian_name(need) for need in package.needs if need in names]
    foreign = [(need, name) for need in package.needs if need not in names for name in debian_packages(need)]
    return Control(
        debian_name(package.name),
        version,
        'all',
        package.maintainer,
        package.description,
        tuple(f'{name} (= {version})' for name in (BASE, *own))
        + tuple(sorted({name for need, name in foreign if need not in OPTIONAL})),
        tuple(sorted({name for need, name in foreign if need in OPTIONAL})),
    )


def base_control(
    first: Package, version: str, architecture: str, pinned: Iterable[str], others: Iterable[str]
) -> Control:
    """The control file of sara-python. `pinned`: the Python packages in it, `others`: Debian packages they need."""
    return Control(
        BASE,
        version,
        architecture,
        first.maintainer,
        "Environment of SARA: /opt/sara/setup.bash, machine code of the packages' compiled functions, and the Python "
        f'packages that Debian lacks: {", ".join(pinned)}.',
        tuple(dict.fromkeys((*BASE_DEPENDS, *sorted(others)))),
        BASE_RECOMMENDS,
    )


def version_of(changelog: str, seconds: int, commit: str) -> str:
    """The Debian version: the changelog's uppermost; while it is not released, older than that and newer with every
    commit, by its time (s since 1970). Raises ValueError where the changelog names none.
    """
    found = HEADING.search(changelog)
    if found is None:
        raise ValueError('CHANGELOG.md has no heading "## VERSION" or "## VERSION (not released)"')
    release, open_ = found.groups()
    moment = datetime.fromtimestamp(seconds, UTC).strftime('%Y%m%d%H%M%S')
    return f'{release}~git{moment}.{commit}' if open_ else release


def prerm(name: str) -> str:
    """The script that runs before a package is removed: Python and numba wrote beside the sources what dpkg does not
    know.
    """
    return f"""#!/bin/sh
set -e
dpkg -L {name} | grep '/__pycache__$' | xargs -r rm -rf
"""
