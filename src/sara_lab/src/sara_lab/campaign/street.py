"""The campaign's part `street`: chairs that drive 1 km outdoors, by GPS, compass and wheels."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sara_lab.campaign.part import Part, lines_of, mean, spread
from sara_lab.studies.consistency import interval, nees
from sara_lab.studies.street_drive import GPS, StreetDrive, kept
from sara_lab.studies.street_filter import Replay, replay
from sara_nav.planners.planning import path_length

CHAIRS = 10
P95, SHARE, REJECTED = 1.5, 0.015, 0.99
"""m, of all chairs while there are fixes; of the way in an outage, their median; of the fixes that multipath throws."""
APART = 2.0 * 2.0 * GPS.correlation_time
"""s between two moments whose errors count as independent: the estimate remembers longer than the receiver errs."""
SAID_WITHIN = 2.0
"""s from a jump's end until which the filter must have said so."""
_LAST = re.compile(r'the last (\d+\.\d) s ago')
_ROUNDED = 0.05
"""s by which the number in it is rounded."""


def street(_seeds: int, folder: Path) -> Part:
    """Ten chairs, whatever the number: each is calibrated at home by two turns and told roughly where it starts."""

    def case(seed):
        drive = kept(seed, folder)
        return judged(seed, drive, replay(drive, seed))

    return Part({f'street_{seed}': lambda seed=seed: case(seed) for seed in range(CHAIRS)}, _summary, _verdict)


def judged(seed: int, drive: StreetDrive, done: Replay) -> dict[str, Any]:
    """The figures of a drive: m, shares, NEES."""
    times = np.array([estimate.time for estimate in done.estimates])
    errors = np.array([estimate.error for estimate in done.estimates])
    off, outages = np.hypot(errors[:, 0], errors[:, 1]), drive.outages
    fixed = ~np.any([(times >= begin) & (times < end) for begin, end in outages], axis=0)
    chosen = np.searchsorted(times, np.arange(times[0] + APART, times[-1], APART))
    jumps, rows, rejections = drive.jumps, _rows(done.said), _rejections(done.reports)
    fates = dict(done.fates.tolist())
    thrown = [fates[row[0]] for row in drive.fixes if row[6] and row[0] in fates]
    good = [fates[row[0]] for row in drive.fixes if not row[6] and row[0] in fates]
    return {
        'seed': seed,
        'faults': [],
        'off': off[fixed][::5].tolist(),
        'p95': float(np.percentile(off[fixed], 95)),
        'yaw_rms_deg': float(np.degrees(np.sqrt(np.mean(errors[:, 2] ** 2)))),
        'outages': [_grown(drive, times, errors, *outage) for outage in outages if outage[1] <= times[-1]],
        'nees': [nees(done.estimates[k].error, done.estimates[k].covariance) for k in chosen],
        'thrown': len(thrown),
        'thrown_rejected': thrown.count(0.0),
        'good': len(good),
        'good_rejected': good.count(0.0),
        'jumps': len(jumps),
        'jumps_said': sum(_in_log(jump, rows) or _in_diagnostics(jump, rejections) for jump in jumps),
        'jumps_in_log': sum(_in_log(jump, rows) for jump in jumps),
    }


def _rows(said):
    """(begin, end) of each time in which the log's last word is that fixes are outliers, s."""
    found, begin = [], None
    for time, sentence in said:
        if not sentence.startswith('odom1'):
            continue
        if 'outliers are rejected' in sentence:
            begin = time
        elif begin is not None and 'taken again' in sentence:
            found.append((begin, time))
            begin = None
    return found if begin is None else [*found, (begin, math.inf)]


def _rejections(reports):
    """(time of a report, time of the fix that it calls the last rejected one), s."""
    found = ((time, _LAST.search(line)) for time, line in reports)
    return [(time, time - float(last[1])) for time, last in found if last]


def _in_log(jump, rows):
    begin, end = jump
    return any(first <= end + SAID_WITHIN and begin <= last for first, last in rows)


def _in_diagnostics(jump, rejections):
    begin, end = jump
    return any(
        time <= end + SAID_WITHIN and begin - _ROUNDED <= rejected <= end + _ROUNDED for time, rejected in rejections
    )


def _grown(drive, times, errors, begin, end):
    """By how much the error grew in an outage, as a share of the way."""
    first, last = np.searchsorted(times, (begin, end))
    way = path_length(drive.truth[(drive.truth[:, 0] >= begin) & (drive.truth[:, 0] <= end), 1:3])
    return float(np.hypot(*(errors[last - 1, :2] - errors[first, :2]))) / way


def _summary(results: Sequence[dict]) -> tuple[list[str], dict[str, Any]]:
    scores = [score for result in results for score in result['nees']]
    low, high = interval(3, len(scores))
    thrown, jumps = (sum(result[name] for result in results) for name in ('thrown', 'jumps'))
    good = sum(result['good'] for result in results)
    figures = {
        'off_m': spread([value for result in results for value in result['off']]),
        'p95_of_a_chair_m': spread([result['p95'] for result in results]),
        'yaw_rms_deg': spread([result['yaw_rms_deg'] for result in results]),
        'outage_share': spread([share for result in results for share in result['outages']]),
        'outages': sum(len(result['outages']) for result in results),
        'nees': mean(scores),
        'nees_low': low,
        'nees_high': high,
        'nees_samples': len(scores),
        'thrown_fixes': thrown,
        'thrown_rejected': sum(result['thrown_rejected'] for result in results) / thrown if thrown else math.nan,
        'jumps': jumps,
        'jumps_said': sum(result['jumps_said'] for result in results) / jumps if jumps else math.nan,
        'jumps_in_log': sum(result['jumps_in_log'] for result in results) / jumps if jumps else math.nan,
        'good_rejected': sum(result['good_rejected'] for result in results) / good if good else math.nan,
    }
    return lines_of(figures), figures


def _verdict(figures: dict[str, Any]) -> list[str]:
    told = []
    if figures['off_m']['p95'] > P95:
        told.append(f'p95 {figures["off_m"]["p95"]:.2f} m off, at most {P95:g}')
    if figures['outage_share']['median'] > SHARE:
        told.append(f'outages: {100 * figures["outage_share"]["median"]:.2f} % of the way, at most {100 * SHARE:g}')
    if not figures['nees_low'] <= figures['nees'] <= figures['nees_high']:
        told.append(f'NEES {figures["nees"]:.2f}, allowed {figures["nees_low"]:.2f} to {figures["nees_high"]:.2f}')
    for name, what in (('thrown_rejected', 'fixes thrown off are rejected'), ('jumps_said', 'jumps are said')):
        if figures[name] < REJECTED:
            told.append(f'{100 * figures[name]:.1f} % of the {what}, at least {100 * REJECTED:g}')
    return told
