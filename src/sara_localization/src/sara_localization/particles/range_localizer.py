"""range_localization without ROS: while nobody knows where the robot is its place is searched for, then it is corrected
by planes.
"""

from __future__ import annotations

import math

from sara_localization.particles.global_search import Echo, GlobalSearch, Places
from sara_localization.ranges.range_config import RangeConfig
from sara_localization.ranges.range_correction import RangeCorrection
from sara_localization.ranges.range_data import RangeData, RangeMap
from sara_localization.ranges.turn_scale import TurnScale

SAME_CONE = math.radians(5.0)
"""By which the cones of sensors may differ that are heard in one search."""


class RangeLocalizer:
    """`correction`: the RangeCorrection; while `searching` its pose says nothing. `search`: the GlobalSearch, None
    before the first reading of a search.
    """

    def __init__(self, config: RangeConfig, map_: RangeMap | None = None, turn_scale: TurnScale | None = None):
        self.config, self.correction = config, RangeCorrection(config, map_, turn_scale)
        self.searching, self.search = False, None
        self._places: Places | None = None
        self._newest: dict[str, Echo] = {}

    def set_map(self, map_: RangeMap) -> str:
        """A map takes the place of the one before; a search begins anew in it. Returns '' or the sentence why there can
        be no search in it, which ends.
        """
        self.correction.map = map_
        return self.start_anywhere() if self.searching else ''

    def forget(self) -> None:
        """The dead reckoning was put where the robot is, and is believed; a search ends."""
        self._end()
        self.correction.forget()

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
        self.searching, self.search, self._places = False, None, None
        self._newest = {}

    @property
    def told(self) -> str:
        """While searching a sentence about it; else ''."""
        if not self.searching:
            return ''
        search = self.search
        if search is None or search.belief is None:
            return 'not sure where the robot is: drive it about'
        if search.rival is not None:
            x, y, yaw = search.rival
            like = f'({x:.1f}, {y:.1f}, {math.degrees(yaw):.0f} deg) fits about as well as the best place'
            return f'not sure where the robot is: {like}; drive on'
        return f'not sure where the robot is: places that fit: {search.belief.clusters}; drive it about'

    def on_pose(self, stamp: float, pose: tuple[float, float, float]) -> None:
        """See RangeCorrection. Where the dead reckoning jumps, a search begins anew; and one begins where its frame was
        found by a search, for then nobody has put it there.
        """
        what = self.correction.on_pose(stamp, pose)
        if what and self.searching or what == 'jumped' and not self.correction.laid:
            self.start_anywhere()

    def on_range(self, reading: RangeData) -> str:
        """Take a reading; returns what became of it, as RangeCorrection's; while searching 'searched', or 'found' for
        the one that made the place known.
        """
        if not self.searching:
            return self.correction.on_range(reading)
        what = self._take(reading)
        self.correction.counts[what] += 1
        return what

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
        return 'found'
