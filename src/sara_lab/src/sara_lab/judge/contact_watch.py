"""Who touched whom: each contact of the simulated chair with what it met, and how fast the chair moved towards it.

A person who walks into a chair that stands is not the chair's doing. The chair's part is the speed of its body, at the
place that is nearest to the other, towards the other, as it was before the contact stalled the wheels.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from sara_common.platforms import chosen

if TYPE_CHECKING:
    from sara_sim.chair import SimulatedChair

PERSON = 'person'  # names of obstacles that are people begin so
CREEPING = 0.05  # m/s: slower than this towards a person who walks into it, the chair is not to blame
NEAR = 0.03  # m: an obstacle this near when the chair touches something is touched: both may have moved on in that step
BY_THE_WALL = 0.001  # m: a wall, which does not move, is touched when it is this near


@dataclass
class Contact:
    """`t`: s, its begin. `what`: the obstacle's name, or "the map". `approach`: m/s, the chair's highest speed towards
    it while they touched. `walking`: whether it walks.
    """

    t: float
    what: str
    approach: float
    walking: bool = False

    @property
    def blameless(self) -> bool:
        """Whether somebody walked into a chair that hardly moved towards them."""
        return self.walking and self.approach < CREEPING

    def __str__(self):
        return f'{self.what} at {self.t:.1f} s, {self.approach:.2f} m/s towards it'

    def to_json(self) -> dict[str, Any]:
        """All as plain data."""
        return {**asdict(self), 'blameless': self.blameless}


def towards(
    pose: Sequence[float], velocity: Sequence[float], place: Sequence[float], body: tuple[float, float] | None = None
) -> float:
    """Speed (m/s) at which the body at `pose` (x, y, yaw), moving with `velocity` (v, w), nears a place (x, y) by its
    nearest point; < 0: it leaves.
    """
    c, s = math.cos(pose[2]), math.sin(pose[2])
    dx, dy = place[0] - pose[0], place[1] - pose[1]
    ax, ay = c * dx + s * dy, c * dy - s * dx
    body = body or chosen().size
    px, py = min(max(ax, -0.5 * body[0]), 0.5 * body[0]), min(max(ay, -0.5 * body[1]), 0.5 * body[1])
    nx, ny = (ax - px, ay - py) if (px, py) != (ax, ay) else (ax, ay)  # a place inside the body: away from its centre
    far = math.hypot(nx, ny)
    v, w = velocity
    return ((v - w * py) * nx + w * px * ny) / far if far > 0.0 else abs(v)


class ContactWatch:
    """Watches a sara_sim chair: call `before` and `after` with it around each step. `contacts`: list of Contact."""

    def __init__(self) -> None:
        self.contacts = []
        self._open = {}
        self._moved = None

    def before(self, chair: SimulatedChair) -> None:
        """Note how the chair moves."""
        self._moved = chair.pose, chair.velocity

    def after(self, chair: SimulatedChair) -> None:
        """See whether it touches something now."""
        if not chair.drive.touching:
            self._open.clear()
            return
        pose, velocity = self._moved
        world, config = chair.world, chair.config
        met = world.meets(*chair.pose, config.length + 2 * NEAR, config.width + 2 * NEAR) if world.obstacles.all else ()
        there = [obstacle for obstacle in world.obstacles.all if obstacle.pose(world.obstacles.time) is not None]
        touched = {
            obstacle.name: (
                towards(pose, velocity, obstacle.pose(world.obstacles.time)[:2], (config.length, config.width)),
                obstacle.walks,
            )
            for obstacle, near in zip(there, met)
            if near
        }
        if world.overlaps(*chair.pose, config.length + 2 * BY_THE_WALL, config.width + 2 * BY_THE_WALL) or not touched:
            touched['the map'] = abs(velocity[0]), False
        for name in set(self._open) - set(touched):
            del self._open[name]
        for name, (approach, walking) in touched.items():
            contact = self._open.get(name)
            if contact is None:
                contact = self._open[name] = Contact(chair.time, name, max(approach, 0.0), walking)
                self.contacts.append(contact)
            contact.approach = max(contact.approach, approach)
