"""range_localization without ROS: while nobody knows where the robot is its place is searched for, then it is corrected
by planes and edges. While its pose is probably wrong, it is given out all the same, and the place is searched for
beside.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Future

from sara_localization.particles.global_search import Echo, GlobalSearch, Places
from sara_localization.particles.range_lost import RangeLost
from sara_localization.ranges.range_config import RangeConfig
from sara_localization.ranges.range_correction import RangeCorrection
from sara_localization.ranges.range_data import RangeData, RangeMap
from sara_localization.ranges.turn_scale import TurnScale

SAME_CONE = math.radians(5.0)
"""By which the cones of sensors may differ that are heard in one search."""
AGAIN = 0.2
"""The probability that the pose is wrong at or below which a search beside ends: it fits again."""

Work = Callable[[Callable[[], None]], Places]
"""Takes a second or more, and calls what it is given every few ms meanwhile."""
Submit = Callable[[Work], 'Future[Places]']
"""Has Work done: at once, or in another thread."""


def at_once(work: Work) -> Future[Places]:
    """A Submit that waits for it."""
    future: Future[Places] = Future()
    try:
        future.set_result(work(lambda: None))
    except ValueError as error:
        future.set_exception(error)
    return future


class RangeLocalizer:
    """`correction`: the RangeCorrection; while `searching` its pose says nothing. `lost`: judges it. `search`: the
    GlobalSearch, None before the first reading of a search.
    """

    def __init__(
        self,
        config: RangeConfig,
        map_: RangeMap | None = None,
        turn_scale: TurnScale | None = None,
        submit: Submit = at_once,
    ):
        """submit: has the Places of a search beside worked out, which takes seconds on a large map."""
        self.config, self.correction = config, RangeCorrection(config, map_, turn_scale)
        self.lost, self._submit = RangeLost(self.correction), submit
        self.searching, self.search = False, None
        self._places: Places | None = None
        self._coming: Future[Places] | None = None
        self._newest: dict[str, Echo] = {}

    @property
    def lost_probability(self) -> float:
        """That the pose is wrong, 0 to 1: 1 while it is searched for."""
        return 1.0 if self.searching else self.lost.probability

    def set_map(self, map_: RangeMap) -> str:
        """A map takes the place of the one before; a search begins anew in it. Returns '' or the sentence why there can
        be no search in it, which ends.
        """
        self.correction.map = map_
        if self.searching:
            return self.start_anywhere()
        self._end()
        self.lost.start()
        return ''

    def forget(self) -> None:
        """The dead reckoning was put where the robot is, and is believed; a search ends."""
        self._end()
        self.correction.forget()
        self.lost.start()

    def start_anywhere(self, places: Places | None = None) -> str:
        """The robot may be anywhere on the map: search. places: of the map and `search_clearance`, where there are some
        of another search. Returns '' or the sentence why that cannot be.
        """
        self._end()
        if self.correction.map is None:
            return 'there is no map yet'
        try:
            self._places = places or Places(self.correction.map, self.config.search_clearance)
        except ValueError as error:
            return str(error)
        self.searching = True
        return ''

    def _end(self):
        self.searching, self.search, self._places, self._coming = False, None, None, None
        self._newest = {}

    @property
    def told(self) -> str:
        """While searching, or while the pose is probably wrong, a sentence about it; else ''."""
        if not self.searching:
            probability = self.lost.probability
            if probability < self.config.lost_limit:
                return ''
            return f'lost: the pose is wrong with a probability of {probability:.2f}{self._what_helps()}'
        search = self.search
        if search is None or search.belief is None:
            return 'not sure where the robot is: drive it about'
        if search.rival is not None:
            x, y, yaw = search.rival
            like = f'({x:.1f}, {y:.1f}, {math.degrees(yaw):.0f} deg) fits about as well as the best place'
            return f'not sure where the robot is: {like}; drive on'
        return f'not sure where the robot is: places that fit: {search.belief.clusters}; drive it about'

    def _what_helps(self):
        if self._coming is None:
            return ''
        fault = self._coming.exception() if self._coming.done() else None
        return f'; it cannot be searched for: {fault}' if fault else '; drive it about, or tell it where it is'

    def on_pose(self, stamp: float, pose: tuple[float, float, float]) -> None:
        """See RangeCorrection. Where the dead reckoning jumps, a search begins anew; and one begins where its frame was
        found by a search, for then nobody has put it there. What was heard before says nothing of the pose then.
        """
        what = self.correction.on_pose(stamp, pose)
        if what and self.searching or what == 'jumped' and not self.correction.laid:
            self.start_anywhere()
        elif what:
            self._end()
            self.lost.start()

    def on_range(self, reading: RangeData) -> str:
        """Take a reading; returns what became of it, as RangeCorrection's; while searching 'searched', or 'found' for
        the one that made the place known.
        """
        if self.searching:
            what = self._take(reading)
            self.correction.counts[what] += 1
            return what
        what = self.correction.on_range(reading)
        self.lost.on_range(reading)
        return 'found' if self._finds_again(reading) else what

    def _finds_again(self, reading):
        """Whether the pose was wrong, and the place is found with this reading."""
        if self._coming is None:
            if not self.config.lost_recovery or self.lost.probability < self.config.lost_limit:
                return False
            c, map_ = self.config, self.correction.map
            cone = reading.field_of_view, min(c.range_max_range, reading.most)
            self._coming = self._submit(lambda pause: Places.prepared(map_, c.search_clearance, *cone, pause))
        if self.lost.probability <= AGAIN:
            self._end()
            return False
        if not self._coming.done() or self._coming.exception() is not None:  # a map without room
            return False
        self._places = self._coming.result()
        found = self._take(reading) == 'found'
        if found:
            self.correction.counts['found'] += 1
        return found

    def _take(self, r):
        correction, c = self.correction, self.config
        fault = correction.fault(r)
        if fault:
            return fault
        here = correction.at(r.stamp - c.range_delay)
        now = correction.dead_reckoned
        if here is None or now is None:
            return 'waiting' if correction.is_young(r.stamp - c.range_delay) else 'no_pose'
        if -math.inf < r.range < 0.0:
            return 'out_of_span'
        if self.search is None:
            limit = min(c.range_max_range, r.most)
            self.search = GlobalSearch(c, correction.map, self._places, r.field_of_view, limit)
        search = self.search
        if abs(r.field_of_view - search.field_of_view) > SAME_CONE or r.most < search.limit:
            return 'other_sensor'
        self._newest[r.name] = Echo.of(here, r)
        if not search.is_due(now):
            return 'searched'
        found, self._newest = search.step(now, list(self._newest.values())), {}
        if found is None:
            return 'searched'
        self._end()
        correction.start_at(found.pose, found.covariance)
        self.lost.start()
        return 'found'
