"""Drives a robot to the frontiers of a map, one after the other, until none is left, and back to where it began.

No ROS: maps, poses and how goals end come in, orders go out. A Chooser chooses the frontier and from where it is looked
at. A frontier that is no more is left for the next one without a stop. Without a map or a pose nothing is driven to.
Whoever else gives the robot a goal, or stops it, takes over: exploring then pauses until it is resumed.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.grid import INSCRIBED
from sara_slam.exploring.choice import ByFrontiers, Choice, Chooser, Planner
from sara_slam.exploring.explore_config import ExploreConfig
from sara_slam.exploring.frontiers import Frontier, frontiers
from sara_slam.exploring.goal_ends import is_out_of_reach, is_stop
from sara_slam.exploring.limits import Limits
from sara_slam.exploring.orders import Drive, State, Stop
from sara_slam.exploring.progress import Progress

NEWS_S = 30.0
"""s that the map is waited for when no frontier is left: what the robot saw last may not be on it yet, and what bars
the way may be forgotten.
"""
RETRY_S, IN_VAIN = 5.0, 3
"""s until the next goal after one that ended for the robot's sake; such goals without one that is reached
between make it pause."""
HOME_S, HOME_TRIES = 10.0, 12
"""s between two tries of the way home, and how many there are."""
FINISH_S, MORE_S = 300.0, 30.0
"""s before it turns home for lack of time from which on what has been begun is finished; s that the way home has left
over for which it turns back to exploring.
"""
AT_HOME = 0.3
"""m from where it began that the robot need not drive."""


class Explorer:
    """`planner`: a global planner of sara_nav; `footprint`: (k, 2) m, of the robot; `say`: called with each sentence;
    `chooser`: ByFrontiers where none is given.

    `state`; `found`: the frontiers on the newest map; `visit`: the Choice under way or None; `way`: m driven.
    """

    def __init__(
        self,
        config: ExploreConfig,
        planner: Planner,
        footprint: np.ndarray,
        say: Callable[[str], None] = print,
        chooser: Chooser | None = None,
    ) -> None:
        self.config, self.say = config, say
        self._chooser = chooser or ByFrontiers(config)
        self._planner, self._footprint = planner, footprint
        if hasattr(planner, 'set_footprint'):
            planner.set_footprint(footprint)
        self.state, self.found, self.way = State.EXPLORING, [], 0.0
        self.visit: Choice | None = None
        self._costmap: Costmap | None = None
        self._home = self._pose = None
        self._began = self._limit_from = self._wait_until = self._nothing_since = None
        self._progress: Progress | None = None
        self._at = None  # s of the newest step
        self._in_vain, self._waits_for = 0, ''
        self._homeward, self._home_tries = False, 0  # whether it drives home; how often it set out for it
        self._cut_short, self._left = False, math.inf  # whether it has for lack of time; s until it has to
        self._limits = Limits(config, footprint)

    # -- what comes in -------------------------------------------------------------------------------------------

    def on_costmap(self, costmap: Costmap) -> None:
        """The newest map. Raises ValueError where it is none to choose on; the one before stays."""
        found = frontiers(costmap, self.config.min_frontier_size)
        self._chooser.on_costmap(costmap, found)
        self._costmap, self.found = costmap, found

    def resume(self) -> None:
        """Go on, or begin anew: what could not be reached before is tried again."""
        if self.state in (State.PAUSED, State.DONE):
            self._limit_from, self._cut_short = None, False
            self._chooser.forget()
            self._in_vain, self._nothing_since, self._wait_until = 0, None, None
            self.state = State.EXPLORING
            self.say('Exploring goes on.')

    def pause(self, why: str) -> Stop | None:
        """Do nothing until it is resumed; a goal under way is given up."""
        if self.state not in (State.EXPLORING, State.RETURNING):
            return None
        under_way, self.visit = self.visit is not None or self._homeward, None
        self._homeward = False
        self.state = State.PAUSED
        self.say(f'Exploring pauses: {why} Send true to explore/resume to go on.')
        return Stop() if under_way else None

    def ended(self, now: float, reached: bool, text: str) -> None:
        """The goal of the last Drive has ended at a time (s); text: move_base's words."""
        visit, self.visit = self.visit, None
        if self.state is State.RETURNING:
            self._home_again(now, reached, text)
        elif self.state is State.EXPLORING and visit is not None:
            if reached:
                self._in_vain = 0
                self._chooser.tried(visit, True)
            elif is_out_of_reach(text):
                self._chooser.tried(visit, False)
                self.say(f'A frontier at {_place(visit.frontier)} is left: {text}')
            elif is_stop(text):
                self.pause(text)
            else:
                self._failed(now, text)

    def taken_over(self, text: str = '') -> None:
        """Somebody else has cancelled the goal or given another one."""
        self.visit = None
        self.pause(f'somebody else has given the robot a goal or stopped it{text and ": "}{text}.')

    def step(self, now: float, pose: Pose2D | None, hold: str = '') -> Drive | Stop | None:
        """What to order at a time (s). pose: in the map, None where it is not known; hold: why no goal would do now, a
        sentence.
        """
        missing = self._missing(pose, hold)
        if self.state in (State.PAUSED, State.DONE) or missing:
            return self._stand(missing)
        self._waits_for = ''
        self._note(now, pose)
        if hold and self.visit is not None:  # for its end, or that the gate lets it drive again, it is waited
            self._progress = Progress(now, pose)
            return None
        if self._began is None:
            self._began, self._home = now, pose
            self.say(f'Exploring begins at ({pose.x:.2f}, {pose.y:.2f}).')
        if self._wait_until is not None and now < self._wait_until:
            return None
        self._wait_until = None
        self._limit_from = now if self._limit_from is None else self._limit_from
        self._left, limit = self._limits.left(now - self._limit_from, pose, self._home, self._chooser.ground)
        if self.state is State.RETURNING:
            return None if hold else self._more(now, pose) if self._homeward else self._go_home()
        if self._left <= 0.0:
            return self._time_is_up(now, pose, limit)
        if self._left <= FINISH_S:
            self._chooser.finish(self._home if self.config.return_by else None)
        return self._on_the_way(now, pose) if self.visit is not None else self._next(now, pose)

    # -- what comes of it ----------------------------------------------------------------------------------------

    def _missing(self, pose, hold):
        if self._costmap is None:
            return 'there is no map yet'
        if pose is None or not pose.is_finite():
            return "the robot's pose in the map is not known"
        if self._costmap.geometry.to_cell(pose.x, pose.y) is None:
            return f'the robot at ({pose.x:.2f}, {pose.y:.2f}) is off the map'
        return '' if self.visit is not None or self.state is State.RETURNING else hold

    def _stand(self, missing):
        """Nothing can be done now; a goal under way is given up. Why is told once."""
        if missing and missing != self._waits_for and self.state in (State.EXPLORING, State.RETURNING):
            self.say(f'Exploring waits: {missing}')
        self._waits_for = missing
        under_way = self.visit is not None or self._homeward and missing != ''
        self.visit = None
        if under_way and self._homeward:  # set out for again, as if it had not been
            self._homeward, self._home_tries = False, self._home_tries - 1
        return Stop() if under_way else None

    def _note(self, now, pose):
        self.way += 0.0 if self._pose is None else pose.distance(self._pose)
        self._pose = pose
        self._chooser.at(pose)
        back, self._at = 0.0 if self._at is None else self._at - now, now
        if back > 0.0:  # the clock was set
            self._progress, self._wait_until, self._nothing_since = Progress(now, pose), None, None
            self._began, self._limit_from = (at if at is None else at - back for at in (self._began, self._limit_from))

    def _on_the_way(self, now, pose):
        """The robot drives to a frontier."""
        idle = self._progress.none_for(now, pose)
        if idle > self.config.progress_timeout:
            self.say(f'A frontier at {_place(self.visit.frontier)} is left: no progress for {idle:.0f} s.')
            self._chooser.tried(self.visit, False)
            self.visit = None
            return self._next(now, pose) or Stop()
        if self._chooser.stays(self.visit):
            return None
        before = self.visit
        order = self._next(now, pose)
        if order is None:
            self.visit = before  # nothing better to do than to look from there
        return order

    def _next(self, now, pose):
        """Choose a frontier and drive there; without any, wait for news, and then go home."""
        choice = self._choice(pose)
        if choice is not None:
            self._nothing_since = None
            return self._drive(now, pose, choice)
        if self.visit is not None:
            return None
        if self._cut_short:
            return self._finish(now, pose)
        self._nothing_since = now if self._nothing_since is None else self._nothing_since
        if now - self._nothing_since < NEWS_S:
            return None
        self._nothing_since = None
        return self._next(now, pose) if self._chooser.looks_again() else self._finish(now, pose)

    def _choice(self, pose):
        if self._cut_short:
            return self._chooser.on_way_home(self._planner, self._footprint, pose, self._home, self._left)
        return self._chooser.choose(self._planner, self._footprint, pose, self.visit is not None)

    def _drive(self, now, pose, visit):
        self.visit, self._progress = visit, Progress(now, pose)
        self.say(
            f'To a frontier of {visit.frontier.size:.1f} m at {_place(visit.frontier)}; {len(self.found)} on the map.'
        )
        return Drive(visit.pose)

    def _more(self, now, pose):
        """On the way home, which may take less time than was kept for it."""
        choice = self._choice(pose) if self._cut_short and self._left >= MORE_S else None
        if choice is None:
            return None
        self.state, self._homeward = State.EXPLORING, False
        self.say(f'There are {self._left:.0f} s more than the way back takes.')
        return self._drive(now, pose, choice)

    def _time_is_up(self, now, pose, limit):
        under_way, self.visit, self._cut_short = self.visit is not None, None, True
        self.say(limit)
        return self._finish(now, pose) or (Stop() if under_way else None)

    def _finish(self, now, pose):
        """All is explored."""
        g, left = self._costmap.geometry, ', '.join(map(_place, self.found))
        area = np.count_nonzero(self._costmap.costs < INSCRIBED) * g.resolution**2
        self.say(
            f'Explored: {area:.1f} m2 are free, {self.way:.0f} m driven in {now - self._began:.0f} s. '
            + (f'Unknown stays what lies behind {left}.' if left else 'Nothing is left unknown that can be seen.')
        )
        if not self.config.return_to_init or pose.distance(self._home) < AT_HOME:
            self.state = State.DONE
            return None
        self.state, self._home_tries = State.RETURNING, 0
        self.say(f'Back to where it began, ({self._home.x:.2f}, {self._home.y:.2f}).')
        return self._go_home()

    def _go_home(self):
        self._homeward, self._home_tries = True, self._home_tries + 1
        return Drive(self._home)

    def _home_again(self, now, reached, text):
        """The way home has ended, there or before."""
        self._homeward = False
        if not reached and is_stop(text):
            self.pause(text)
        elif not reached and self._home_tries < HOME_TRIES:
            self._wait_until = now + HOME_S
            self.say(f'The way back ended: {text} It is tried again in {HOME_S:.0f} s.')
        else:
            self.state = State.DONE
            self.say('Back where it began.' if reached else f'It did not get back to where it began: {text}')

    def _failed(self, now, text):
        """A goal ended for the robot's sake, not for its own."""
        self._in_vain += 1
        self._wait_until = now + RETRY_S
        if self._in_vain == IN_VAIN:
            self.pause(f'{IN_VAIN} goals in a row were given up. {text}')
        else:
            self.say(f'The goal ended: {text} It is tried again in {RETRY_S:.0f} s.')

    def given_up(self, frontier: Frontier) -> bool:
        """Whether a frontier is not driven to any more."""
        return self._chooser.given_up(frontier)


def _place(frontier):
    return '({:.1f}, {:.1f})'.format(*frontier.middle)
