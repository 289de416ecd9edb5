"""The drawn maps: they are what their script draws, their doors are as wide as it says, and the chair gets into every
room.
"""

import importlib.util
import math

import numpy as np
import pytest

from sara_bringup.lockstep.lockstep import world_of
from sara_bringup.paths import share
from sara_nav.maps.map_io import load_map
from sara_sim.world.world import World

MAPS = share() / 'maps'
LENGTH, WIDTH = 1.08, 0.58
HEADINGS = 16  # of the lattice on which the chair's ways are looked for
STEP = 2  # cells between its points: 0.10 m


@pytest.fixture(scope='module')
def script():
    spec = importlib.util.spec_from_file_location('draw_maps', MAPS / 'draw_maps.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize('name', ('room', 'hall', 'doorway', 'school', 'flat', 'street', 'street_world'))
def test_a_map_is_what_the_script_draws(script, tmp_path, name):
    assert name in [draw.__name__ for draw in script.MAPS]
    getattr(script, name)().save(tmp_path, name)
    for ending in ('.pgm', '.yaml'):
        assert (tmp_path / (name + ending)).read_bytes() == (MAPS / (name + ending)).read_bytes(), (
            f'run maps/draw_maps.py: {name}{ending} is not what it draws'
        )


@pytest.mark.parametrize('name', ('room', 'hall', 'doorway', 'school', 'flat'))
def test_the_simulator_makes_the_same_world_of_a_map_whoever_reads_it(name):
    path = MAPS / f'{name}.yaml'
    ours, its = world_of(load_map(str(path))), World.from_yaml(path)
    np.testing.assert_array_equal(ours.occupied, its.occupied)
    assert (ours.resolution, ours.origin) == (its.resolution, its.origin)


@pytest.mark.parametrize('name', ('school', 'flat'))
def test_doors_are_0_80_and_0_90_m_wide(script, name):
    grid = load_map(str(MAPS / f'{name}.yaml'))
    widths = []
    for x0, y0, x1, y1 in getattr(script, f'{name.upper()}_DOORS'):
        column, row = grid.geometry.to_cell((x0 + x1) / 2, (y0 + y1) / 2)
        line = grid.data[row] if x1 - x0 > y1 - y0 else grid.data[:, column]
        here = column if x1 - x0 > y1 - y0 else row
        walls = np.flatnonzero(line == 100)
        widths.append(round(grid.geometry.resolution * (walls[walls > here].min() - walls[walls < here].max() - 1), 3))
    assert set(widths) == {0.80, 0.90}


def standing(free, resolution):
    """bool (HEADINGS, rows, columns): where the chair stands free at each heading."""
    from scipy import ndimage

    result = np.zeros((HEADINGS, *free.shape), bool)
    reach = math.ceil(math.hypot(LENGTH, WIDTH) / 2 / resolution) + 1
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1] * resolution
    half = resolution / 2 * math.sqrt(2.0)  # whatever of a cell the body touches counts
    for k in range(HEADINGS):
        c, s = math.cos(2 * math.pi * k / HEADINGS), math.sin(2 * math.pi * k / HEADINGS)
        body = (np.abs(c * x + s * y) <= LENGTH / 2 + half) & (np.abs(-s * x + c * y) <= WIDTH / 2 + half)
        result[k] = ndimage.binary_erosion(free, body)
    return result


def shifted(grid, rows, columns):
    """The grid moved; what comes in is False."""
    result = np.zeros_like(grid)
    h, w = grid.shape
    result[max(rows, 0) : h + min(rows, 0), max(columns, 0) : w + min(columns, 0)] = grid[
        max(-rows, 0) : h + min(-rows, 0), max(-columns, 0) : w + min(-columns, 0)
    ]
    return result


def reached(free, resolution, start):
    """Where the chair gets to from a cell (row, column), turning in place and driving straight ahead and back; bool
    (rows, columns) of the lattice.
    """
    stands = standing(free, resolution)[:, ::STEP, ::STEP]
    moves = [(1, 0), (2, 1), (1, 1), (1, 2)]  # lattice points, near each heading; three quarters more
    moves += [(-y, x) for x, y in moves]
    moves += [(-x, -y) for x, y in moves]
    seen = np.zeros_like(stands)
    seen[:, start[0] // STEP, start[1] // STEP] = stands[:, start[0] // STEP, start[1] // STEP]
    count = -1
    while seen.sum() > count:
        count = seen.sum()
        for k, (x, y) in enumerate(moves):
            for way in (1, -1):
                seen[k] |= shifted(seen[k], way * y, way * x) & stands[k]
        seen |= (np.roll(seen, 1, axis=0) | np.roll(seen, -1, axis=0)) & stands
    return seen.any(axis=0)


@pytest.mark.parametrize(
    'name,start', (('school', (14.0, 7.1)), ('flat', (5.5, 4.8)), ('hall', (15.0, 4.0)), ('room', (1.0, 1.0)))
)
def test_the_chair_gets_into_every_room(script, name, start):
    grid = load_map(str(MAPS / f'{name}.yaml'))
    column, row = grid.geometry.to_cell(*start)
    there = reached(grid.data == 0, grid.geometry.resolution, (row, column))
    for x0, y0, x1, y1 in getattr(script, f'{name.upper()}_ROOMS', [(0.0, 0.0, 6.0, 6.0)]):
        (left, bottom), (right, top) = (
            grid.geometry.to_cell(x0 + 0.01, y0 + 0.01),
            grid.geometry.to_cell(x1 - 0.01, y1 - 0.01),
        )
        part = there[bottom // STEP : top // STEP, left // STEP : right // STEP]
        assert part.mean() > 0.15, f'{name}: the chair reaches only {part.mean():.0%} of the room at ({x0}, {y0})'


def test_a_door_of_0_55_m_keeps_the_chair_out():
    """The search above finds no way where there is none."""
    free = np.zeros((100, 100), bool)
    free[5:95, 5:45], free[5:95, 55:95], free[40:51, 45:55] = True, True, True
    assert not reached(free, 0.05, (20, 20))[:, 30:].any()
    free[40:56, 45:55] = True
    assert reached(free, 0.05, (20, 20))[:, 30:].any()
