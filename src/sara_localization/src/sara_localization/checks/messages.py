"""What is wrong with an input's stamps and values over a drive, looked at for itself: one small function per rule."""

from __future__ import annotations

import numpy as np

from sara_localization.checks.findings import Finding, error, warning
from sara_localization.checks.records import Record, block_start
from sara_localization.filters.state import NAMES
from sara_localization.inputs.preprocessing import FUTURE

LARGEST_DELAY = 1.0
TINY_VARIANCE = 1e-9
LONGEST_GAP_PERIODS = 10.0


def stamp_findings(record: Record, lagged: bool) -> list[Finding]:
    """Messages without a stamp, out of order, late, ahead or with a gap; lagged: smooth_lagged_data is on."""
    stamps, received = np.array(record.stamps), np.array(record.received)
    stamped = stamps > 0.0
    steps, delays = np.diff(stamps[stamped]), (received - stamps)[stamped]
    found = _unstamped(record, int(np.sum(~stamped)))
    if not lagged:
        found += _out_of_order(record, steps)
    return found + _delayed(record, delays) + _gap(record, steps[steps > 0.0])


def _unstamped(record, count):
    if not count:
        return []
    name, n = record.config.name, len(record.stamps)
    sentence = f'{name}: {count} of {n} messages have no time stamp and are dropped. Its driver must set header.stamp.'
    return [error(record.key, sentence)]


def _out_of_order(record, steps):
    back = int(np.sum(steps < 0.0))
    if not back:
        return []
    return [
        warning(
            record.key,
            f'{record.config.name}: {back} of {len(record.stamps)} messages are older than the one before them, by up '
            f'to {-steps.min():.3f} s: they are dropped. smooth_lagged_data: true with a history_length of '
            f'{max(0.1, -2.0 * steps.min()):.2g} s would use them.',
        )
    ]


def _delayed(record, delays):
    name, delay = record.config.name, float(np.median(delays)) if len(delays) else 0.0
    if delay > LARGEST_DELAY:
        return [
            warning(
                record.key,
                f'{name}: messages arrive {delay:.2f} s after their stamp (median): is the clock of its computer set? '
                'smooth_lagged_data with a longer history_length is the remedy for real delays.',
            )
        ]
    if delay < -0.1:
        return [
            warning(
                record.key,
                f'{name}: stamps are {-delay:.2f} s in the future (median): they wait until their time comes, and are '
                f'dropped beyond {FUTURE:g} s. Set the clock of its computer (chrony, NTP).',
            )
        ]
    return []


def _gap(record, steps):
    if not (len(steps) > 10 and steps.max() > max(LONGEST_GAP_PERIODS * np.median(steps), 1.0)):
        return []
    return [
        warning(
            record.key,
            f'{record.config.name}: a gap of {steps.max():.1f} s between messages that usually come every '
            f'{np.median(steps):.3f} s: the estimate only predicts meanwhile. Look for lost messages or a sleeping '
            'driver.',
        )
    ]


def value_findings(record: Record, others: list[Record]) -> list[Finding]:
    """Used variables that are not measured, no numbers, of no variance or of one that is too small, or always the same
    while the `others` move.
    """
    used = [k for k in range(15) if record.config.mask[k]]
    absent = _absent(record, used)
    found = []
    if absent:
        names, name = ', '.join(NAMES[k] for k in absent), record.config.name
        found.append(
            warning(
                record.key,
                f'{name} is to give {names}, but its messages say (covariance -1) that it does not measure that. Take '
                f'it out of {name}_config.',
            )
        )
    values, variances = np.array(record.values), np.array(record.variances)
    for k in used:
        if k not in absent:
            found += _no_numbers(record, k, values[:, k]) + _variance(record, k, variances[:, k])
            found += _constant(record, k, values[:, k], others)
    return found


def _absent(record, used):
    """Those of the used variables that an IMU says it does not measure."""
    if record.config.kind != 'imu':
        return []
    variances = np.array(record.variances)
    return [k for k in used if (variances[:, block_start(k)] == -1.0).all()]


def _no_numbers(record, k, values):
    count = int(np.sum(~np.isfinite(values)))
    if not count:
        return []
    sentence = f'{NAMES[k]} is not a number in {count} of {len(values)} messages, which are left out.'
    return [warning(record.key, f'{record.config.name}: {sentence}')]


def _variance(record, k, variances):
    name, what, bad = record.config.name, NAMES[k], int(np.sum(~(variances > 0.0)))
    if bad:
        return [
            error(
                record.key,
                f'{name}: the variance of {what} is zero, negative or no number in {bad} of {len(variances)} '
                f'messages, and {what} is left out there. Its driver must state how exact it is.',
            )
        ]
    if float(np.median(variances)) < TINY_VARIANCE:
        return [
            warning(
                record.key,
                f'{name}: the variance of {what} is {np.median(variances):.1g}: nobody else will be believed. State '
                'what the sensor really does.',
            )
        ]
    return []


def _constant(record, k, values, others):
    name, what = record.config.name, NAMES[k]
    if not (len(values) > 20 and np.isfinite(values).all() and np.ptp(values) == 0.0 and _move(others, k)):
        return []
    return [
        warning(
            record.key,
            f'{name}: {what} is {values[0]:g} in every message although the robot moves: it is not measured. Take it '
            f'out of {name}_config.',
        )
    ]


def _move(records, k):
    """Whether any of the inputs saw the variable change."""
    for record in records:
        if record.values:
            v = np.array(record.values)[:, k]
            v = v[np.isfinite(v)]
            if len(v) and np.ptp(v) > 0.05:
                return True
    return False
