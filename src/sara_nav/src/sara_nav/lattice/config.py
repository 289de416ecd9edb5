"""Parameters of LatticePlanner."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sara_common.config import range_faults
from sara_nav.grids.clearance import lead
from sara_nav.grids.grid import GridGeometry
from sara_nav.lattice.driving import Driving
from sara_nav.lattice.shortcuts import Shortcuts
from sara_nav.lattice.world import Body, Rules, World
from sara_nav.pursuit.speed_ahead import Regulation

RADII = (1.0, 1.6, 2.6, 4.0)
"""Of the arcs of shortcuts, as multiples of the least."""


@dataclass(frozen=True)
class LatticePlannerConfig:
    """Parameters of LatticePlanner; m, s, rad. Paths are compared by the time they take.

    allow_unknown: plan through unknown cells. default_tolerance: how far a goal that cannot be reached may be moved.
    turn_only_distance: a goal nearer than this to the robot is only turned to, where there is room. path_spacing:
    between the plan's points. speed, turn_rate: what moves are timed with. reverse_factor: how many times dearer a path
    astern is. turn_cost: of beginning a turn in place. gear_cost: of changing between ahead and astern. hard_margin:
    the body comes no nearer to an obstacle, beyond the padding its footprint has. least_margin: how near it may come
    where no path keeps hard_margin, nor half-way to this; 0: no nearer. clearance, clearance_weight: nearer than
    clearance a path takes up to 1 + clearance_weight times as long, by the fourth power of the share that is missing.
    turning_room, turning_room_weight: the room wanted round the circle that turning in place sweeps, and how many times
    longer a turn takes, by the square, without any. narrow, run_up, run_up_cost: a leg whose ends are nearer than
    run_up to where the gap is less than narrow costs up to run_up_cost more at each end, so that doors are approached
    straight. blind, beside, blind_weight: a turn or an arc takes up to 1 + blind_weight times as long with something
    nearer than blind before the front or behind the rear, where sensors do not measure; so does a turn in place with
    something nearer than beside, which is at most blind. smooth: move corners to where the path takes less time, and
    round them where there is room. bend_deviation: how far bends may leave their arcs to begin and end gently, where
    the gap is clearance or more; evenly less down to a gap of curve_margin, where they may not; 0: never. curve_radius:
    m of the least arc by which turns in place become turns while driving, where that takes less time; 0: none do.
    curve_margin: gap on such arcs, and that gentle bends leave. curve_stop: s that stopping to turn in place takes
    then. max_vel_x ... ahead_stop_distance: how the local planner drives, by which such paths are timed; see
    RotateThenPursueConfig. greed: how much more the search, whose path is then made straight, minds what is left than
    what is behind. max_expansions: states looked at before it gives up.
    """

    allow_unknown: bool = False
    default_tolerance: float = 0.0
    turn_only_distance: float = 0.0
    path_spacing: float = 0.05
    speed: float = 0.5
    turn_rate: float = 0.4
    reverse_factor: float = 4.0
    turn_cost: float = 2.0
    gear_cost: float = 3.0
    hard_margin: float = 0.02
    least_margin: float = 0.0
    clearance: float = 0.30
    clearance_weight: float = 22.0
    turning_room: float = 0.15
    turning_room_weight: float = 10.0
    narrow: float = 0.2
    run_up: float = 0.6
    run_up_cost: float = 4.0
    blind: float = 0.0
    beside: float = 0.0
    blind_weight: float = 20.0
    smooth: bool = True
    bend_deviation: float = 0.0
    curve_radius: float = 0.0
    curve_margin: float = 0.12
    curve_stop: float = 3.0
    max_vel_x: float = 0.5
    max_vel_theta: float = 0.4
    max_lateral_acc: float = 0.2
    wide_gap: float = 0.35
    narrow_vel: float = 0.1
    ahead_angle: float = 0.7
    ahead_reaction_time: float = 1.35
    ahead_dec: float = 0.8
    ahead_stop_distance: float = 0.15
    greed: float = 6.0
    max_expansions: int = 30000

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        return range_faults(
            self,
            {
                'default_tolerance': (0.0, 1e6),
                'path_spacing': (0.005, 1.0),
                'speed': (0.0, 10.0, True),
                'turn_rate': (0.0, 10.0, True),
                'reverse_factor': (1.0, 100.0),
                'turn_cost': (0.0, 100.0),
                'gear_cost': (0.0, 100.0),
                'hard_margin': (0.0, 1.0),
                'least_margin': (0.0, 1.0),
                'clearance': (0.0, 2.0, True),
                'clearance_weight': (0.0, 100.0),
                'turning_room': (0.0, 2.0, True),
                'turning_room_weight': (0.0, 100.0),
                'narrow': (0.0, 2.0),
                'run_up': (0.0, 10.0, True),
                'run_up_cost': (0.0, 100.0),
                'blind': (0.0, 2.0),
                'beside': (0.0, 2.0),
                'blind_weight': (0.0, 1000.0),
                'bend_deviation': (0.0, 1.0),
                'curve_radius': (0.0, 10.0),
                'curve_margin': (0.0, 1.0),
                'curve_stop': (0.0, 100.0),
                'max_vel_x': (0.0, 10.0, True),
                'max_vel_theta': (0.0, 10.0, True),
                'max_lateral_acc': (0.0, 10.0, True),
                'wide_gap': (0.0, 2.0, True),
                'narrow_vel': (0.0, 10.0, True),
                'ahead_angle': (0.0, 1.3),
                'ahead_reaction_time': (0.0, 10.0),
                'ahead_dec': (0.0, 10.0, True),
                'ahead_stop_distance': (0.0, 10.0),
                'greed': (1.0, 10.0),
                'max_expansions': (1, 2000000),
            },
        )

    @property
    def soft(self) -> float:
        """The greatest gap (m) that needs to be distinguished."""
        return max(self.clearance, self.turning_room, self.hard_margin, self.narrow, self.blind)

    def rules(self, geometry: GridGeometry, body: Body) -> Rules:
        """Return what the kernels go by, for a body on a grid."""
        return Rules(
            speed=float(self.speed),
            turn_rate=float(self.turn_rate),
            lateral=math.inf,
            reverse_factor=float(self.reverse_factor),
            hard_margin=float(self.hard_margin),
            greatest_gap=float(self.soft),
            clearance=float(self.clearance),
            clearance_weight=float(self.clearance_weight),
            turning_room=float(self.turning_room),
            turning_room_weight=float(self.turning_room_weight),
            turn_cost=float(self.turn_cost),
            gear_cost=float(self.gear_cost),
            origin_x=float(geometry.origin_x),
            origin_y=float(geometry.origin_y),
            resolution=float(geometry.resolution),
            spacing=float(body.spacing),
            radius=float(body.circumscribed),
            sense=1.0,
            narrow=float(self.narrow),
            run_up=float(self.run_up),
            run_up_cost=float(self.run_up_cost),
            blind=float(self.blind),
            beside=float(self.beside),
            blind_weight=float(self.blind_weight),
        )

    def shortcuts(self, world: World, corners: np.ndarray) -> Shortcuts | None:
        """Return what shortcuts in a World are made by, for a body with these corners (k, 2), m; None: none are
        made.
        """
        if self.curve_radius == 0.0:
            return None
        rules = world.rules._replace(
            speed=float(self.max_vel_x),
            turn_rate=float(self.max_vel_theta),
            lateral=float(self.max_lateral_acc),
            turn_cost=float(self.curve_stop),
        )
        regulation = Regulation(
            float(self.wide_gap),
            float(self.narrow_vel),
            math.tan(self.ahead_angle),
            float(self.ahead_stop_distance),
            float(self.ahead_reaction_time),
            float(self.ahead_dec),
        )
        (front, span), (rear, _) = lead(corners, False), lead(corners, True)
        driving = Driving(regulation, front, rear, span)
        margin = float(max(self.curve_margin, self.hard_margin))
        return Shortcuts(self.curve_radius * np.array(RADII), margin, world._replace(rules=rules), driving)

    def pace(self, gap: np.ndarray) -> np.ndarray:
        """Return s/m that a path takes at least where the gap (m, array) is no more than that; inf below the hard
        margin.
        """
        missing = (1.0 - np.clip(gap, 0.0, self.clearance) / self.clearance) ** 4
        return np.where(gap < self.hard_margin, math.inf, (1.0 + self.clearance_weight * missing) / self.speed)
