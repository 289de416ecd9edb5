"""The judge: how well a drive was driven, in figures; one module for lockstep and bag, tests, campaign and reports
alike.

A Track is what happened: poses over time, the goals that were given and how each ended. `judge` makes a Judgement of
it: time, way, gap to what stands about, weaving, turns, the ending, comfort, contacts, corner errors. Speeds,
accelerations and jerks are derivatives of the pose (motion.py), which no planner and no estimate has a say in.

Discomfort is that of Gulati and Kuipers (S. Gulati, "A framework for characterization and planning of safe,
comfortable, and customizable motion of assistive mobile robots", PhD thesis, Univ. of Texas at Austin, 2011;
arXiv:1305.5024): T + w_t int(tangential jerk^2) dt + w_n int(normal jerk^2) dt. They weigh the terms by a
characteristic motion; ours is a leg of the thesis's square, 4 m from rest to rest at 0.5 m/s within the rider's
standard profile (0.4 m/s2, 0.8 m/s3; sara_control's safety.yaml): it takes 9.75 s, its jerk squared amounts to 1.28
m2/s5, and w = 9.75 / 1.28 s6/m2 makes the two as bad as each other there.
"""

import math
from dataclasses import asdict, dataclass, field

import numpy as np

from sara_common.planar import wrap
from sara_lab.judge import gaps
from sara_lab.judge.motion import Motion, reversals

BODY = (1.08, 0.58)  # m, length and width of the chair
DECIMALS = 9  # of what is printed
WEIGHTS = (1.0, 9.75 / 1.28, 9.75 / 1.28)  # of a second (-), of tangential and of normal jerk squared (s6/m2)
TURNING = 0.05  # rad/s: a rate from which on the heading goes to one side
STANDING = 0.05  # m/s: slower than this is no driving: standing, or turning in place
SMALLEST_TURN_DEG = 5.0  # what a turn in place amounts to at least
LAST_M = 1.0  # m before the end of the way: the last metre
GAP_STEP_S = 0.04  # between two looks at the gap


@dataclass(frozen=True)
class Goal:
    """A goal: `pose` asked for (x, y, yaw; m, rad), when it was `given` and `ended` (s), whether it was `reached`, and
    the planner's word.

    `judged`: s, when the chair's place is compared with it, a second after the end, say; None: at the end. `straight`:
    (x, y) where a straight leg to it begins, None where its way is none. `shortest`: m, the shortest way there that the
    body has; None: not known.
    """

    pose: tuple
    given: float
    ended: float
    reached: bool
    text: str = ''
    judged: float = None
    straight: tuple = None
    shortest: float = None


@dataclass(frozen=True)
class Track:
    """A drive as it happened. `t`: (n,) s, growing. `pose`: (n, 3) x, y, yaw in the map frame, m, rad. `source`: whose
    pose it is, true or fused. `goals`: tuple of Goal, in order. `plans`: ((t, (k, 3) plan), ...), each good from t on.
    `commanded`: (n, 2) v, w of the navigation, NaN where nothing was commanded, or None. `contacts`: how many; None:
    not known.
    """

    t: np.ndarray
    pose: np.ndarray
    source: str = 'true'
    goals: tuple = ()
    plans: tuple = ()
    commanded: np.ndarray = None
    contacts: int = None

    def __post_init__(self):
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
    def beyond(self):
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
    goal reached: from 1 m of way left until it ended, final turn included; `last_way`: the same until the last
    centimetre was driven. `acceleration_*`, `jerk_*`: r.m.s. while it moves, m/s2, m/s3. `discomfort`: s, of the
    module's formula.
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
    turns: tuple
    last_metre: tuple
    last_way: tuple
    acceleration_rms: float
    acceleration_tangential_rms: float
    acceleration_normal_rms: float
    jerk_tangential_rms: float
    jerk_normal_rms: float
    discomfort: float
    contacts: int
    corners: tuple = field(default_factory=tuple)

    @property
    def beyond_shortest(self):
        """Degrees beyond the shortest of the worst turn in place; NaN without one."""
        return max((turn.beyond for turn in self.turns), default=math.nan)

    def to_json(self):
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

    def table(self):
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


def table(columns):
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
        ]
    )


def judge(track, world=None, body=BODY, weights=WEIGHTS):
    """The Judgement of a Track. `world`: sara_sim.world.world.World, for the gap: what is occupied, and the obstacles
    where they were at each time; None: no gap.
    `body`: length, width, m. `weights`: of time, tangential and normal jerk squared in the discomfort.
    """
    motion = Motion.of(track.t, track.pose)
    t, goals = motion.t, track.goals or (Goal(tuple(track.pose[-1]), track.t[0], track.t[-1], True),)
    under_way = np.zeros(len(t), bool)
    for goal in goals:
        under_way |= (t >= goal.given) & (t <= goal.ended)
    driving, moving = under_way & (np.abs(motion.v) > STANDING), under_way & motion.moving
    length, seconds = motion.way(under_way), float(sum(goal.ended - goal.given for goal in goals))
    known = [goal for goal in goals if goal.shortest is not None]
    shortest = float(sum(goal.shortest for goal in known)) if known else math.nan
    for_known = sum(motion.way((t >= goal.given) & (t <= goal.ended)) for goal in known)
    gap = (
        gaps.along(world, t[under_way], motion.pose[under_way], body, GAP_STEP_S)
        if world is not None and under_way.any()
        else np.empty(0)
    )
    across = np.concatenate([_across(motion, goal, driving) for goal in goals])
    changes = reversals(motion.w[under_way], TURNING)
    squares = [
        float(np.sum(np.where(under_way, part**2, 0.0)) * motion.dt)
        for part in (motion.jerk_tangential, motion.jerk_normal)
    ]
    commanded = math.nan
    if track.commanded is not None and length > 0.0:
        rates = track.commanded[:, 1]
        commanded = reversals(rates[np.isfinite(rates)], TURNING) / length
    endings = [_ending(motion, goal) for goal in goals if goal.reached]
    return Judgement(
        track.source,
        seconds,
        length,
        shortest,
        for_known / shortest if shortest > 0.0 else math.nan,
        *((float(gap.min()), float(np.percentile(gap, 5))) if len(gap) else (math.nan, math.nan)),
        _percentile(across, 95),
        _percentile(across, 100),
        _percentile(_off_plan(track, motion, driving), 95),
        changes,
        changes / length if length > 0.0 else math.nan,
        commanded,
        tuple(turn for goal in goals for turn in _turns(motion, goal)),
        tuple(ending[0] for ending in endings if ending),
        tuple(ending[1] for ending in endings if ending),
        *(
            _rms(part[moving])
            for part in (
                np.hypot(motion.acceleration_tangential, motion.acceleration_normal),
                motion.acceleration_tangential,
                motion.acceleration_normal,
                motion.jerk_tangential,
                motion.jerk_normal,
            )
        ),
        weights[0] * seconds + weights[1] * squares[0] + weights[2] * squares[1],
        track.contacts,
        tuple(_corner(track, goal) for goal in track.goals),
    )


def cross_track(track):
    """(m,) distances (m) of all poses from the straight leg they belong to, while the chair drives; for percentiles
    over several drives.
    """
    motion = Motion.of(track.t, track.pose)
    return np.concatenate([np.empty(0)] + [_across(motion, goal, np.abs(motion.v) > STANDING) for goal in track.goals])


def _across(motion, goal, driving):
    """The same for one goal."""
    if goal.straight is None:
        return np.empty(0)
    on = driving & (motion.t >= goal.given) & (motion.t <= goal.ended)
    x, y = goal.pose[0] - goal.straight[0], goal.pose[1] - goal.straight[1]
    off = motion.pose[on, :2] - goal.straight
    return np.abs(x * off[:, 1] - y * off[:, 0]) / math.hypot(x, y)


def _off_plan(track, motion, driving):
    """Distances (m) from the newest plan, while the chair drives."""
    found = [np.empty(0)]
    for k, (since, plan) in enumerate(track.plans):
        until = track.plans[k + 1][0] if k + 1 < len(track.plans) else math.inf
        on = driving & (motion.t >= since) & (motion.t < until)
        if on.any() and len(plan):
            found.append(gaps.from_line(motion.pose[on, :2], np.ascontiguousarray(plan[:, :2], float)))
    return np.concatenate(found)


def _turns(motion, goal):
    """The turns in place on the way to a goal: what is turned between two stretches of driving."""
    inside = (motion.t >= goal.given) & (motion.t <= (goal.ended if goal.judged is None else goal.judged))
    standing = np.concatenate([[False], inside & (np.abs(motion.v) < STANDING), [False]])
    first, last = np.flatnonzero(~standing[:-1] & standing[1:]), np.flatnonzero(standing[:-1] & ~standing[1:]) - 1
    yaw = motion.yaw
    for a, b in zip(first, last):
        turned, net = math.degrees(np.abs(np.diff(yaw[a : b + 1])).sum()), math.degrees(abs(wrap(yaw[b] - yaw[a])))
        if turned >= SMALLEST_TURN_DEG:
            yield Turn(float(motion.t[a]), turned, net)


def _ending(motion, goal):
    """(s from LAST_M left to the goal's end, s from there to the last centimetre); None where the drive was shorter."""
    on = np.flatnonzero((motion.t >= goal.given) & (motion.t <= goal.ended))
    if len(on) < 2:
        return None
    left = motion.driven[on[-1]] - motion.driven[on]
    if left[0] < LAST_M:
        return None
    t = motion.t[on]
    begun, there = t[left <= LAST_M][0], t[left <= 0.01][0]
    return float(goal.ended - begun), float(there - begun)


def _corner(track, goal):
    row = min(
        int(np.searchsorted(track.t, (goal.ended if goal.judged is None else goal.judged) - 1e-9)), len(track.t) - 1
    )
    x, y, yaw = track.pose[row]
    return Corner(math.dist((x, y), goal.pose[:2]), math.degrees(wrap(yaw - goal.pose[2])), goal.reached, goal.text)


def _percentile(values, share):
    return float(np.percentile(values, share)) if len(values) else math.nan


def _rms(values):
    return float(np.sqrt(np.mean(values**2))) if len(values) else math.nan
