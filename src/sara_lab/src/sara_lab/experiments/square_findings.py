"""E9: what the drives of its set-ups come to, and the findings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sara_lab.experiments.core import (
    CONFIRMED,
    CONTRADICTED,
    PARTLY,
    Finding,
    Results,
    interval,
    mean,
    results_of,
    spread,
)
from sara_lab.experiments.courses import DEFAULT, LONG, MIDDLE, OURS, SHORT, VX, XY, XY_VX
from sara_lab.experiments.square import FUSIONS, SECOND, STEERED, STEPS, setups_9

LOST_M = 0.5  # a corner further off than this, on average, is a lost square
LONG_WAY_DEG = 90.0  # turned so much beyond the shortest on a leg, or more than half a turn in all: the long way round
COMPARED = (SHORT, LONG, OURS)


def judged(drives: Sequence[dict]) -> dict:
    """What is compared: spreads over the drives of a set-up, and the share that turned the long way round at least
    once.
    """

    def long_way(drive):
        return any(abs(leg['net']) > 180.0 or leg['all'] - leg['least'] > LONG_WAY_DEG for leg in drive['legs'])

    return {
        'corner_m': spread([np.mean(drive['true']['position']) for drive in drives]),
        'seen_m': spread([np.mean(drive['fused']['position']) for drive in drives]),
        'straight_m': spread([drive['fused']['cross_track_p95'] for drive in drives]),
        'reached': float(np.mean([drive['true']['reached'] / 4.0 for drive in drives])),
        'long_way': float(np.mean([long_way(drive) for drive in drives])),
        'last_leg': spread([drive['legs'][-1]['all'] - drive['legs'][-1]['least'] for drive in drives]),
        'seconds': spread([drive['seconds'] for drive in drives]),
        'pace': spread([drive['pace'] for drive in drives]),
        'values': [float(np.mean(drive['true']['position'])) for drive in drives],
        'contacts': int(sum(drive['contacts'] for drive in drives)),
    }


@dataclass(frozen=True)
class Spreads:
    """`found`: {(course, planner, fusion): judged} of all set-ups."""

    found: dict[tuple[str, str, str], dict]

    @classmethod
    def of(cls, results: Results) -> 'Spreads':
        """From the results of all cases."""
        return cls({key: judged(results_of(results, 'E9', *key)) for key in setups_9()})

    @property
    def square(self) -> dict[str, dict[str, dict]]:
        """{planner: {fusion: judged}} round the square."""
        return {
            planner: {fusion: self.found['square', planner, fusion] for fusion in fusions}
            for planner, fusions in FUSIONS.items()
        }

    @property
    def steered(self) -> dict:
        """vx fused, navigation steered by the wheels."""
        return self.found['square', 'changed', STEERED]

    @property
    def steps(self) -> dict:
        """x and y fused as steps."""
        return self.found['square', 'changed', STEPS]


def findings(of: Spreads) -> tuple[Finding, ...]:
    """What the thesis found, what we find, and the verdict."""
    return (*_of_inputs(of), *_of_sim_time(of), *_of_courses(of))


def _of_inputs(of):
    """Which wheel inputs lose the square."""
    short, long_ = of.square[SHORT], of.square[LONG]
    lost = short[VX]['corner_m']['mean'] > LOST_M
    cured = short[XY_VX]['corner_m']['mean'] < short[XY]['corner_m']['mean']
    rank = [
        min(group, key=lambda name: group[name]['corner_m']['mean'])
        for group in ({name: of.square[planner][name] for name in (VX, XY, XY_VX)} for planner in COMPARED)
    ]
    return (
        (
            'vx alone loses the square (figures 4.24 to 4.26)',
            f'corners are {mean(short[VX]["corner_m"], 2, "m")} off. Figure 4.24 shows a chair steered by its wheels '
            '(below)',
            CONFIRMED if lost else CONTRADICTED,
        ),
        (
            'x, y alone turns the long way round (4.27 to 4.29)',
            f'with sim_time 1.0 s in {short[XY]["long_way"]:.0%} of the drives (vx alone: '
            f'{short[VX]["long_way"]:.0%}), with 2.5 s in {long_[XY]["long_way"]:.0%} (vx: {long_[VX]["long_way"]:.0%})'
            '; the square is lost '
            f'({mean(short[XY]["corner_m"], 1, "m")})',
            CONFIRMED if short[XY]['long_way'] > 0.5 else PARTLY,
        ),
        (
            'x, y and vx is better than x, y alone (4.30 to 4.32)',
            f'corners {mean(short[XY_VX]["corner_m"], 2, "m")} off instead of {mean(short[XY]["corner_m"], 1, "m")}; '
            f'as seen by the filter {mean(short[XY_VX]["seen_m"], 2, "m")}',
            CONFIRMED if cured else CONTRADICTED,
        ),
        (
            'x, y and vx is the best of the three',
            f'by the true pose {rank[0] if len(set(rank)) == 1 else " or ".join(rank)} is, under each planner: x, y, '
            'vx counts part of each step twice, so true legs are too short',
            CONTRADICTED if set(rank) == {VX} else PARTLY,
        ),
    )


def _of_sim_time(of):
    """What the longer sim_time changes."""
    short, long_ = of.square[SHORT], of.square[LONG]
    return (
        (
            'with the longer sim_time legs are straight and turns go the short way (4.33 to 4.39)',
            f'x, y, vx: {long_[XY_VX]["long_way"]:.0%} instead of {short[XY_VX]["long_way"]:.0%} of the drives turn '
            f'the long way; legs are straight within {mean(long_[XY_VX]["straight_m"], 3)} instead of '
            f'{mean(short[XY_VX]["straight_m"], 3, "m")}',
            CONFIRMED
            if long_[XY_VX]['straight_m']['mean'] < short[XY_VX]['straight_m']['mean']
            and long_[XY_VX]['long_way'] <= short[XY_VX]['long_way']
            else PARTLY,
        ),
        (
            'and it is slower',
            f'while driving {mean(long_[VX]["pace"], 2)} instead of {mean(short[VX]["pace"], 2, "m/s")} with vx, '
            f'{mean(long_[XY_VX]["pace"], 2)} instead of {mean(short[XY_VX]["pace"], 2, "m/s")} with x, y, vx; '
            'without the long turns x, y, vx needs less time',
            CONFIRMED
            if all(long_[fusion]['pace']['high'] < short[fusion]['pace']['low'] for fusion in (VX, XY_VX))
            else PARTLY,
        ),
    )


def _of_courses(of):
    """The second course, and SARA's own planner."""
    ours = of.square[OURS]
    second = [of.found[name, OURS, DEFAULT] for name in SECOND]
    printed, meant = (of.found[name, MIDDLE, XY_VX] for name in SECOND)
    return (
        (
            'second course (4.35, 4.36): half a turn too many in leg 4',
            f'{mean(printed["last_leg"], 0, "deg")} too many as printed, with sim_time 1.5 s; with (0, -3) instead of '
            f'(1, -3), a leg straight ahead, {mean(meant["last_leg"], 0, "deg")}. '
            f"SARA's planner: {mean(second[0]['last_leg'], 0, 'deg')} (18 to face the slanting leg and 18 back) and "
            f'{mean(second[1]["last_leg"], 0, "deg")}',
            CONFIRMED if printed['last_leg']['mean'] > 90.0 else PARTLY,
        ),
        (
            '(ours) a planner that turns the short way and drives straight',
            f'{ours[DEFAULT]["long_way"]:.0%} the long way; off the legs '
            f'{mean(ours[DEFAULT]["straight_m"], 3, "m")} as seen, corners '
            f'{interval(ours[DEFAULT]["corner_m"], 3, "m")} off; '
            f'second course {" and ".join(mean(of["corner_m"], 3, "m") for of in second)}',
            CONFIRMED if ours[DEFAULT]['long_way'] == 0.0 else PARTLY,
        ),
    )
