"""What came of meetings with pedestrians: false stops, yields, and how near the chair came to somebody, and how fast.

A sensor's cone that sweeps over an edge sees a distance shrink as it would for a pedestrian who approaches. A detection
that changes nothing of the drive is no stop.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sara_common.planar import wrap
from sara_lab.judge import gaps
from sara_lab.judge.contact_watch import towards
from sara_lab.judge.judgement import Meetings
from sara_lab.judge.time_split import SLOWING
from sara_sim.pedestrians import social_force

if TYPE_CHECKING:
    from sara_bringup.lockstep.lockstep import Lockstep
    from sara_sim.chair import SimulatedChair

REACH = 3.5  # m from base_link: ranges are 2.5 m at most, from the edge of the body
APART = 1.0  # s: what follows sooner belongs to the same stop, false or not as it began
NEAR = 0.30  # m between body and pedestrian: near


class Encounters:
    """Watches a Lockstep: call `after` with it after each step. `meetings`: the Meetings so far."""

    def __init__(self) -> None:
        self._false_stops = self._yields = 0
        self._nearest, self._pressed = math.inf, 0.0
        self._last = -math.inf  # s, when the gate last took something for a pedestrian
        self._counted = self._met = False  # this stop; whether somebody was near in it

    @property
    def meetings(self) -> Meetings:
        """The Meetings so far."""
        nearest = self._nearest if self._nearest < math.inf else math.nan
        return Meetings(self._false_stops, self._yields, nearest, self._pressed)

    def after(self, lockstep: Lockstep) -> None:
        """See who walks near, and whether the gate slows or holds the chair now, and takes something for a
        pedestrian.
        """
        chair, wheels = lockstep.chair, lockstep.wheels
        there = _near(chair)
        for shape in there:
            self._meet(chair, shape)
        if not wheels.guard.zones.pedestrian_moving:
            return
        if lockstep.time - self._last > APART:
            self._counted = self._met = False
        self._last = lockstep.time
        self._met |= bool(there)
        if not self._counted and wheels.decision.state in SLOWING:
            self._counted = True
            self._yields += self._met
            self._false_stops += not self._met

    def _meet(self, chair, shape):
        body = chair.platform.size
        gap = gaps.to_shape(chair.pose, body, shape)
        self._nearest = min(self._nearest, gap)
        if gap < NEAR:
            speed = towards(chair.pose, chair.velocity, shape[:2], body)
            if speed > self._pressed and _heard(chair, shape):
                self._pressed = speed


def _near(chair: SimulatedChair) -> list[tuple[float, ...]]:
    """Who walks about within REACH of the chair, as rows of `Obstacles.shapes`."""
    obstacles = chair.world.obstacles
    shapes = (thing.shape(obstacles.time) for thing in obstacles.all if thing.walks)
    return [shape for shape in shapes if shape is not None and math.dist(shape[:2], chair.pose[:2]) < REACH]


def _heard(chair, shape):
    """Whether somebody reaches into a sensor's cone, and no wall hides their middle."""
    place, radius = shape[:2], shape[4]
    x, y, yaw = chair.pose
    c, s = math.cos(yaw), math.sin(yaw)
    half = math.radians(chair.config.sonar_cone / 2)
    ground = social_force.Floor.of(chair.world)
    for mount in chair.platform.sonars.values():
        sx, sy = x + c * mount.x - s * mount.y, y + s * mount.x + c * mount.y
        far = math.dist((sx, sy), place)
        wide = math.asin(min(radius / far, 1.0)) if far > 0.0 else math.pi
        off = abs(wrap(math.atan2(place[1] - sy, place[0] - sx) - yaw - mount.yaw))
        if off < half + wide and not social_force.hidden(ground, sx, sy, *place):
            return True
    return False
