"""A recorded drive as a judge.Track: from a bag of `sara.launch record:=true`, or of any move_base.

Read are the true pose where the bag has it (/ground_truth, the simulator's) and else the fused one
(/odometry/filtered), the goals and their ends (move_base's action topics; RViz's goals pass there too), plans
(/move_base/PLANNER/plan), the navigation's commands, and the simulator's count of contacts. What is not finite or goes
back in time is left out and counted.
"""

import argparse
import json
import math
import re
import sys
from collections import Counter

import numpy as np
import rosbag
from actionlib_msgs.msg import GoalStatus

from sara_common.planar import yaw_of
from sara_lab.judge.judge import Goal, Track, judge

TRUE, FUSED, GOALS, RESULTS = '/ground_truth', '/odometry/filtered', '/move_base/goal', '/move_base/result'
COMMANDS, DIAGNOSTICS = '/cmd_vel/navigation', '/diagnostics'
PLAN = re.compile(r'^/?move_base/[^/]+/plan$')
HELD_S = 0.3  # a command is good for so long
SETTLED_S = 1.0  # after a goal's end its corner is judged


class BagError(Exception):
    """A bag that holds no drive; the text says what is missing."""


class _Poses:
    """Poses of a topic in the order of their stamps."""

    def __init__(self, topic, dropped):
        self.topic, self.dropped, self.t, self.rows = topic, dropped, [], []

    def add(self, message):
        """An Odometry."""
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


def read_track(path, true=TRUE, fused=FUSED, goals=GOALS, results=RESULTS, commands=COMMANDS):
    """(Track, Counter of what was left out) of a bag; the arguments are names of topics. Raises BagError, and rosbag's
    own errors.
    """
    dropped = Counter()
    poses = {name: _Poses(name, dropped) for name in (true, fused)}
    given, ended, plans, commanded, contacts = {}, {}, [], [], []
    with rosbag.Bag(str(path)) as bag:
        kinds = {topic: info.msg_type for topic, info in bag.get_type_and_topic_info().topics.items()}
        wanted = [
            topic
            for topic in kinds
            if topic in (true, fused, goals, results, commands, DIAGNOSTICS) or PLAN.match(topic)
        ]
        for topic, message, received in bag.read_messages(topics=wanted):
            if topic in poses:
                poses[topic].add(message)
            elif topic == goals:
                given[message.goal_id.id] = (message.goal_id.stamp, received, message.goal.target_pose.pose)
            elif topic == results:
                ended[message.status.goal_id.id] = (
                    message.header.stamp,
                    received,
                    message.status.status == GoalStatus.SUCCEEDED,
                    message.status.text,
                )
            elif topic == commands:
                commanded.append((received.to_sec(), message.linear.x, message.angular.z))
            elif topic == DIAGNOSTICS:
                contacts += [
                    int(value.value)
                    for status in message.status
                    for value in status.values
                    if value.key == 'contacts' and value.value.isdigit()
                ]
            elif len(message.poses) > 1:
                plans.append(
                    (
                        _stamp(message.header.stamp, received),
                        np.array(
                            [(p.pose.position.x, p.pose.position.y, yaw_of(p.pose.orientation)) for p in message.poses]
                        ),
                    )
                )
    source = 'true' if len(poses[true].t) > 1 else 'fused'
    chosen = poses[true if source == 'true' else fused]
    if len(chosen.t) < 2:
        raise BagError(f'{path} holds no drive: neither {true} nor {fused} has two poses or more')
    t, pose = np.array(chosen.t), np.array(chosen.rows)
    found = tuple(_goals(given, ended, t, dropped))
    if ended and not found:
        raise BagError(
            f'{path} has {len(ended)} goals that ended, and poses from {t[0]:.0f} to {t[-1]:.0f} s, but none '
            'of the goals '
            'at that time, neither by its stamps nor by when it was received'
        )
    return Track(
        t,
        pose,
        source,
        found,
        tuple(plans),
        _held(commanded, t) if commanded else None,
        contacts[-1] - contacts[0] if contacts and source == 'true' else None,
    ), dropped


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


def main(words=None):
    """`judge BAG`: the judge's table of a recorded drive; exit status 1 where it holds none."""
    parser = argparse.ArgumentParser(prog='judge', description=main.__doc__)
    parser.add_argument('bag')
    parser.add_argument('--map', help='YAML of the map, for the gap to what stands on it')
    parser.add_argument('--json', action='store_true', help='JSON on stdout instead of the table')
    options = parser.parse_args(words)
    try:
        track, dropped = read_track(options.bag)
        world = None
        if options.map:
            from sara_sim.world.world import World

            world = World.from_yaml(options.map)
    except (BagError, OSError, rosbag.ROSBagException, ValueError) as error:
        sys.exit(f'judge: {error}')
    for what, count in dropped.items():
        print(f'left out: {count} of {what}', file=sys.stderr)
    found = judge(track, world)
    print(json.dumps(found.to_json()) if options.json else found.table())
