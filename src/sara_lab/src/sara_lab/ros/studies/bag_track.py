"""A recorded drive as a judge.Track: from a bag of `sara.launch record:=true`, or of any move_base.

Read are the true pose where the bag has it (/ground_truth, the simulator's) and else the fused one
(/odometry/filtered), the goals and their ends (move_base's action topics; RViz's goals pass there too), plans
(/move_base/PLANNER/plan), the navigation's commands, what the safety gate makes of them and says, and the simulator's
count of contacts. What is not finite or goes
back in time is left out and counted.
"""

import argparse
import json
import math
import re
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import rosbag
from actionlib_msgs.msg import GoalStatus

from sara_common.planar import yaw_of
from sara_lab.journeys.ideal_times import default_profile, with_ideal
from sara_lab.judge.judge import Goal, Track, judge
from sara_lab.judge.recorded_split import recorded_steps
from sara_lab.judge.time_split import split

TRUE, FUSED, GOALS, RESULTS = '/ground_truth', '/odometry/filtered', '/move_base/goal', '/move_base/result'
COMMANDS, DIAGNOSTICS = '/cmd_vel/navigation', '/diagnostics'
PASSED, SAID = '/diff_drive_controller/cmd_vel', '/safety_gate/status'  # of the safety gate
PLAN = re.compile(r'^/?move_base/[^/]+/plan$')
HELD_S = 0.3  # a command is good for so long
SETTLED_S = 1.0  # after a goal's end its corner is judged


class BagError(Exception):
    """A bag that holds no drive; the text says what is missing."""


class _Poses:
    """Poses of a topic in the order of their stamps."""

    def __init__(self, topic, dropped):
        self.topic, self.dropped, self.t, self.rows = topic, dropped, [], []

    def add_message(self, message, _received):
        """Take an Odometry."""
        pose = message.pose.pose
        row = pose.position.x, pose.position.y, yaw_of(pose.orientation)
        t = message.header.stamp.to_sec()
        if not all(map(math.isfinite, row)):
            self.dropped[f'{self.topic}: not finite'] += 1
        elif self.t and t <= self.t[-1]:
            self.dropped[f'{self.topic}: not later than the one before'] += 1
        else:
            self.t.append(t)
            self.rows.append(row)


def _stamp(stamp, received):
    """s of a stamp; of its reception where it is not set."""
    return stamp.to_sec() if stamp.to_nsec() else received.to_sec()


def _time_of(stamp, received, first, last):
    """When a goal was given or ended (s): its stamp where that is among the poses' times `first` to `last`, else its
    reception, for a client may stamp by another clock (the wall clock beside /clock); None where neither is.
    """
    times = (_stamp(stamp, received), received.to_sec())
    return next((time for time in times if first - 1.0 <= time <= last + 1.0), None)


class _Drive:
    """What of a bag's messages belongs to a drive. `topics`: {name of a duty (true, fused, goals, results, commands):
    topic}; `dropped`: a Counter of what is left out.
    """

    def __init__(self, topics, dropped):
        self.poses = {topics[name]: _Poses(topics[name], dropped) for name in ('true', 'fused')}
        self.given, self.ended, self.plans, self.commanded, self.contacts = {}, {}, [], [], []
        self.passed, self.said = [], []
        self._takers = {
            topics['goals']: self._goal,
            topics['results']: self._result,
            topics['commands']: self._command,
            PASSED: self._pass,
            SAID: self._say,
            DIAGNOSTICS: self._diagnostics,
            **{topic: poses.add_message for topic, poses in self.poses.items()},
        }

    def wants(self, topic):
        """Whether messages of a topic are to be read."""
        return topic in self._takers or bool(PLAN.match(topic))

    def add(self, topic, message, received):
        """Take a message of a topic that is wanted."""
        self._takers.get(topic, self._plan)(message, received)

    def _goal(self, message, received):
        self.given[message.goal_id.id] = (message.goal_id.stamp, received, message.goal.target_pose.pose)

    def _result(self, message, received):
        reached = message.status.status == GoalStatus.SUCCEEDED
        self.ended[message.status.goal_id.id] = (message.header.stamp, received, reached, message.status.text)

    def _command(self, message, received):
        self.commanded.append((received.to_sec(), message.linear.x, message.angular.z))

    def _pass(self, message, received):
        self.passed.append((received.to_sec(), message.linear.x, message.angular.z))

    def _say(self, message, received):
        self.said.append((received.to_sec(), message.data))

    def _diagnostics(self, message, _received):
        self.contacts += [
            int(value.value)
            for status in message.status
            for value in status.values
            if value.key == 'contacts' and value.value.isdigit()
        ]

    def _plan(self, message, received):
        if len(message.poses) > 1:
            poses = [(p.pose.position.x, p.pose.position.y, yaw_of(p.pose.orientation)) for p in message.poses]
            self.plans.append((_stamp(message.header.stamp, received), np.array(poses)))


def read_track(
    path: Path | str,
    true: str = TRUE,
    fused: str = FUSED,
    goals: str = GOALS,
    results: str = RESULTS,
    commands: str = COMMANDS,
) -> tuple[Track, Counter]:
    """(Track, Counter of what was left out) of a bag; the arguments are names of topics. Raises BagError, and rosbag's
    own errors.
    """
    dropped = Counter()
    drive = _Drive(dict(true=true, fused=fused, goals=goals, results=results, commands=commands), dropped)
    with rosbag.Bag(str(path)) as bag:
        wanted = [topic for topic in bag.get_type_and_topic_info().topics if drive.wants(topic)]
        for topic, message, received in bag.read_messages(topics=wanted):
            drive.add(topic, message, received)
    source = 'true' if len(drive.poses[true].t) > 1 else 'fused'
    chosen = drive.poses[true if source == 'true' else fused]
    if len(chosen.t) < 2:
        raise BagError(f'{path} holds no drive: neither {true} nor {fused} has two poses or more')
    t, pose = np.array(chosen.t), np.array(chosen.rows)
    found = tuple(_goals(drive.given, drive.ended, t, dropped))
    if drive.ended and not found:
        raise BagError(
            f'{path} has {len(drive.ended)} goals that ended, and poses from {t[0]:.0f} to {t[-1]:.0f} s, but none of '
            'the goals at that time, neither by its stamps nor by when it was received'
        )
    track = Track(
        t,
        pose,
        source,
        found,
        tuple(drive.plans),
        _held(drive.commanded, t) if drive.commanded else None,
        drive.contacts[-1] - drive.contacts[0] if drive.contacts and source == 'true' else None,
    )
    if found and drive.commanded and drive.passed:
        steps = recorded_steps(track, drive.commanded, drive.passed, drive.said)
        track = replace(track, split=split(steps, default_profile()))
    return track, dropped


def _goals(given, ended, t, dropped):
    """Each goal that ended while there were poses, in the order in which they were given. `given`: {id: (stamp,
    reception, pose)}; `ended`: {id: (stamp, reception, reached, text)}.
    """
    since = {name: _time_of(stamp, received, t[0], t[-1]) for name, (stamp, received, _) in given.items()}
    times = [time for time in since.values() if time is not None]
    for name in sorted(given, key=lambda name: (since[name] is None, since[name])):
        wanted = given[name][2]
        if name not in ended:
            dropped['goals that had not ended when the bag was closed'] += 1
            continue
        stamp, received, reached, text = ended[name]
        end = _time_of(stamp, received, t[0], t[-1])
        if since[name] is None or end is None:
            dropped['goals at times without poses'] += 1
        elif end < since[name]:
            dropped['goals that ended before they were given, by their stamps'] += 1
        else:
            next_given = min((other for other in times if other > since[name]), default=math.inf)
            judged = max(end, min(end + SETTLED_S, next_given, t[-1]))
            place = wanted.position.x, wanted.position.y, yaw_of(wanted.orientation)
            yield Goal(place, since[name], end, reached, text, judged)


def _held(commanded, t):
    """(n, 2) the command that held at each time, NaN where none did."""
    at, values = np.array([entry[0] for entry in commanded]), np.array([entry[1:] for entry in commanded])
    row = np.searchsorted(at, t, 'right') - 1
    held = np.where((row >= 0)[:, None], values[np.maximum(row, 0)], math.nan)
    held[(row < 0) | (t - at[np.maximum(row, 0)] > HELD_S)] = math.nan
    return held


def main(words: list[str] | None = None) -> None:
    """`judge BAG`: the judge's table of a recorded drive; exit status 1 where it holds none."""
    parser = argparse.ArgumentParser(prog='judge', description=main.__doc__)
    parser.add_argument('bag')
    parser.add_argument('--map', help='YAML of the map, for the gap to what stands on it')
    parser.add_argument(
        '--ideal', action='store_true', help='with --map: the ideal time too, some seconds for each goal'
    )
    parser.add_argument('--json', action='store_true', help='JSON on stdout instead of the table')
    options = parser.parse_args(words)
    try:
        track, dropped = read_track(options.bag)
        world = None
        if options.map:
            from sara_sim.world.world import World

            world = World.from_yaml(options.map)
            track = with_ideal(track, options.map) if options.ideal else track
    except (BagError, OSError, rosbag.ROSBagException, ValueError) as error:
        sys.exit(f'judge: {error}')
    for what, count in dropped.items():
        print(f'left out: {count} of {what}', file=sys.stderr)
    found = judge(track, world)
    print(json.dumps(found.to_json()) if options.json else found.table())
