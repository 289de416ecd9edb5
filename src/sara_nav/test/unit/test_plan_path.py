"""plan_path: the answer on the command line, in JSON and as a picture, and what it says of questions that make no
sense.
"""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sara_common.platforms import chosen
from sara_nav.costmaps.costmap import build
from sara_nav.grids.footprint import radii
from sara_nav.maps.map_io import load_map
from sara_nav.planners.plan_path import main
from sara_nav.planners.planning import GLOBAL_PLANNERS

DATA = Path(__file__).parents[1] / 'data'
ROOM = str(DATA / 'room.yaml')
"""8 x 8 m from (-1, -1) on, with a pillar at (4.1, 3.9)."""


def ask(capsys, *arguments):
    """Return (exit status, standard output, error output) of a call."""
    with pytest.raises(SystemExit) as end:
        main([str(a) for a in arguments])
    out = capsys.readouterr()
    return end.value.code, out.out, out.err


ENDS = ('--start', 1.2, 1.2, 0.5, '--goal', 6.3, 6.6, -1e-3)


@pytest.mark.parametrize('name', [None, *GLOBAL_PLANNERS.names()])
def test_json_holds_the_plan(capsys, name):
    status, out, _ = ask(capsys, ROOM, *ENDS, '--json', *(('--planner', name) if name else ()))
    answer = json.loads(out)
    assert status == 0 and sorted(answer) == ['length_m', 'path', 'planning_ms', 'success']
    assert answer['success'] is True and answer['planning_ms'] > 0.0
    path = np.array(answer['path'])
    assert path[0, :2] == pytest.approx([1.2, 1.2]) and path[-1] == pytest.approx([6.3, 6.6, -0.001])
    assert answer['length_m'] == pytest.approx(np.hypot(*np.diff(path[:, :2], axis=0).T).sum())
    assert 7.4 < answer['length_m'] < 9.0 and np.abs(path[:, 2]).max() <= math.pi
    costmap = build(load_map(ROOM), radii(np.array(chosen().footprint))[0])
    assert max(costmap.cost_at(x, y) for x, y, _ in path) < 253


def test_without_json_a_sentence(capsys):
    status, out, err = ask(capsys, ROOM, *ENDS)
    assert status == 0 and 'm in' in out and 'planned in' in out and err == ''


def test_negative_numbers_of_any_form_are_numbers(capsys):
    status, out, _ = ask(capsys, ROOM, '--start', '1.2', '1.2', '-1.5', '--goal', '6.5', '6.6', '-1e-3', '--json')
    assert status == 0 and json.loads(out)['path'][-1][2] == -0.001
    status, _, err = ask(capsys, ROOM, '--start', '-1.2', '-.2', '-1', '--goal', '1', '1', '0')
    assert status == 1 and 'the robot at (-1.20, -0.20) is off the map' in err


@pytest.mark.parametrize(
    'goal, reason',
    [
        ((60, 1, 0), 'off the map'),
        ((4.1, 3.9, 0), 'in an obstacle'),
        ((4.1, 4.2, 0), 'too near an obstacle'),
        (('nan', 1, 0), 'not finite'),
    ],
)
def test_no_plan_is_said(capsys, goal, reason):
    status, out, err = ask(capsys, ROOM, '--start', 1.2, 1.2, 0.0, '--goal', *goal, '--json')
    answer = json.loads(out)
    assert status == 1 and answer['success'] is False and answer['path'] == [] and answer['length_m'] == 0.0
    assert reason in err


def test_a_wider_robot_keeps_further_off(capsys):
    distances = []
    for half in (0.2, 1.0):
        corners = '[[%g,%g],[%g,-%g],[-%g,-%g],[-%g,%g]]' % ((half,) * 8)
        status, out, _ = ask(
            capsys, ROOM, '--start', 2.6, 2.0, 0, '--goal', 5.6, 5.8, 0, '--footprint', corners, '--json'
        )
        assert status == 0
        path = np.array(json.loads(out)['path'])
        distances.append(np.hypot(path[:, 0] - 4.1, path[:, 1] - 3.9).min())  # to the pillar's middle
    assert distances[0] < 0.9 and distances[1] > 1.0


def test_parameters_of_the_inflation_and_of_the_planner(capsys):
    plain, near, astar = (
        json.loads(ask(capsys, ROOM, *ENDS, '--json', *more)[1])['length_m']
        for more in (
            (),
            ('--param', 'inflation_radius=0.3'),
            ('--param', 'use_astar=true', '--param', 'allow_unknown=false'),
        )
    )
    assert near < plain and astar == pytest.approx(plain, rel=0.03)


@pytest.mark.parametrize(
    'more, reason',
    [
        (('--planner', 'carrot_planner/CarrotPlanner'), 'not here: use navfn/NavfnROS'),
        (('--planner', 'nowhere'), 'allowed are'),
        (('--footprint', '[[1,2]]'), 'footprint has 1 corners'),
        (('--footprint', 'round'), 'footprint'),
        (('--param', 'use_astra=true'), 'use_astar'),
        (('--param', 'use_astar'), 'use_astar'),
        (('--param', 'inflation_radius=0.1'), 'inscribed radius'),
        (('--param', 'use_astar=7'), 'true or false'),
        (('--param', 'default_tolerance=-1'), 'default_tolerance'),
        (('--param', 'a={'), 'NAME=VALUE'),
        (('--png', '/nowhere/plan.png'), '/nowhere'),
        (('--png', 'plan.nothing'), 'extension'),
    ],
)
def test_a_question_that_makes_no_sense_is_said(capsys, more, reason):
    status, out, err = ask(capsys, ROOM, *ENDS, '--json', *more)
    assert status == 2 and json.loads(out)['success'] is False and reason in err


@pytest.mark.parametrize('name', ['navfn/NavfnROS', 'global_planner/GlobalPlanner'])
def test_what_has_no_effect_is_said(capsys, name):
    status, _, err = ask(capsys, ROOM, *ENDS, '--planner', name, '--param', 'planner_window_x=4.0')
    assert (
        status == 0 and err == 'plan_path: planner_window_x is 4.0, which has no effect: the whole map is planned on\n'
    )


def test_maps_that_cannot_be_used_are_said(capsys, tmp_path):
    assert ask(capsys, tmp_path / 'none.yaml', *ENDS)[0] == 2
    turned = tmp_path / 'turned.yaml'
    turned.write_text(
        Path(ROOM)
        .read_text()
        .replace('room.pgm', str(DATA / 'room.pgm'))
        .replace('origin: [-1.0, -1.0, 0.0]', 'origin: [-1.0, -1.0, 0.5]')
    )
    assert '0.5]' in turned.read_text()
    status, _, err = ask(capsys, turned, *ENDS)
    assert status == 2 and 'turned by 0.5 rad' in err


@pytest.mark.parametrize(
    'arguments',
    [
        (),
        (ROOM,),
        (ROOM, '--start', '1', '2', '--goal', '1', '2', '3'),
        (ROOM, '--start', 'a', '2', '0', '--goal', '1', '2', '3'),
    ],
)
def test_half_a_question_prints_how_to_ask(capsys, arguments):
    status, _, err = ask(capsys, *arguments)
    assert status == 2 and 'usage: plan_path' in err


def test_the_picture_shows_map_plan_and_footprints(capsys, tmp_path):
    picture = tmp_path / 'plan.png'
    assert ask(capsys, ROOM, *ENDS, '--png', picture)[0] == 0
    pixels = np.asarray(Image.open(picture))
    assert min(pixels.shape[:2]) >= 600 and pixels.shape[0] == pixels.shape[1]
    side = pixels.shape[0] / 8.0

    def near(x, y, colour):
        across, down = int((x + 1.0) * side), int((7.0 - y) * side)
        reach = int(0.7 * side)
        return (
            (pixels[max(down - reach, 0) : down + reach, max(across - reach, 0) : across + reach] == colour)
            .all(axis=2)
            .sum()
        )

    assert near(1.2, 1.2, (20, 150, 40)) > 100 and near(6.2, 6.2, (20, 150, 40)) == 0  # the robot at its start
    assert near(6.5, 6.6, (220, 30, 30)) > 100  # and at the goal
    assert (pixels == (220, 30, 30)).all(axis=2).sum() > 600  # with the plan
    assert (pixels[int(3.1 * side), int(5.1 * side)] == 0).all()  # the pillar


def test_a_planner_of_the_footprint_plans_for_the_one_that_is_given(capsys):
    lattice = '--planner', 'sara_nav/LatticePlanner', '--json'
    by_the_wall = '--start', 1.2, 1.2, 0.5, '--goal', 3.0, -0.6, 0.0
    status, out, _ = ask(capsys, ROOM, *by_the_wall, *lattice)
    assert status == 0 and json.loads(out)['path'][-1] == [3.0, -0.6, 0.0]
    status, _, err = ask(
        capsys, ROOM, *by_the_wall, *lattice, '--footprint', '[[0.5,0.5],[0.5,-0.5],[-0.5,-0.5],[-0.5,0.5]]'
    )
    assert status == 1 and 'the footprint at the goal (3.00, -0.60, 0 deg) overlaps an obstacle' in err


def test_a_picture_shows_the_footprint_along_the_plan(capsys, tmp_path):
    picture = tmp_path / 'plan.png'
    assert ask(capsys, ROOM, *ENDS, '--planner', 'sara_nav/LatticePlanner', '--png', picture)[0] == 0
    pixels = np.asarray(Image.open(picture))
    assert (pixels == (110, 150, 235)).all(axis=2).sum() > 500
