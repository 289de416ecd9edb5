"""A way that the map calls free and that is not: the whole stack looks for another, asks for help, goes on when
somebody helps, ends in words.
"""

import math
from itertools import pairwise

from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.paths import share
from sara_common.planar import Pose2D
from sara_common.platforms import chosen
from sara_nav.goals.move_base_config import ABORTED, SUCCEEDED
from sara_sim.world.obstacles import Obstacle

CORRIDOR, BEHIND_THE_DOOR = (
    (6.0, 4.9, math.pi),
    (3.0, 7.4, 0.5 * math.pi),
)  # of the flat, whose room up there has one door of 0.80 m
LATTICE = {'base_global_planner': 'sara_nav/LatticePlanner', 'ask_for_help': {'patience': 5.0}}
TROUBLES = {'sara': 1, 'kate': 2}  # places where it cannot get on, before such a door
APART = 1.0  # m: recovery_memory, from which on a recovery is another place's
IN_THE_DOOR = Obstacle('box', size=(0.6, 0.3), at=(3.0, 5.75))
GRID = {**LATTICE, 'base_global_planner': 'sara_nav/GridPlanner'}  # says sooner that there is no way


def drive(name, start, goal, obstacles, seconds, watch=lambda lockstep: None, navigation=LATTICE):
    """Drive from start to goal, poses (x, y, yaw), until it ends; returns (Lockstep, what was asked of people, names of
    the recoveries).
    """
    lockstep = Lockstep(share() / 'maps' / f'{name}.yaml', start, 1, localization='fake', navigation=navigation)
    for obstacle in obstacles:
        lockstep.chair.world.obstacles.add(obstacle)
    lockstep.start_up()
    lockstep.move_base.set_goal(Pose2D(*goal), lockstep.time)
    end, asked, recoveries, newest = lockstep.time + seconds, [], [], None
    while lockstep.result is None and lockstep.time < end:
        lockstep.step()
        if lockstep.newest is not newest:
            newest = lockstep.newest
            asked += [newest.help] if newest.help and newest.help not in asked else []
            recoveries += [newest.recovery[2]] if newest.recovery else []
        watch(lockstep)
    assert lockstep.result is not None, 'it goes on for ever'
    return lockstep, asked, recoveries


def test_a_box_in_the_way_is_driven_round_without_recovery():
    lockstep, asked, recoveries = drive(
        'hall', (1.0, 4.0, 0.0), (6.0, 4.0, 0.0), [Obstacle('box', size=(0.5, 0.4), at=(3.6, 4.1), yaw=0.4)], 90.0
    )
    assert lockstep.result.status == SUCCEEDED and lockstep.chair.contacts == 0
    assert not asked and not recoveries
    assert math.dist(lockstep.chair.pose[:2], (6.0, 4.0)) < 0.1


def test_a_box_in_the_only_door_ends_the_goal_in_words_after_help_was_asked_for():
    places = {}

    def see(lockstep):
        if lockstep.newest is not None and lockstep.newest.help:
            places.setdefault(lockstep.newest.help, lockstep.chair.pose[:2])

    lockstep, asked, recoveries = drive('flat', CORRIDOR, BEHIND_THE_DOOR, [IN_THE_DOOR], 300.0, see)
    assert lockstep.result.status == ABORTED and lockstep.chair.contacts == 0
    assert asked and all(text.startswith('Help, please: I cannot get on to (3.00, 7.40).') for text in asked)
    assert len(asked) == recoveries.count('ask_for_help') == TROUBLES[chosen().name]
    assert all(math.dist(a, b) > APART for a, b in pairwise(places.values())), 'once at each place'
    assert recoveries[-1] == 'back_out_and_forget'
    assert 'Even after executing recovery behaviors' in lockstep.result.text
    before = lockstep.chair.pose
    for _ in range(300):
        lockstep.step()
    assert math.dist(before[:2], lockstep.chair.pose[:2]) < 0.01, 'it stands'


def test_when_somebody_takes_the_box_away_it_drives_on_by_itself():
    def help_comes(lockstep):
        if lockstep.newest is not None and lockstep.newest.help and lockstep.chair.world.obstacles.all:
            lockstep.chair.world.obstacles.remove('box')

    shipped = {'base_global_planner': LATTICE['base_global_planner']}  # it waits as long as what was seen is remembered
    lockstep, asked, _ = drive('flat', CORRIDOR, BEHIND_THE_DOOR, [IN_THE_DOOR], 300.0, help_comes, shipped)
    assert asked and lockstep.result.status == SUCCEEDED and lockstep.chair.contacts == 0
    assert math.dist(lockstep.chair.pose[:2], BEHIND_THE_DOOR[:2]) < 0.1


def test_shut_in_from_before_and_behind_it_touches_nothing_and_ends_in_words():
    """The corridor is closed ahead; while the chair looks for a way, somebody closes it behind the chair, too."""
    ahead = Obstacle('ahead', size=(0.3, 2.2), at=(4.0, 4.9))
    behind = Obstacle('behind', size=(0.3, 2.2), at=(7.0, 4.9), appears=18.0)
    lockstep, asked, recoveries = drive('flat', CORRIDOR, (1.5, 4.9, math.pi), [ahead, behind], 300.0, navigation=GRID)
    assert lockstep.result.status == ABORTED and lockstep.chair.contacts == 0 and asked
    assert 'back_out' in recoveries
    half = 0.5 * chosen().body.length
    assert 4.15 + half < lockstep.chair.pose[0] < 6.85 - half


def test_the_same_drive_twice_is_the_same():
    """Recovery and watching the plan hold nothing back from one drive to the next."""
    ends = []
    for _ in range(2):
        lockstep = Lockstep(share() / 'maps' / 'hall.yaml', (1.0, 4.0, 0.0), 2, localization='fake', navigation=LATTICE)
        lockstep.chair.world.obstacles.add(Obstacle('box', size=(0.5, 0.4), at=(3.6, 4.1), yaw=0.4))
        lockstep.start_up()
        lockstep.move_base.set_goal(Pose2D(6.0, 4.0, 0.0), lockstep.time)
        for _ in range(1000):
            lockstep.step()
        ends.append(lockstep.chair.pose)
    assert ends[0] == ends[1]
