#!/usr/bin/env python3
"""Prints how long and how far the chair of test_guard.py goes on after each hazard: the worst of many seeds, from 0.8
m/s.

Run with the package's environment sourced: `.venv/bin/python src/sara_control/test/stopping_times.py [seeds]`.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / 'unit'))
from test_guard import LIMITS, driving, hazard  # noqa: E402

SPEED = 0.8


def stop(name, seed):
    """(s, m) from the hazard to below 0.05 m/s, and at all."""
    chair = driving(seed, SPEED)
    hazard(chair, name)
    start, end, where = chair.t, chair.t, chair.odometer
    while chair.t < start + 4.0:
        chair.step()
        if abs(chair.v) >= 0.05:
            end = chair.t
    return end - start, chair.odometer - where


def main():
    """The table."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    print(f'from {SPEED} m/s, {seeds} seeds: hazard, allowed s, worst s, worst m')
    for name, limit in LIMITS.items():
        times, ways = zip(*(stop(name, seed) for seed in range(seeds)))
        print(f'{name:15} {limit + SPEED / 1.5 + 0.25:5.2f} {max(times):5.2f} {max(ways):5.2f}')


if __name__ == '__main__':
    main()
