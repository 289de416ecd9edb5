"""What the filter does, line by line into a file: robot_localization's `debug` and `debug_out_file`.

    tick 1432235499.031 s
      took odom0_twist of 1432235498.998: vx 0.502 (0.03), z 0 (0.001), ...; 0.7 sigma
      left imu0_pose of 1432235499.002, rejected by the gate: yaw 3.02 (0.1); 12.4 sigma
      state of 1432235499.002: x 0.101 (0.01) y -0.002 (0.01) ...

In brackets the standard deviations; sigma: the Mahalanobis distance.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from sara_localization.config.filter_config import FilterConfig
from sara_localization.filters.estimator import Estimator
from sara_localization.filters.state import NAMES, SIZE


def opened(config: FilterConfig, report: Callable[[str], None]) -> Trace | None:
    """The Trace of a configuration, or None: it is not asked for, or its file cannot be written (report is called with
    why).
    """
    if not config.debug:
        return None
    try:
        return Trace(open(config.debug_out_file, 'w', encoding='utf-8'))
    except OSError as error:
        report(f'debug_out_file cannot be written: {error}')
        return None


class Trace:
    """file: what to write to; every tick is flushed."""

    def __init__(self, file):
        self._file, self._lines = file, []

    def measurement(self, m: Any, taken: bool, nis: float) -> None:
        """A raw_measurement.Measurement was taken in or not, at the squared Mahalanobis distance nis."""
        values = zip(m.indices, m.z.tolist(), m.R.diagonal().tolist())
        self._lines.append(
            '  {} {} of {:.3f}{}: {}; {:.3g} sigma'.format(
                'took' if taken else 'left',
                m.source,
                m.stamp,
                '' if taken else ', rejected by the gate',
                ', '.join(_number(i, value, variance) for i, value, variance in values),
                math.sqrt(max(nis, 0.0)),
            )
        )

    def tick(self, now: float, kf: Estimator) -> None:
        """The end of a tick at now (s), with the filter as it is then."""
        variances = kf.P.diagonal()[:SIZE].tolist()
        state = ' '.join(map(_number, range(SIZE), kf.x[:SIZE].tolist(), variances)) if kf.initialised else 'none yet'
        self._lines.append(f'  state of {kf.last_measurement_time:.3f}: {state}')
        self._file.write('\n'.join([f'tick {now:.3f} s', *self._lines, '']))
        self._file.flush()
        self._lines.clear()


def _number(i, value, variance):
    return f'{NAMES[i]} {value:.6g} ({math.sqrt(max(variance, 0.0)):.2g})'
