"""The campaign's part `compass`: chairs with a magnetometer, in a clean field, and among motors and steel."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from sara_lab.campaign.part import Part, lines_of, mean, spread
from sara_lab.studies.compass_drive import Row, drive
from sara_sim.chips.magnetic_config import MagneticConfig

CLEAN, STEEL = 'clean', 'steel'
MINUTES = {CLEAN: 5.0, STEEL: 30.0}
FIELDS = {CLEAN: MagneticConfig(motor_sigma=0.0), STEEL: MagneticConfig()}
WORST_CLEAN, P95_STEEL, OVER_GYRO, DRIFT = 2.0, 3.0, 0.5, 2.0
"""deg: at any time in the clean field; p95 among steel; p95 beyond the gyroscope's alone; last minute against first."""
MINUTE = 60 * 20
"""Rows."""
APART = 20 * 20
"""Rows between two whose errors count as independent."""


def compass(seeds: int, _folder: Path) -> Part:
    """Each chair is calibrated by two turns, from a heading known within 0.5 deg (one sigma), and then driven."""
    return Part(
        {
            f'compass_{kind}_{seed}': lambda kind=kind, seed=seed: judged(
                kind, seed, drive(seed, MINUTES[kind], FIELDS[kind], kind == STEEL)[1]
            )
            for kind in MINUTES
            for seed in range(seeds)
        },
        _summary,
    )


def judged(kind: str, seed: int, rows: Sequence[Row]) -> dict[str, Any]:
    """The figures of a drive, deg, and what is not met."""
    table = np.array(rows, dtype=float)
    heading, gyro = np.abs(np.degrees(table[:, 1])), np.abs(np.degrees(table[:, 2]))
    signed, chosen = np.degrees(table[:, 1]), table[::APART]
    result = {
        'kind': kind,
        'seed': seed,
        'p95': float(np.percentile(heading, 95)),
        'worst': float(heading.max()),
        'gyro_p95': float(np.percentile(gyro, 95)),
        'gyro_worst': float(gyro.max()),
        'drift': float(abs(signed[-MINUTE:].mean() - signed[:MINUTE].mean())),
        'moments_over': float(np.mean(heading > gyro + OVER_GYRO)),
        'nees': float(np.mean(chosen[:, 1] ** 2 / chosen[:, 3])),
        'used': float(table[:, 4].mean()),
    }
    limits = {'worst': WORST_CLEAN} if kind == CLEAN else {'p95': P95_STEEL, 'drift': DRIFT}
    result['faults'] = [
        f'{name} {result[name]:.2f} deg, at most {limit:g}' for name, limit in limits.items() if result[name] > limit
    ]
    if result['p95'] > result['gyro_p95'] + OVER_GYRO:
        result['faults'].append(
            f'p95 {result["p95"]:.2f} deg, {OVER_GYRO:g} more than the gyroscope alone ({result["gyro_p95"]:.2f})'
        )
    return result


def _summary(results):
    figures = {}
    for kind in MINUTES:
        of = [result for result in results if result['kind'] == kind]
        if not of:
            continue
        for name in ('p95', 'worst', 'gyro_p95', 'gyro_worst', 'drift'):
            figures[f'{kind}_{name}_deg'] = spread([result[name] for result in of])
        scores = [result['nees'] for result in of]
        figures[f'{kind}_nees'] = mean(scores)
        figures[f'{kind}_nees_error'] = float(np.std(scores) / math.sqrt(len(scores)))
        figures[f'{kind}_moments_over'] = mean([result['moments_over'] for result in of])
        figures[f'{kind}_used'] = mean([result['used'] for result in of])
    return lines_of(figures), figures
