"""What a judgement is made of and what it says: a drive as a Track with its Goals, and the figures of a Judgement."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from sara_lab.judge.time_split import SPLIT_NAMES

DECIMALS = 9  # of what is printed


@dataclass(frozen=True)
class Goal:
    """A goal: the `pose` asked for (x, y, yaw; m, rad), when it was `given` and `ended` (s), whether it was `reached`,
    and what the planner said.

    `judged`: s, when the chair's pose is compared with it, for instance a second after the end; None: at the end.
    `straight`: (x, y) where a straight leg to it begins, None where its path is no straight leg. `shortest`: m, the
    shortest path there that the body has, `ideal`: s, the ideal time there (sara_lab.ideal); None: not known.
    """

    pose: tuple[float, float, float]
    given: float
    ended: float
    reached: bool
    text: str = ''
    judged: float | None = None
    straight: tuple[float, float] | None = None
    shortest: float | None = None
    ideal: float | None = None


@dataclass(frozen=True)
class Meetings:
    """What came of meetings with those who walk about. `false_stops`: how often the safety gate slowed or held the
    chair for a pedestrian where none walks, `yields`: where one does. `nearest`: m, the least gap between body and
    pedestrian, NaN where nobody came near. `pressed`: m/s at most at which the body moved towards one nearer than
    0.30 m whom a sensor could hear.
    """

    false_stops: int = 0
    yields: int = 0
    nearest: float = math.nan
    pressed: float = 0.0


@dataclass(frozen=True)
class Track:
    """A drive as it happened. `t`: (n,) s, growing. `pose`: (n, 3) x, y, yaw in the map frame, m, rad. `source`: whose
    pose it is, true or fused. `goals`: tuple of Goal, in order. `plans`: ((t, (k, 3) plan), ...), each good from t on.
    `commanded`: (n, 2) v, w of the navigation, NaN where nothing was commanded, or None. `contacts`: how many; None:
    not known. `split`: s with a goal by time_split.KINDS, or None. `meetings`: Meetings, or None.
    """

    t: np.ndarray
    pose: np.ndarray
    source: str = 'true'
    goals: tuple[Goal, ...] = ()
    plans: tuple[tuple[float, np.ndarray], ...] = ()
    commanded: np.ndarray | None = None
    contacts: int | None = None
    split: dict[str, float] | None = None
    meetings: Meetings | None = None

    def __post_init__(self) -> None:
        faults = []
        if self.t.ndim != 1 or self.pose.shape != (len(self.t), 3):
            faults.append(f't is {self.t.shape} and pose {self.pose.shape}, allowed are (n,) and (n, 3)')
        elif len(self.t) < 2 or not (
            np.isfinite(self.t).all() and (np.diff(self.t) > 0.0).all() and np.isfinite(self.pose).all()
        ):
            faults.append('a track needs two poses or more, all finite, at growing times')
        elif self.commanded is not None and self.commanded.shape != (len(self.t), 2):
            faults.append(f'commanded is {self.commanded.shape}, allowed is (n, 2)')
        if self.source not in ('true', 'fused'):
            faults.append(f"source is {self.source!r}, allowed are 'true' and 'fused'")
        if faults:
            raise ValueError('; '.join(faults))


@dataclass(frozen=True)
class Turn:
    """A turn in place: when it began (s), how far the chair turned in all, and the shortest turn it needed; deg."""

    t: float
    turned: float
    shortest: float

    @property
    def beyond(self) -> float:
        """Degrees beyond the shortest."""
        return self.turned - self.shortest


@dataclass(frozen=True)
class Corner:
    """Where a goal ended: distance (m) and yaw (deg, + to the left) off what was asked."""

    position: float
    yaw: float
    reached: bool
    text: str


@dataclass(frozen=True)
class Judgement:
    """A drive in figures. Not a number: not asked, or not known.

    `seconds`: with a goal. `length`: m driven. `shortest`: m, of the goals whose shortest way is known; `detour`:
    length driven for those over it.
    `gap_min`, `gap_p5`: m between body and what stands about, `gaps.REACH` at most. `cross_track_p95`,
    `cross_track_max`: m off the straight legs, while it drives.
    `off_plan_p95`: m off the newest plan, while it drives. `reversals`: changes of the turn's side, `reversals_per_m`
    of way; `commanded_reversals_per_m`: the same in the commands. `turns`: those in place. `last_metre`: s, of each
    goal reached: from 1 m before its end until it ended, final turn included; `last_way`: the same until the last
    centimetre was driven. `acceleration_*`, `jerk_*`: r.m.s. while it moves, m/s2, m/s3. `discomfort`: s, of the
    module's formula. `ideal`: s, ideal time of the goals whose is known; `time_ratio`: time taken for those over it.
    `split`: where the time went, s by time_split.KINDS. `meetings`: Meetings, or None.
    """

    source: str
    seconds: float
    length: float
    shortest: float
    detour: float
    gap_min: float
    gap_p5: float
    cross_track_p95: float
    cross_track_max: float
    off_plan_p95: float
    reversals: int
    reversals_per_m: float
    commanded_reversals_per_m: float
    turns: tuple[Turn, ...]
    last_metre: tuple[float, ...]
    last_way: tuple[float, ...]
    acceleration_rms: float
    acceleration_tangential_rms: float
    acceleration_normal_rms: float
    jerk_tangential_rms: float
    jerk_normal_rms: float
    discomfort: float
    contacts: int | None
    corners: tuple[Corner, ...] = ()
    ideal: float = math.nan
    time_ratio: float = math.nan
    split: dict[str, float] | None = None
    meetings: Meetings | None = None

    @property
    def beyond_shortest(self) -> float:
        """Degrees beyond the shortest of the worst turn in place; NaN without one."""
        return max((turn.beyond for turn in self.turns), default=math.nan)

    def to_json(self) -> dict[str, Any]:
        """All as plain data; None for what is not known. Numbers have nine decimals: the last bits of a sum depend on
        where in memory its terms lie, and differ from process to process.
        """

        def plain(value):
            if isinstance(value, float):
                return None if math.isnan(value) else round(value, DECIMALS)
            if isinstance(value, dict):
                return {key: plain(entry) for key, entry in value.items()}
            return [plain(entry) for entry in value] if isinstance(value, (list, tuple)) else value

        return {**plain(asdict(self)), 'beyond_shortest_deg': plain(self.beyond_shortest)}

    def table(self) -> str:
        """All as text, a line for each figure."""
        return table([('', self)])


ROWS = (
    ('pose', '', lambda j: j.source),
    ('time', 's', lambda j: j.seconds),
    ('way driven', 'm', lambda j: j.length),
    ('shortest way', 'm', lambda j: j.shortest),
    ('driven / shortest', '', lambda j: j.detour),
    ('gap, smallest', 'm', lambda j: j.gap_min),
    ('gap, p5', 'm', lambda j: j.gap_p5),
    ('cross-track, p95', 'm', lambda j: j.cross_track_p95),
    ('cross-track, max', 'm', lambda j: j.cross_track_max),
    ('off the plan, p95', 'm', lambda j: j.off_plan_p95),
    ('reversals', '1/m', lambda j: j.reversals_per_m),
    ('reversals of commands', '1/m', lambda j: j.commanded_reversals_per_m),
    ('turns in place', '', lambda j: len(j.turns)),
    ('worst turn beyond', 'deg', lambda j: j.beyond_shortest),
    ('last metre, longest', 's', lambda j: max(j.last_way, default=math.nan)),
    ('  with its final turn', 's', lambda j: max(j.last_metre, default=math.nan)),
    ('acceleration r.m.s.', 'm/s2', lambda j: j.acceleration_rms),
    ('  tangential', 'm/s2', lambda j: j.acceleration_tangential_rms),
    ('  normal', 'm/s2', lambda j: j.acceleration_normal_rms),
    ('jerk r.m.s., tangential', 'm/s3', lambda j: j.jerk_tangential_rms),
    ('  normal', 'm/s3', lambda j: j.jerk_normal_rms),
    ('discomfort', 's', lambda j: j.discomfort),
    ('contacts', '', lambda j: j.contacts),
    ('corners reached', '', lambda j: f'{sum(corner.reached for corner in j.corners)}/{len(j.corners)}'),
    ('corner off, worst', 'm', lambda j: max((corner.position for corner in j.corners), default=math.nan)),
    ('', 'deg', lambda j: max((abs(corner.yaw) for corner in j.corners), default=math.nan)),
)

MORE_ROWS = (
    ('ideal time', 's', lambda j: j.ideal),
    ('time / ideal time', '', lambda j: j.time_ratio),
    *((f'  {name}', 's', lambda j, kind=kind: (j.split or {}).get(kind)) for kind, name in SPLIT_NAMES.items()),
    ('pedestrians: false stops', '', lambda j: j.meetings and j.meetings.false_stops),
    ('  yields', '', lambda j: j.meetings and j.meetings.yields),
    ('  nearest', 'm', lambda j: j.meetings and j.meetings.nearest),
)  # shown where any drive has them


def table(columns: Sequence[tuple[str, Judgement]]) -> str:
    """Judgements side by side as text: `columns` is [(name, Judgement)]."""

    def shown(value):
        if value is None or isinstance(value, float) and math.isnan(value):
            return '-'
        return f'{value:.3f}' if isinstance(value, float) else str(value)

    width = max([12] + [len(name) + 2 for name, _ in columns])
    lines = [' ' * 30 + ''.join(f'{name:>{width}}' for name, _ in columns)] if any(name for name, _ in columns) else []
    return '\n'.join(
        lines
        + [
            f'{name:24} {unit:5}' + ''.join(f'{shown(value(j)):>{width}}' for _, j in columns)
            for name, unit, value in ROWS
            + tuple(row for row in MORE_ROWS if any(shown(row[2](j)) != '-' for _, j in columns))
        ]
    )
