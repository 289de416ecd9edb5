"""How the chair is driven: some fixed cases of each part of the campaign that judges it, and that the parts' verdicts
find what is wrong.
"""

import copy
import json
import math

import pytest

from sara_bringup.paths import share
from sara_common.platforms import chosen
from sara_lab.campaign import calm as campaign_calm
from sara_lab.campaign import squares, travels
from sara_lab.journeys import doors, travel
from sara_lab.judge import gaps
from sara_lab.judge.contact_watch import Contact
from sara_sim.world.world import World

BODY = chosen().size
SEEDS = 1
JOURNEYS = (
    ('true', 'school', 4),
    ('true', 'flat', 7),
    ('true', 'hall', 3),
    ('fused', 'flat', 5),
    ('boxes', 'hall', 8),
    ('people', 'school', 2),
    ('people', 'flat', 0),
    ('expected', 'hall', 1),
)
APPROACHES = (4, 10, 15)


@pytest.fixture(scope='module')
def square_results(tmp_path_factory):
    part = squares.squares(SEEDS, tmp_path_factory.mktemp('gains'))
    return part, [json.loads(json.dumps(work())) for work in part.cases.values()]


def test_squares_both_ways_by_the_true_and_by_the_fused_pose(square_results):
    part, results = square_results
    assert len(results) == 4 * SEEDS and [result['faults'] for result in results] == [[]] * len(results)
    lines, figures = part.summary(results)
    assert part.verdict(figures) == []
    assert len(lines) == len(figures) and figures['true_contacts'] == figures['fused_contacts'] == 0


def test_the_squares_verdict_finds_each_fault(square_results):
    part, results = square_results
    worse = copy.deepcopy(results)
    for result in worse:
        for corner in result['judgement']['corners']:
            corner.update(position=0.11, yaw=-2.1)
        result['across_m'] = [0.06] * 20
        result['judgement'].update(
            beyond_shortest_deg=3.1, reversals_per_m=1.1, last_metre=[15.1], acceleration_rms=0.32
        )
    faults = ' '.join(part.verdict(part.summary(worse)[1]))
    for words in (
        'true pose: corner_position_m',
        'true pose: corner_yaw_deg',
        'true pose: cross_track_m',
        'fused pose: corner_position_m',
        'fused pose: cross_track_m',
        '3.10 deg beyond',
        'reversals_per_m',
        'last_metre_and_turn_s',
        'acceleration_rms',
    ):
        assert words in faults


@pytest.mark.parametrize('mode, name, number', JOURNEYS)
def test_a_journey_is_reached_without_a_contact_that_the_chair_made(mode, name, number):
    outcome = travel.drive(name, mode, number)
    assert outcome.faults == [] and (outcome.reached or mode in travel.AMONG_PEOPLE and outcome.text), outcome.text
    found = outcome.judgement
    assert found.length > 0.9 * math.dist(outcome.start[:2], outcome.goal[:2]) or not outcome.reached
    assert json.loads(json.dumps(outcome.to_json()))['judgement']['contacts'] == len(outcome.contacts)
    assert mode in travel.AMONG_PEOPLE or (found.gap_min > 0.0 and found.contacts == 0)
    assert sum(found.split.values()) == pytest.approx(found.seconds)


@pytest.mark.parametrize('number', APPROACHES)
def test_a_door_of_0_80_m_is_crossed(number):
    crossing = doors.cross(number)
    assert (
        crossing.faults == [] and crossing.judgement.gap_min <= 0.5 * (0.80 - BODY[1]) + 0.01
    )  # it went through the door
    assert math.copysign(1.0, crossing.start[0] - doors.DOOR[0]) == -math.copysign(
        1.0, crossing.goal[0] - doors.DOOR[0]
    )


def test_approaches_come_from_all_angles_and_begin_and_end_free():
    world = World.from_yaml(share() / 'maps' / 'doorway.yaml')
    bearings = []
    for start, goal in map(doors.approach, range(doors.APPROACHES)):
        assert gaps.at(world, start, BODY) > 0.15 and gaps.at(world, goal, BODY) > 0.15
        bearings.append(math.degrees(math.atan2(start[1] - doors.DOOR[1], abs(start[0] - doors.DOOR[0]))))
    assert (
        len({round(bearing) for bearing in bearings}) == doors.APPROACHES
        and min(bearings) == pytest.approx(-70.0)
        and max(bearings) == pytest.approx(70.0)
    )


def outcome(**other):
    return travel.Outcome(
        **{
            'map': 'hall',
            'mode': 'true',
            'number': 0,
            'start': (0.0, 0.0, 0.0),
            'goal': (1.0, 0.0, 0.0),
            'way': 1.0,
            'reached': True,
            'late': False,
            'text': 'Goal reached.',
            'seconds': 5.0,
            'position_error': 0.01,
            'yaw_error_deg': 0.1,
            'recoveries': 0,
            'contacts': (),
            'judgement': None,
            **other,
        }
    )


def test_a_journey_that_runs_out_of_time_or_makes_contact_is_a_fault():
    assert outcome().faults == [] and outcome(reached=False, text='blocked').faults == []
    assert 'ended in words' in outcome(reached=False, late=True).faults[0]
    assert outcome(contacts=(Contact(3.0, 'person 1', 0.01, True),)).faults == []
    for contact in (Contact(3.0, 'person 1', 0.06, True), Contact(3.0, 'box 1', 0.0), Contact(3.0, 'the map', 0.2)):
        assert 'contact' in outcome(contacts=(contact,)).faults[0]
    assert outcome(position_error=math.nan).to_json()['position_error'] is None


def test_the_travel_verdict_counts_shares_of_each_mode():
    part = travels.travel(50, None)
    assert len(part.cases) == 900
    calm = {
        'gap_min': 0.1,
        'detour': 1.1,
        'length': 3.0,
        'seconds': 9.0,
        'discomfort': 10.0,
        'reversals_per_m': 0.3,
        'last_metre': [19.0],
        'last_way': [9.0],
        'acceleration_rms': 0.1,
    }

    def results(missed, **judgement):
        return [
            {
                **outcome(
                    map=name, mode=mode, number=number, way=11.0 if number % 2 else 5.0, reached=number >= missed
                ).to_json(),
                'judgement': {**calm, **judgement},
            }
            for mode in travel.MODES
            for name in ('school', 'flat', 'hall')
            for number in range(50)
        ]

    assert part.verdict(part.summary(results(1))[1]) == []  # 3 of 150, 3 of 75 short ones
    assert [fault.split(':')[0] for fault in part.verdict(part.summary(results(2))[1])] == ['true']
    assert [fault.split(':')[0] for fault in part.verdict(part.summary(results(6))[1])] == list(travels.REACHED)
    assert (
        len(part.verdict(part.summary(results(0, reversals_per_m=1.2, last_way=[16.0], acceleration_rms=0.4))[1])) == 3
    )
    meetings = {'false_stops': 0, 'yields': 2, 'nearest': 0.2, 'pressed': 0.31}
    assert [fault.split(':')[0] for fault in part.verdict(part.summary(results(0, meetings=meetings))[1])] == [
        'pedestrians'
    ]
    assert 'not reached: hall people 0 (5.0 m): ' in '\n'.join(part.summary(results(1))[0])


def test_the_calm_verdict_asks_for_the_least_discomfort():
    part = campaign_calm.calm(0, None)
    assert len(part.cases) == 3 * (2 * campaign_calm.CALM_SEEDS + 30)

    def results(**discomfort):
        return [
            {
                'planner': planner,
                'map': 'hall',
                'number': number,
                'reached': number > 0 or planner == 'default',
                'faults': [],
                'judgement': {
                    'discomfort': discomfort.get(planner, 12.0),
                    'length': 3.0,
                    'seconds': 9.0,
                    'jerk_tangential_rms': 0.1,
                    'jerk_normal_rms': 0.1,
                    'reversals_per_m': 0.3,
                    'last_metre': [9.0],
                    'acceleration_rms': 0.1,
                    'beyond_shortest_deg': None,
                },
            }
            for planner in campaign_calm.PLANNERS
            for number in range(4)
        ]

    lines, figures = part.summary(results(default=11.0))
    assert (
        figures['reached_by_all'] == 3
        and figures['default']['discomfort'] == 33.0
        and part.verdict(figures) == []
        and len(lines) == 5
    )
    assert len(part.verdict(part.summary(results(default=12.5))[1])) == 2
