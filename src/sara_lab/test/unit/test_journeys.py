"""Journeys: each planner comes to its goal on each map without a contact; draws are sound; faults are named."""

import dataclasses
import math

import numpy as np
import pytest
from scipy import ndimage

from sara_bringup.lockstep.lockstep import Lockstep, merged
from sara_common.platforms import chosen, parameters
from sara_lab.campaign.travels import travel_row
from sara_lab.journeys import journeys
from sara_lab.journeys.journeys import Outcome
from sara_lab.journeys.travel_cases import map_file
from sara_lab.journeys.worlds.trial import PLANNERS
from sara_nav.config.parameters import Parameters
from sara_nav.maps import map_io
from sara_nav.move_base.settings import read_settings

CHOSEN = {'school': 4, 'flat': 3, 'hall': 0}  # through doors, and neither the longest nor the shortest


@pytest.mark.parametrize('planner', journeys.PLANNERS)
@pytest.mark.parametrize('name', journeys.MAPS)
def test_a_journey_ends_at_its_goal_without_a_contact(name, planner):
    outcome = journeys.drive(name, planner, CHOSEN[name])
    assert outcome.faults == [] and outcome.reached and outcome.contacts == 0
    assert outcome.driven > 0.8 * math.dist(outcome.start[:2], outcome.goal[:2])


@pytest.mark.parametrize('name', journeys.MAPS)
def test_starts_and_goals_are_free_and_far_apart(name):
    pairs = journeys.journeys(name)
    assert len(pairs) == len(set(pairs)) == journeys.PAIRS
    grid = map_io.load_map(str(journeys.map_file(name)))
    free = grid.geometry.resolution * ndimage.distance_transform_edt(grid.data == 0)
    for start, goal, way in pairs:
        assert way >= max(journeys.MAPS[name], math.dist(start[:2], goal[:2]) - 0.1)
        for x, y, yaw in (start, goal):
            column, row = grid.geometry.to_cell(x, y)
            assert free[row, column] > journeys.TURNING_RADIUS and abs(yaw) <= math.pi


def test_the_draw_is_the_same_every_time():
    first = journeys.journeys('flat')
    journeys.journeys.cache_clear()
    assert journeys.journeys('flat') == first and journeys.journeys('hall') != first


@pytest.mark.parametrize('planner', journeys.PLANNERS.values())
def test_the_parameter_files_are_read_without_a_warning(planner):
    settings = read_settings(Parameters(merged(parameters('sara_nav', 'sara_nav.yaml'), planner.navigation)))
    assert type(settings.local_planner).plugin_name.endswith('/' + planner.short)
    assert settings.warnings == () or all(
        f'{other}/' in text
        for text in settings.warnings
        for other in ('GridPlanner', 'RotateThenPursue')
        if other in text
    )
    assert planner.tolerances == (
        settings.local_planner.config.xy_goal_tolerance,
        settings.local_planner.config.yaw_goal_tolerance,
    )


def test_faults_are_said():
    xy, yaw = journeys.PLANNERS['DWAPlannerROS'].tolerances
    good = Outcome(
        'hall', 'DWAPlannerROS', 0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0, True, '', 5.0, 1.0, 0.0, xy, -yaw, 0
    )
    assert good.faults == []
    for change, words in (
        ({'position_error': xy + 0.01}, 'xy_goal_tolerance'),
        ({'yaw_error': -yaw - 0.01}, 'yaw_goal_tolerance'),
        ({'contacts': 2}, '2 contacts'),
        ({'reached': False, 'text': 'blocked'}, 'not reached: blocked'),
        ({'position_error': math.nan}, 'xy_goal_tolerance'),
    ):
        faults = dataclasses.replace(good, **change).faults
        assert len(faults) == 1 and words in faults[0]


def test_a_watcher_sees_every_step_and_zones_can_act():
    seen = []

    def watch(lockstep):
        seen.append(lockstep.time)
        if len(seen) == 50:
            raise StopIteration

    with pytest.raises(StopIteration):
        journeys.drive('hall', 'RotateThenPursue', 1, watch, sonars=True)
    assert np.allclose(np.diff(seen), 0.01)


def test_planners_that_are_compared_without_sonars_know_no_caution():
    how = PLANNERS['default']
    lockstep = Lockstep(map_file('hall'), (8.0, 5.0, 0.0), 1, localization='fake', navigation=how.navigation)
    how.prepare(lockstep)
    zones, sonar = lockstep.wheels.guard.zones, next(iter(chosen().sonars))
    lockstep.start_up()
    for ago in (0.2, 0.0):
        zones.caution.on_approach(sonar, 1.0, lockstep.time - ago)
    assert zones.pedestrians_nearby(lockstep.time) and zones.caution_factor(0.4, 0.0) == 1.0


def test_the_least_gap_is_of_all_journeys_reached_or_not():
    judgement = {'gap_min': 0.05, 'detour': 1.0, 'length': 5.0, 'seconds': 10.0, 'discomfort': 5.0, 'meetings': None}
    good = {'way': 5.0, 'contacts': [], 'reached': True, 'judgement': judgement}
    bad = {**good, 'reached': False, 'judgement': {**judgement, 'gap_min': 0.004}}
    assert travel_row([good, bad], False)['gap_min_m'] == 0.004
