"""What /diagnostics says, by the names and meanings of robot_localization, as plain data.

Two statuses, once a second. "Filter diagnostic updater": OK, or WARN or ERROR with one key for each thing that is
wrong: with the configuration (X_configuration, ...: for as long as the node runs) and with the data since the last time
(imu0_timestamp, ...). To these come one line per input on what became of its messages, and what is waited for. A row of
outliers warns, however short it was; a single one is in the input's line only, for chance alone makes some.
"odometry/filtered topic status": whether the output comes at its frequency, give or take 2 Hz, over ten periods (the
rule of diagnostic_updater's FrequencyStatus).
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable

from sara_common.diagnostics import ERROR, OK, WARN, Status
from sara_localization.config.input_config import InputConfig
from sara_localization.filters.state import ANGLES, POSE, RATES, TWIST
from sara_localization.inputs.outliers import FEWEST
from sara_localization.inputs.status import InputStatus

# Kind of a problem (InputStatus.problems) -> the peer's key behind the input's name; None: one key for each part in
# use.
KEYS = {
    'no_stamp': 'timestamp',
    'before_set_pose': 'timestamp',
    'out_of_order': None,
    'bad_variance': 'covariance',
    'huge_variance': 'covariance',
    'indefinite_covariance': 'covariance',
    'bad_orientation': 'orientation',
    'no_transform': 'transform',
}
FREQUENCY_MARGIN = 2.0
TOLERANCE = 0.1
WINDOW = 10

SUMMARY = {
    OK: 'the filter is running',
    WARN: 'the filter is running, but data or settings are doubtful',
    ERROR: 'data or settings are wrong',
}


def parts(config: InputConfig) -> tuple[str, ...]:
    """The parts of an input's messages that are used, as keys name them; ('',) for kinds of one part."""
    if config.kind in ('pose', 'twist'):
        return ('',)
    mask = config.mask
    pose = any(mask[ANGLES]) if config.kind == 'imu' else any(mask[POSE])
    turning = any(mask[RATES]) if config.kind == 'imu' else any(mask[TWIST])
    used = [
        name
        for name, taken in (
            ('pose_', pose),
            ('twist_', turning),
            ('acceleration_', config.kind == 'imu' and any(mask[12:])),
        )
        if taken
    ]
    return tuple(used) or ('',)


def keys(config: InputConfig, kind: str) -> list[str]:
    """The keys under which a kind of problem of an input is told."""
    suffix = KEYS.get(kind, kind)
    if suffix is None:
        return [f'{config.name}_{part}timestamp' for part in parts(config)]
    return [f'{config.name}_{suffix}']


class FilterDiagnostics:
    """The first status: `settings` is a list of (level, key, sentence) that holds for as long as the node runs."""

    def __init__(self, config, settings=()):
        self._inputs = {i.name: i for i in config.inputs}
        self._settings = tuple(settings)
        self._seen = {name: Counter() for name in self._inputs}
        self._told = Counter()

    def status(
        self,
        now: float,
        statuses: Iterable[InputStatus],
        waiting: str | None,
        counters: Iterable[tuple[str, object]] = (),
    ) -> Status:
        """The state of things at `now` (s).

        statuses: the inputs' InputStatus; waiting: what keeps the filter from giving an estimate, or None; counters:
        further (key, value) pairs.
        """
        level, values = OK, []
        for setting_level, key, sentence in self._settings:
            level = max(level, setting_level)
            values.append((key, sentence))
        idle = []
        for status in statuses:
            problems = self._new_problems(status)
            if problems:
                level = max(level, WARN)
                values += problems
            if self._has_outliers(status) or not status.healthy:
                idle.append(status.line(now))
        message = SUMMARY[level]
        if idle:
            level, message = max(level, WARN), '; '.join(idle)
        if waiting:
            level, message = ERROR, 'no estimate: ' + waiting
        values += [(status.name, status.line(now)) for status in statuses]
        values += [(key, str(value)) for key, value in counters]
        return Status('Filter diagnostic updater', level, message, tuple(values))

    def _new_problems(self, status):
        """(key, sentence) of each kind of problem that an input has had since the last report."""
        found = []
        for kind, count in sorted(status.problems.items()):
            new = count - self._seen[status.name][kind]
            if new > 0:
                several = '' if new == 1 else 's'
                sentence = f'{new} message{several} since the last report: {kind.replace("_", " ")}'
                found += [(key, sentence) for key in keys(self._inputs[status.name], kind)]
        self._seen[status.name] = Counter(status.problems)
        return found

    def _has_outliers(self, status):
        """Whether a row of outliers goes on, or has begun since the last report."""
        outliers, before = status.outliers, self._told[status.name]
        self._told[status.name] = outliers.told
        return outliers.now >= FEWEST or outliers.told > before


class FrequencyDiagnostics:
    """The second status: ticks counted over the last ten reports."""

    def __init__(self, frequency: float):
        self.low, self.high = frequency - FREQUENCY_MARGIN, frequency + FREQUENCY_MARGIN
        self.count = 0
        self._history = deque(maxlen=WINDOW)

    def tick(self) -> None:
        """A message was published."""
        self.count += 1

    def status(self, now: float) -> Status:
        """The rate at `now` (s) since the report ten reports ago; a clock that went back starts anew."""
        if self._history and now <= self._history[-1][0]:
            self._history.clear()
        since, before = self._history[0] if self._history else (now, self.count)
        self._history.append((now, self.count))
        window, events = now - since, self.count - before
        rate = events / window if window > 0.0 else 0.0
        level, message = OK, 'Desired frequency met'
        if window <= 0.0:
            message = 'Just started'
        elif events == 0:
            level, message = ERROR, 'No events recorded.'
        elif rate < self.low * (1.0 - TOLERANCE):
            level, message = WARN, 'Frequency too low.'
        elif rate > self.high * (1.0 + TOLERANCE):
            level, message = WARN, 'Frequency too high.'
        values = (
            ('Events in window', str(events)),
            ('Events since startup', str(self.count)),
            ('Duration of window (s)', f'{window:.3f}'),
            ('Actual frequency (Hz)', f'{rate:.3f}'),
            ('Minimum acceptable frequency (Hz)', f'{self.low * (1.0 - TOLERANCE):g}'),
            ('Maximum acceptable frequency (Hz)', f'{self.high * (1.0 + TOLERANCE):g}'),
        )
        return Status('odometry/filtered topic status', level, message, values)
