"""`draw_worlds`: a sheet of worlds with the ways that the four planners drove there, made anew by this one command.

One world of each kind, or of --kinds, and with --maps those of a folder; each planner's true path, dashed where it
failed. A cross marks a contact. Start (grey) and goal are the body's outlines.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from sara_bringup.paths import share
from sara_lab.journeys.drawing import body_at, draw_map
from sara_lab.journeys.worlds.foreign import ForeignError, entries, foreign
from sara_lab.journeys.worlds.made import KINDS, PER_KIND, made
from sara_lab.journeys.worlds.trial import DELIVERED, PLANNERS, drive
from sara_nav.maps import map_io
from sara_sim.world.world import World

COLOURS = dict(zip(PLANNERS, ('tab:blue', 'tab:orange', 'tab:green', 'tab:red')))
ACROSS, PANEL_INCH = 5, 4.0
EVERY = 10  # steps between two points of a path


def driven(task, planner):
    """(Outcome, (n, 2) points of the true path in m, (k, 2) where the chair was at a contact)."""
    points, touched, known = [], [], 0

    def watch(lockstep):
        nonlocal known
        if lockstep.tick % EVERY == 0:
            points.append(lockstep.chair.pose[:2])
        if lockstep.chair.contacts > known:
            known = lockstep.chair.contacts
            touched.append(lockstep.chair.pose[:2])

    outcome = drive(task, planner, watch)
    return outcome, np.array(points), np.array(touched).reshape(-1, 2)


def panel(axis, task, drives):
    """Draw a Task with `drives`, {planner: what `driven` gives}."""
    geometry = task.grid.geometry
    world = World(task.grid.data == map_io.OCCUPIED, geometry.resolution, (geometry.origin_x, geometry.origin_y))
    draw_map(axis, world)
    for planner, (outcome, points, touched) in drives.items():
        style = '-' if outcome.success else (0, (2, 1.5))
        axis.plot(*points.T, color=COLOURS[planner], linewidth=1.6, linestyle=style)
        axis.plot(*touched.T, 'x', color=COLOURS[planner], markersize=9, markeredgewidth=2)
    axis.add_patch(body_at(task.start, facecolor='0.75', edgecolor='black'))
    axis.add_patch(body_at(task.goal, facecolor='none', edgecolor='black', linewidth=1.5))
    ends = np.array([task.start, task.goal])[:, :2]
    rows, columns = np.nonzero(world.occupied)
    seen = np.vstack([ends - 1.0, ends + 1.0, np.column_stack(geometry.to_world(columns, rows))])
    axis.set_xlim(seen[:, 0].min(), seen[:, 0].max())
    axis.set_ylim(seen[:, 1].min(), seen[:, 1].max())
    axis.set_title(task.name + (f', x {task.scale:.2f}' if task.scale != 1.0 else ''), fontsize=11)
    axis.set_aspect('equal')
    axis.tick_params(labelsize=7)


def main(words: list[str] | None = None) -> None:
    """Write the sheet."""
    parser = argparse.ArgumentParser(prog='draw_worlds', description=__doc__)
    parser.add_argument('--number', type=int, default=0, help=f'which world of each kind, below {PER_KIND}')
    parser.add_argument('--kinds', nargs='+', choices=KINDS, default=KINDS, metavar='KIND', help=', '.join(KINDS))
    parser.add_argument('--maps', type=Path, metavar='FOLDER', help='worlds of others too, named by its worlds.yaml')
    parser.add_argument(
        '--out', type=Path, default=share().parents[1] / 'docs' / 'images' / 'worlds.png', help='default: %(default)s'
    )
    options = parser.parse_args(words)
    if not 0 <= options.number < PER_KIND:
        parser.error(f'--number is {options.number}, allowed are whole numbers from 0 to {PER_KIND - 1}')
    try:
        others = list(enumerate(entries(options.maps))) if options.maps else []
        sheet([lambda kind=kind: made(kind, options.number) for kind in options.kinds], others, options.out)
    except ForeignError as error:
        sys.exit(f'draw_worlds: {error}')
    print(f'{options.out} is drawn', file=sys.stderr)


def sheet(makers, others, path):
    """Draw worlds: functions without arguments that give a Task each, and (number, Entry) of a list."""
    import matplotlib

    matplotlib.use('Agg')
    from matplotlib import pyplot
    from matplotlib.lines import Line2D
    from tqdm import tqdm

    makers = [*makers, *(lambda entry=entry, number=number: foreign(entry, number) for number, entry in others)]
    across = min(ACROSS, len(makers))
    down = -(-len(makers) // across)
    figure, axes = pyplot.subplots(
        down, across, figsize=(across * PANEL_INCH, down * PANEL_INCH), squeeze=False, layout='constrained'
    )
    shown = [planner for planner in PLANNERS if planner != DELIVERED]
    for axis, make in tqdm(list(zip(axes.flat, makers)), unit='world', desc='draw_worlds'):
        task = make()
        panel(axis, task, {planner: driven(task, planner) for planner in shown})
    for axis in axes.flat[len(makers) :]:
        axis.axis('off')
    handles = [Line2D([], [], color=COLOURS[planner], label=planner) for planner in shown]
    handles.append(Line2D([], [], color='0.3', linestyle='--', label='no success'))
    handles.append(Line2D([], [], color='0.3', marker='x', linestyle='', label='contact'))
    figure.legend(handles=handles, loc='upper center', bbox_to_anchor=(0.5, 0.0), ncols=len(handles), fontsize=12)
    figure.savefig(path, dpi=70, bbox_inches='tight')
    pyplot.close(figure)
