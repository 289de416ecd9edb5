"""Where a robot's URDF puts what is fixed to its body."""

from __future__ import annotations

import math
from xml.etree import ElementTree

from sara_common.config import finite_numbers
from sara_common.planar import Pose2D

NOWHERE = 'robot.urdf has {} nowhere: xyz and rpy of its origin are three numbers each'
"""What is to be said of a link whose place is NaN."""


def fixed_places(robot: ElementTree.Element) -> dict[str, Pose2D]:
    """{link: its Pose2D (m, m, rad) in base_link}, of the fixed joints from there. What an origin leaves out is zero;
    one that does not hold numbers gives a pose of NaN.
    """
    found = {}
    for joint in robot.findall("joint[@type='fixed']"):
        parent, child, origin = (joint.find(name) for name in ('parent', 'child', 'origin'))
        if parent is None or child is None or parent.get('link') != 'base_link' or not child.get('link'):
            continue
        place = {} if origin is None else origin.attrib
        xyz, rpy = (finite_numbers(place.get(name, '0 0 0'), 3) for name in ('xyz', 'rpy'))
        found[child.get('link')] = Pose2D(*xyz[:2], rpy[2]) if xyz and rpy else Pose2D(math.nan, math.nan, math.nan)
    return found
