"""The skills, by name: those of the Wheelchair Skills Test 4.2 (WST) for powered chairs; doors, lift, bed and table as
experts list them (the Power Mobility Clinical Driving Assessment, PMCDA); and stops before what is in the way, as those
of LUCI are shown (Mobility Management, July 2021).

Kerbs, gaps, soft ground and doors with a leaf are left out: the simulator has none. So are drop-offs, which
no sensor of the chair sees.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

from sara_lab.journeys.tight_places import block, places
from sara_lab.judge.contact_watch import PERSON
from sara_lab.rides.skills.skill import BEHIND, LEFT, Criteria, Move, Push, Skill, straight
from sara_nav.maps.edits import SLOW, Edit
from sara_sim.pedestrians.pedestrian import Pedestrian, PedestrianConfig
from sara_sim.riders.way import rounded
from sara_sim.world.obstacles import Obstacle, Thing
from sara_sim.world.terrain import Ramp, Threshold
from sara_sim.world.world import World

LANE = 1.5  # m wide: corridors of the WST's course
ROUND = 0.75  # m before a corner, where somebody begins to turn
CLOSE = 0.15  # m: off a parking place at most
CROSSED, LONG = 2.2, 3600.0  # m before somebody's way across, where the chair is when they begin; s they stay there


def _ahead(length: float, lane: float, seconds: float, item: str, position: float = 0.30) -> Skill:
    """Straight on in a corridor."""
    grid = block((length + 2.4, lane), ((0.0, 0.0, length + 2.4, lane),))
    middle = 0.5 * lane
    goal = 1.2 + length, middle, 0.0
    return Skill(item, grid, (1.2, middle, 0.0), (goal,), (straight(goal[:2]),), Criteria(position, 30.0, seconds))


def _back() -> Skill:
    grid = block((5.0, LANE), ((0.0, 0.0, 5.0, LANE),))
    goal = 1.5, 0.75, 0.0
    return Skill(
        'moves backwards 2 m (WST)',
        grid,
        (3.5, 0.75, 0.0),
        (goal,),
        (straight(goal[:2], astern=True),),
        Criteria(seconds=40.0, astern=0.8),
    )


def _corner(astern: bool) -> Skill:
    """Round the corner of a corridor to the left of where the chair goes."""
    grid = block((4.5, 5.0), ((0.0, 0.0, 4.5, LANE), (3.0, 0.0, 4.5, 5.0)))
    start, corner, end = (1.5, 0.75), (3.75, 0.75), (3.75, 3.5)
    way = tuple(rounded((start, corner, end), 2.0 * ROUND))[1:]
    if astern:
        item, pose, goal, share = 'turns 90 deg while moving backwards (WST)', (*start, BEHIND), (*end, -LEFT), 0.8
    else:
        item, pose, goal, share = 'turns 90 deg while moving forwards (WST)', (*start, 0.0), (*end, LEFT), 0.0
    criteria = Criteria(seconds=60.0, astern=share, turning=0.5)
    return Skill(item, grid, pose, (goal,), (Move(way, astern),), criteria)


def _about() -> Skill:
    grid = block((3.0, 3.0), ((0.0, 0.0, 3.0, 3.0),))
    criteria = Criteria(seconds=30.0, box=(0.75, 0.75, 2.25, 2.25))
    return Skill(
        'turns 180 deg in place (WST)',
        grid,
        (1.5, 1.5, 0.0),
        ((1.5, 1.5, BEHIND),),
        (Move(yaw=BEHIND),),
        criteria,
    )


def _sideways() -> Skill:
    """To the left: ahead and over, and back."""
    grid = block((5.5, 2.5), ((0.0, 0.0, 5.5, 2.5),))
    goal = 1.5, 1.5, 0.0
    over = tuple(rounded(((1.5, 1.0), (2.1, 1.0), (2.9, 1.5), (3.9, 1.5)), 0.4))[1:]
    moves = Move(over, yaw=0.0), Move((goal[:2],), True, 0.0)
    criteria = Criteria(position=CLOSE, seconds=60.0)
    return Skill('manoeuvres 0.5 m sideways (WST)', grid, (1.5, 1.0, 0.0), (goal,), moves, criteria)


def _door() -> Skill:
    grid = block((7.2, 3.0), ((0.0, 0.0, 3.5, 3.0), (3.5, 1.05, 3.7, 1.95), (3.7, 0.0, 7.2, 3.0)))
    there, back = (5.8, 1.5, 0.0), (1.4, 1.5, BEHIND)
    moves = straight(there[:2], yaw=BEHIND), straight(back[:2])
    criteria = Criteria(seconds=90.0)
    return Skill(
        'through a door of 0.90 m and back (WST, without its leaf)',
        grid,
        (1.2, 1.5, 0.0),
        (there, back),
        moves,
        criteria,
    )


def _door_backwards() -> Skill:
    """Into a small room, nose towards the door, as one parks in a bathroom."""
    grid = block((5.6, 3.0), ((0.0, 0.0, 3.5, 3.0), (3.5, 1.05, 3.7, 1.95), (3.7, 0.8, 5.6, 2.2)))
    goal = 4.8, 1.5, BEHIND
    criteria = Criteria(seconds=60.0, astern=0.8)
    return Skill(
        'backwards through a door of 0.90 m (PMCDA)',
        grid,
        (1.6, 1.5, BEHIND),
        (goal,),
        (straight(goal[:2], astern=True),),
        criteria,
    )


def _lift() -> Skill:
    """Into a cabin of 1.1 x 1.4 m, and out again backwards or turned."""
    place = places()['lift']
    moves = straight(place.goal[:2]), straight(place.start[:2], astern=True)
    return Skill(
        'into a lift and out (PMCDA)', place.grid, place.start, (place.goal, place.start), moves, Criteria(seconds=90.0)
    )


def _bed() -> Skill:
    """Beside a bed of 0.9 x 2.0 m, 0.20 m off, facing its foot."""
    grid = block((5.5, 4.0), ((0.0, 0.0, 5.5, 4.0),), ((0.3, 3.1, 2.3, 4.0),))
    goal = 1.4, 2.6, 0.0
    over = tuple(rounded(((1.4, 1.2), (2.2, 1.2), (3.3, 2.6), (4.4, 2.6)), 0.6))[1:]
    moves = Move(over, yaw=0.0), Move((goal[:2],), True, 0.0)
    return Skill('parks beside a bed (PMCDA)', grid, (1.4, 1.2, 0.0), (goal,), moves, Criteria(CLOSE, 10.0, 90.0))


def _table() -> Skill:
    """Before a table, 0.20 m off."""
    grid = block((5.0, 4.0), ((0.0, 0.0, 5.0, 4.0),), ((3.6, 1.2, 4.6, 2.8),))
    goal = 2.86, 2.0, 0.0
    moves = (Move(tuple(rounded(((1.2, 1.2), (1.8, 1.4), (2.2, 2.0), goal[:2]), 0.4))[1:], yaw=0.0),)
    return Skill('parks at a table (PMCDA)', grid, (1.2, 1.2, 0.0), (goal,), moves, Criteria(CLOSE, 10.0, 60.0))


def _crossed() -> Skill:
    """Two people cross the way as the chair comes, one from the right, one from the left; they see the chair."""
    made = _ahead(9.6, 5.0, 60.0, 'avoids moving obstacles, from both sides (WST)')

    def walkers(world: World, seed: int) -> tuple[Thing, ...]:
        crossings = ((4.5, 0.5), (4.5, 4.5)), ((8.0, 4.5), (8.0, 0.5))
        waits, far = (LONG, LONG), math.hypot(2.0, CROSSED)
        return tuple(
            Pedestrian(PedestrianConfig(f'{PERSON} {k}', places, seed + k, waits=waits, starts_within=far), world)
            for k, places in enumerate(crossings)
        )

    return replace(made, things=walkers)


def _slope(yaw: float, item: str) -> Skill:
    """Over a slope of 5 deg, 4 m of the way, that rises to `yaw` (rad)."""
    made = _ahead(8.0, 2.0, 60.0, item)
    length, width = (2.0, 4.0) if yaw == LEFT else (4.0, 2.0)
    return replace(made, ramps=(Ramp(5.2, 1.0, length, width, yaw, math.radians(5.0)),))


def _threshold() -> Skill:
    """Over a strip that is 2 cm high and 10 cm deep, which is drawn over the map as a slow place: no sensor sees it."""
    made = _ahead(8.0, 2.0, 60.0, 'gets over a threshold of 2 cm (WST)')
    slow = Edit(SLOW, (5.1, 0.0), (5.3, 2.0))
    return replace(made, thresholds=(Threshold(5.2, 1.0, 0.1, 2.0, 0.0, 0.02),), edits=(slow,))


def _stop(forward: float, left: float) -> Skill:
    """Towards a box across a corridor; or about, beside a parked wheelchair."""
    if left:
        grid, start, near = block((4.0, 4.0), ((0.0, 0.0, 4.0, 4.0),)), (2.0, 2.0, 0.0), 0.20
        thing = 1.46, 2.59, 2.54, 3.17
    else:
        grid, start, near = block((7.0, 1.3), ((0.0, 0.0, 7.0, 1.3),)), (3.5, 0.65, 0.0), 0.40
        thing = (6.4, 0.1, 6.7, 1.2) if forward > 0.0 else (0.3, 0.1, 0.6, 1.2)
    which = 'pivoting' if left else 'ahead' if forward > 0.0 else 'astern'

    def parked(_world: World, _seed: int) -> tuple[Thing, ...]:
        x0, y0, x1, y1 = thing
        return (Obstacle('parked', size=(x1 - x0, y1 - y0), at=(0.5 * (x0 + x1), 0.5 * (y0 + y1))),)

    return Skill(f'stops {which} (LUCI)', grid, start, push=Push(forward, left, thing, near), things=parked)


@cache
def skills() -> dict[str, Skill]:
    """All by name."""
    return {
        'forwards_10m': _ahead(10.0, LANE, 45.0, 'moves forwards 10 m (WST)'),
        'backwards_2m': _back(),
        'turn_forwards_left': _corner(False),
        'turn_forwards_right': _corner(False).mirrored(),
        'turn_backwards_left': _corner(True),
        'turn_backwards_right': _corner(True).mirrored(),
        'turn_in_place': _about(),
        'sideways_left': _sideways(),
        'sideways_right': _sideways().mirrored(),
        'forwards_100m': _ahead(100.0, 2.0, 400.0, 'moves forwards 100 m (WST)', 1.0),
        'moving_obstacle': _crossed(),
        'up_5deg': _slope(0.0, 'goes up a slope of 5 deg (WST)'),
        'down_5deg': _slope(BEHIND, 'goes down a slope of 5 deg (WST)'),
        'across_5deg': _slope(LEFT, 'goes across a side slope of 5 deg (WST)'),
        'threshold': _threshold(),
        'door': _door(),
        'door_backwards': _door_backwards(),
        'lift': _lift(),
        'bed': _bed(),
        'table': _table(),
        'stop_ahead': _stop(1.0, 0.0),
        'stop_astern': _stop(-1.0, 0.0),
        'stop_pivoting': _stop(0.0, 1.0),
    }
