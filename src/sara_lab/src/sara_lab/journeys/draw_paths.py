"""`draw_paths`: the ways that every pair of planners drives on the three maps, side by side; a PNG for each map, made
anew by this one command.

Each panel is a pair of planners, on the same journeys of `journeys.py`, localized by the true pose. Shown is the true
path, the body's outline on the way, start and goal; what was driven backwards is dashed.
"""

import argparse
import math
import sys
from pathlib import Path

import numpy as np

from sara_bringup.paths import share
from sara_common.platforms import chosen
from sara_lab.journeys import journeys
from sara_lab.journeys.drawing import body_at, draw_map
from sara_lab.journeys.journeys import Planner
from sara_lab.judge.motion import Motion
from sara_sim.world.world import World

SHOWN = {
    'LatticePlanner + RotateThenPursue (the default)': Planner(
        'RotateThenPursue', '', True, {'base_global_planner': 'sara_nav/LatticePlanner'}
    ),
    'GridPlanner + RotateThenPursue': Planner(
        'RotateThenPursue', '', True, {'base_global_planner': 'sara_nav/GridPlanner'}
    ),
    'navfn + TrajectoryPlannerROS': journeys.PLANNERS['TrajectoryPlannerROS'],
    'navfn + DWAPlannerROS': journeys.PLANNERS['DWAPlannerROS'],
}
NUMBERS = {'school': (4, 1, 6), 'flat': (3, 0), 'hall': (0, 3)}  # which journeys
COLOURS = ('tab:blue', 'tab:red', 'tab:green')
OUTLINE_M, OUTLINE_RAD = 0.9, math.pi / 4  # between two outlines of the body
PANEL_INCH = 7.2


def driven(name: str, how: journeys.Planner, number: int) -> tuple[journeys.Outcome, Motion]:
    """(Outcome, Motion) of a journey."""
    t, poses = [], []

    def watch(lockstep):
        if lockstep.tick % 5 == 0:
            t.append(lockstep.time)
            poses.append(lockstep.chair.pose)

    outcome = journeys.drive(name, how, number, watch)
    return outcome, Motion.of(np.array(t), np.array(poses))


def picture(name: str, drives: dict[str, list[tuple[journeys.Outcome, Motion]]], path: Path) -> None:
    """Draw a map's PNG: `drives` is {planners: [(Outcome, Motion)]}."""
    import matplotlib

    matplotlib.use('Agg')
    from matplotlib import pyplot

    world = World.from_yaml(journeys.map_file(name))
    left, right, low, high = _seen(world)
    across = 1 if right - left > 3 * (high - low) else 2
    down = math.ceil(len(drives) / across)
    width = PANEL_INCH * (1.6 if across == 1 else 1.0)
    figure, axes = pyplot.subplots(
        down,
        across,
        figsize=(across * width, down * (width * (high - low) / (right - left) + 0.75) + 0.6),
        squeeze=False,
        layout='constrained',
    )
    for axis, (planners, of) in zip(axes.flat, drives.items()):
        _panel(axis, world, planners, of)
    for axis in list(axes.flat)[len(drives) :]:
        axis.axis('off')
    handles = _legend(next(iter(drives.values())))
    figure.legend(handles=handles, loc='upper center', bbox_to_anchor=(0.5, 0.0), ncols=4, fontsize=10)
    figure.suptitle(f'Ways driven on the map {name}, localized by the true pose', fontsize=13)
    figure.savefig(path, dpi=100, bbox_inches='tight')
    pyplot.close(figure)


def _seen(world):
    """(left, right, low, high) of what is occupied, m."""
    rows, columns = np.nonzero(world.occupied)
    size, (x0, y0) = world.resolution, world.origin
    return (
        x0 + size * columns.min(),
        x0 + size * (columns.max() + 1),
        y0 + size * rows.min(),
        y0 + size * (rows.max() + 1),
    )


def _panel(axis, world, planners, of):
    """One planner's drives on the map."""
    draw_map(axis, world)
    for (outcome, motion), colour in zip(of, COLOURS):
        _draw(axis, outcome, motion, colour)
    times = ', '.join(f'{outcome.seconds:.0f} s' if outcome.reached else 'not reached' for outcome, _ in of)
    discomfort = sum(outcome.judgement.discomfort for outcome, _ in of)
    contacts = sum(outcome.contacts for outcome, _ in of)
    axis.set_title(
        f'{planners}\n{times}; discomfort {discomfort:.0f} s' + (f'; {contacts} contacts' if contacts else ''),
        fontsize=11,
    )
    left, right, low, high = _seen(world)
    axis.set(
        xlim=(left - 0.2, right + 0.2), ylim=(low - 0.2, high + 0.2), aspect='equal', xlabel='x (m)', ylabel='y (m)'
    )


def _legend(of):
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles = [
        Line2D([], [], color=colour, linewidth=2, label=f'journey {outcome.number}: {outcome.way:.1f} m')
        for (outcome, _), colour in zip(of, COLOURS)
    ]
    return handles + [
        Line2D([], [], color='0.3', linewidth=2, linestyle=(0, (2, 1)), label='driven backwards'),
        Patch(edgecolor='0.3', facecolor='none', label='outline of the body, {:g} x {:g} m'.format(*chosen().size)),
        Line2D([], [], color='0.3', marker='o', linestyle='', label='start'),
        Line2D([], [], color='0.3', marker='*', markersize=11, linestyle='', label='goal; the arrow is its heading'),
    ]


def _draw(axis, outcome, motion, colour):
    backwards = motion.v < -0.03
    edges = np.flatnonzero(np.diff(backwards.astype(int))) + 1
    for a, b in zip(np.concatenate([[0], edges]), np.concatenate([edges, [len(motion.t)]])):
        axis.plot(
            *motion.pose[a : b + 1, :2].T, color=colour, linewidth=1.8, linestyle=(0, (2, 1)) if backwards[a] else '-'
        )
    last = None
    for k in [*range(len(motion.t)), -1]:
        x, y, yaw = motion.pose[k]
        if last is None or k == -1 or math.dist((x, y), last[:2]) > OUTLINE_M or abs(yaw - last[2]) > OUTLINE_RAD:
            axis.add_patch(body_at((x, y, yaw), edgecolor=colour, facecolor='none', linewidth=0.7, alpha=0.55))
            last = x, y, yaw
    for (x, y, yaw), mark, far in ((outcome.start, 'o', 7), (outcome.goal, '*', 13)):
        axis.plot(x, y, mark, color=colour, markersize=far, markeredgecolor='black', markeredgewidth=0.6, zorder=5)
        axis.annotate(
            '',
            (x + 0.9 * math.cos(yaw), y + 0.9 * math.sin(yaw)),
            (x, y),
            arrowprops={'color': colour, 'arrowstyle': '-|>', 'linewidth': 1.8},
            zorder=5,
        )


def main(words: list[str] | None = None) -> None:
    """Write paths_MAP.png of each map."""
    parser = argparse.ArgumentParser(prog='draw_paths', description=__doc__)
    parser.add_argument('maps', nargs='*', metavar='MAP', help=f'of {", ".join(NUMBERS)}; all without it')
    parser.add_argument(
        '--out', type=Path, default=share().parents[1] / 'docs' / 'images', help='folder (default: %(default)s)'
    )
    options = parser.parse_args(words)
    unknown = [name for name in options.maps if name not in NUMBERS]
    if unknown:
        parser.error(f'there is no map {", ".join(unknown)}; there are {", ".join(NUMBERS)}')
    options.out.mkdir(parents=True, exist_ok=True)
    from tqdm import tqdm

    for name in options.maps or NUMBERS:
        drives = {}
        for planners, number in tqdm(
            [(planners, number) for planners in SHOWN for number in NUMBERS[name]], unit='journey', desc=name
        ):
            drives.setdefault(planners, []).append(driven(name, SHOWN[planners], number))
        picture(name, drives, options.out / f'paths_{name}.png')
        print(f'{options.out / f"paths_{name}.png"} is drawn', file=sys.stderr)
