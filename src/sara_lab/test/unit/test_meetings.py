"""Journeys among pedestrians: who walks there, and the figures of how it went."""

import math

import numpy as np
import pytest

from sara_bringup.paths import share
from sara_lab.campaign.meetings import longer_than_alone, meeting_faults, meeting_figures
from sara_lab.journeys import crowd, travel_cases
from sara_sim.pedestrians import course
from sara_sim.pedestrians.pedestrian import Pedestrian
from sara_sim.pedestrians.routes import Routes
from sara_sim.world.obstacles import Body
from sara_sim.world.world import World


def test_the_simulators_example_has_its_people_walk_in_the_flat():
    world = World.from_yaml(travel_cases.map_file('flat'))
    course.load(share('sara_sim') / 'config' / 'people.yaml').put_on(world)
    pedestrians = [thing for thing in world.obstacles.all if isinstance(thing, Pedestrian)]
    away = Body(-50.0, -50.0, 0.0, 0.54, 0.29, 0.0, 0.0)
    for k in range(1, 1501):
        world.obstacles.step(0.01 * k, away)
    assert len(pedestrians) == 2
    assert all(math.dist(one.pose(15.0)[:2], one.config.places[0]) > 2.0 for one in pedestrians)


@pytest.mark.parametrize('name', ('flat', 'school', 'hall'))
def test_a_crowd_is_the_same_every_time_and_begins_off_the_chair(name):
    people, again = crowd.crowd(name, 7), crowd.crowd(name, 7)
    assert [somebody.config for somebody in people] == [somebody.config for somebody in again]
    assert len(people) == crowd.CROWD[name] and len({somebody.config.seed for somebody in people}) == len(people)
    start, routes = travel_cases.pairs(name)[7].start, Routes(World.from_yaml(travel_cases.map_file(name)))
    for somebody in people:
        places = somebody.config.places
        assert math.dist(places[0], start[:2]) >= travel_cases.PERSON_AWAY and len(places) == travel_cases.STROLL
        assert all(routes.left(routes.to(place), *places[0]) < math.inf for place in places)


def test_so_many_are_distracted_and_so_many_stop_for_nobody(monkeypatch):
    monkeypatch.setattr(crowd, '_places', lambda *_: ((1.0, 1.0), (2.0, 1.0)))
    monkeypatch.setattr(crowd, 'Pedestrian', lambda config, *_: config)
    people = [somebody for name in crowd.CROWD for number in range(50) for somebody in crowd.crowd(name, number)]
    notices = np.array([config.notices for config in people])
    assert abs(np.mean(notices == crowd.NOTICES) - crowd.DISTRACTED) < 0.05
    assert abs(np.mean(notices == 0.0) - crowd.BLIND) < 0.025 and len(set(notices)) == 3


def journey(number, seconds, reached=True, **meetings):
    known = {'false_stops': 0, 'yields': 0, 'nearest': None, 'pressed': 0.0, **meetings}
    return {
        'map': 'flat',
        'number': number,
        'seconds': seconds,
        'reached': reached,
        'judgement': {'meetings': known} if reached else None,
    }


def test_the_figures_of_meetings():
    figures = meeting_figures([journey(0, 9.0, yields=2, nearest=0.4), journey(1, 9.0, pressed=0.4), journey(2, 9.0)])
    assert figures == {'yields': 2, 'nearest_m': 0.4, 'pressed': 0.4, 'pressed_too_fast': 1}
    nobody = meeting_figures([journey(0, 9.0, reached=False)])
    assert nobody['yields'] == 0 and math.isnan(nobody['nearest_m']) and math.isnan(nobody['pressed'])


def test_only_journeys_that_arrive_both_ways_are_compared():
    alone = [journey(0, 10.0), journey(1, 10.0), journey(2, 10.0, reached=False)]
    among = [journey(0, 20.0), journey(1, 99.0, reached=False), journey(2, 50.0), journey(3, 50.0)]
    assert longer_than_alone(among, alone) == 2.0 and math.isnan(longer_than_alone([], alone))


def test_what_is_too_much_is_named():
    well = {'to_blame': 0, 'longer_than_alone': 1.4, 'pressed_too_fast': 0}
    assert meeting_faults(well) == []
    for much in ({'to_blame': 1}, {'longer_than_alone': 1.41}, {'pressed_too_fast': 1}):
        assert len(meeting_faults({**well, **much})) == 1
