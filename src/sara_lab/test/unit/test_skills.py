"""Skills: their worlds are fair, points are given as the criteria say, and a drive says what happened."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest

from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.paths import share
from sara_common.platforms import chosen
from sara_control.gate.comfort import Profile
from sara_lab.campaign import skills as part
from sara_lab.judge import gaps
from sara_lab.judge.body_space import BodySpace
from sara_lab.judge.contact_watch import Contact
from sara_lab.judge.motion import Motion
from sara_lab.rides.skills import draw_skills, trial
from sara_lab.rides.skills.items import skills
from sara_lab.rides.skills.score import of_goals, of_push, unsafe
from sara_lab.rides.skills.skill import Criteria, Push
from sara_lab.rides.skills.trial import begin, drive, person
from sara_nav.maps import map_io
from sara_sim.riders.impairments import Tremor
from sara_sim.world.obstacles import Body

GOAL = 2.0, 0.0, 0.0
DT = 0.02


def ahead(v=0.5, length=2.0, turn=0.0):
    """The Motion of a drive from (0, 0, 0) at v (m/s) for so many m, turned by `turn` (rad) evenly on the way."""
    t = np.arange(0.0, abs(length / v), DT)
    share = t / t[-1]
    pose = np.column_stack([math.copysign(length, v) * share, 0.0 * t, turn * share])
    return Motion.of(t, pose)


@pytest.mark.parametrize('name', skills())
def test_the_body_fits_and_has_a_way_to_each_goal(name):
    skill = skills()[name]
    geometry = skill.grid.geometry
    origin = geometry.origin_x, geometry.origin_y
    world = skill.world(0)
    assert all(gaps.at(world, begin(name, seed), chosen().size) > 0.1 for seed in range(20))
    space = BodySpace(skill.grid.data != map_io.FREE, geometry.resolution, origin, chosen().size, 0.05)
    ends = (skill.start, *skill.goals)
    assert all(space.connected(a, b) for a, b in zip(ends, ends[1:]))
    assert bool(skill.goals) != bool(skill.push) and bool(skill.moves) == bool(skill.goals)


def test_the_page_says_what_points_are_given_for():
    page = (share('sara_lab').parents[1] / 'docs' / 'skills.md').read_text().split('## Points')[1].split('\n## ')[0]
    assert [line for line in page.splitlines() if line.startswith('| ')][1:] == [
        f'| {name} | {skill.item} | {skill.two()} |' for name, skill in skills().items()
    ]


def test_starts_differ_by_chair_and_are_drawn_again_the_same():
    assert begin('bed', 1) != begin('bed', 2) and begin('bed', 1) == begin('bed', 1)


def test_right_is_left_mirrored():
    left, right = skills()['turn_forwards_left'], skills()['turn_forwards_right']
    assert right.goals[0][2] == -left.goals[0][2]
    assert (right.mirrored().grid.data == left.grid.data).all()
    assert np.allclose(right.mirrored().goals, left.goals)


@pytest.mark.parametrize(
    'criteria, motion, seconds, points, why',
    [
        (Criteria(), ahead(), 4.0, 2, ''),
        (Criteria(), ahead(length=1.5), 4.0, 1, '0.50 m and 0 deg off'),
        (Criteria(), ahead(length=1.3), 4.0, 0, 'not come to'),
        (Criteria(), ahead(turn=math.radians(20.0)), 4.0, 1, '20 deg off'),
        (Criteria(), ahead(turn=math.radians(60.0)), 4.0, 0, '60 deg off'),
        (Criteria(seconds=3.0), ahead(), 4.0, 1, '4 s'),
        (Criteria(seconds=1.0), ahead(), 4.0, 0, '4 s'),
        (Criteria(box=(-1.0, -0.5, 3.0, 0.5)), ahead(), 4.0, 2, ''),
        (Criteria(box=(-1.0, -0.5, 2.0, 0.5)), ahead(), 4.0, 1, '0.54 m beyond'),
        (Criteria(astern=0.8), ahead(), 4.0, 1, '0% of the way astern'),
        (Criteria(turning=0.5), ahead(turn=0.1), 4.0, 2, ''),
        (Criteria(turning=0.5), ahead(v=0.03, turn=0.1), 4.0, 1, '0% of the turning'),
    ],
)
def test_points_of_goals(criteria, motion, seconds, points, why):
    score = of_goals(motion, (GOAL,), seconds, criteria)
    assert score.points == points and why in ' '.join(score.why) and bool(score.why) == (points < 2)


def test_goals_are_passed_in_their_order():
    goals = (1.0, 0.0, 0.0), GOAL
    assert of_goals(ahead(), goals, 4.0, Criteria()).points == 2
    assert of_goals(ahead(), (GOAL, goals[0]), 4.0, Criteria()).points == 0


def test_points_of_stops():
    def score(thing):
        still = np.vstack([ahead().pose, np.repeat(ahead().pose[-1:], 50, 0)])
        return of_push(Motion.of(np.arange(len(still)) * DT, still), Push(1.0, 0.0, thing, 0.4))

    assert score((2.8, -1.0, 3.0, 1.0)) == (2, (), ())
    assert score((3.2, -1.0, 3.4, 1.0)).points == 1
    assert of_push(ahead(), Push(1.0, 0.0, (2.8, -1.0, 3.0, 1.0), 0.4)).points == 0


@pytest.mark.parametrize(
    'motion, contacts, tilt, what',
    [
        (ahead(), (), 0.0, ''),
        (ahead(v=1.0), (), 0.0, 'm/s ahead'),
        (ahead(v=-0.6), (), 0.0, 'm/s astern'),
        (ahead(turn=4.0), (), 0.0, 'rad/s'),
        (ahead(), (Contact(1.0, 'the map', 0.1),), 0.0, 'contact: the map'),
        (ahead(), (Contact(1.0, 'person', 0.01, True),), 0.0, ''),
        (ahead(), (), math.radians(9.0), 'tilted by 9.0 deg'),
    ],
)
def test_what_is_unsafe_is_named(motion, contacts, tilt, what):
    found = unsafe(motion, Profile(), contacts, tilt)
    assert bool(found) == bool(what) and what in ' '.join(found)


def test_a_drive_by_goals_is_scored():
    made = drive('backwards_2m', 'goals', 3)
    assert (made.points, made.why, made.faults, made.contacts) == (2, (), (), ())
    assert made.judgement.gap_min > 0.3 and json.dumps(made.to_json())


def test_a_trembling_hand_turns_in_place():
    assert isinstance(person(skills()['lift'], 'shared', 0), Tremor)
    made = drive('turn_in_place', 'shared', 0)
    assert made.points == 2 and made.seconds < 20.0


def test_a_skill_that_goes_wrong_has_no_points_and_says_why(monkeypatch):
    monkeypatch.setattr(trial, 'prepare', lambda lockstep, _way: rides_free(lockstep))
    monkeypatch.setattr(trial, 'SHARES', (1.0,))
    monkeypatch.setattr(trial, 'PUSH_S', 8.0)
    made = drive('stop_ahead', 'hand', 0)
    assert made.points == 0 and 'contact: parked' in made.faults[0]
    results = [{**made.to_json(), 'skill': name, 'way': way} for name in skills() for way in trial.WAYS]
    lines, figures = part._summary(results)
    assert figures['all_goals']['points'] == 0 and figures['all_goals']['unsafe'] == len(skills())
    assert len(part._verdict(figures)) == 2 and 'contact' in lines[-1]


def rides_free(lockstep):
    """Without a safety gate."""
    from sara_lab.rides.ride import prepare

    return prepare(lockstep, 'free')


def test_an_unknown_way_is_refused():
    with pytest.raises(ValueError, match='way is'):
        drive('bed', 'sail', 0)


def test_a_film_keeps_the_last_drive():
    film = draw_skills.Film()
    chair = SimpleNamespace(pose=GOAL, world=SimpleNamespace(obstacles=SimpleNamespace(shapes=np.empty((0, 6)))))
    for t in (0.1, 0.2, 0.1):
        film(SimpleNamespace(time=t, tick=round(t * 100), chair=chair))
    assert [moment.t for moment in film.moments] == [0.1]


def test_somebody_crosses_as_the_chair_comes_and_stays_there():
    skill = skills()['moving_obstacle']
    world = skill.world(1)
    first, second = (walker.pose for walker in world.obstacles.all)

    def stand(x, since, until):
        for k in range(since, until):
            world.obstacles.step(0.01 * k, Body(x, 2.5, 0.0, 0.54, 0.29, 0.0, 0.0))

    stand(1.2, 0, 100)
    assert first(1.0)[1] < 0.6 and second(1.0)[1] > 4.4
    stand(2.5, 100, 900)
    assert first(9.0)[1] > 4.0 and second(9.0)[1] > 4.4
    stand(6.0, 900, 1700)
    assert first(17.0)[1] > 4.0 and second(17.0)[1] < 1.0


def test_slopes_are_felt_and_a_world_alone_is_no_map():
    skill = skills()['up_5deg']
    world, on_slope = skill.world(0), (5.2, 1.0, 0.0)
    with pytest.raises(ValueError, match='a World has no map'):
        Lockstep(world, on_slope, 0)
    assert math.isclose(Lockstep(world, on_slope, 0, known=skill.grid).chair.attitude[1], -math.radians(5.0))
    across = skills()['across_5deg']
    assert math.isclose(Lockstep(across.world(0), on_slope, 0, known=across.grid).chair.attitude[0], math.radians(5.0))
