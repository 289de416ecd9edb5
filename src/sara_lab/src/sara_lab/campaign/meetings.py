"""How journeys among pedestrians went: yields, how near and how fast the chair came to somebody, and how much longer it
took than alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from sara_lab.campaign.part import Figures, mean

LONGER = 1.4  # times the same journeys alone, on average
PRESSED = 0.3  # m/s towards somebody near whom a sensor could hear


def meeting_figures(results: Sequence[dict]) -> Figures:
    """Figures of journeys (plain data) whose Judgement knows the Meetings."""
    found = [r['judgement']['meetings'] for r in results if r['judgement'] and r['judgement'].get('meetings')]
    return {
        'yields': sum(meetings['yields'] for meetings in found),
        'nearest_m': min((m['nearest'] for m in found if m['nearest'] is not None), default=math.nan),
        'pressed': max((meetings['pressed'] for meetings in found), default=math.nan),
        'pressed_too_fast': sum(meetings['pressed'] > PRESSED for meetings in found),
    }


def longer_than_alone(results: Sequence[dict], alone: Sequence[dict]) -> float:
    """The mean of the times of journeys reached over those of the same journeys alone; NaN without any."""
    seconds = {(r['map'], r['number']): r['seconds'] for r in alone if r['reached']}
    pairs = [(r['seconds'], seconds.get((r['map'], r['number']))) for r in results if r['reached']]
    return mean([taken / known for taken, known in pairs if known])


def meeting_faults(row: Figures) -> list[str]:
    """What is not as it should be among pedestrians, one sentence each."""
    faults = []
    if row['to_blame']:
        faults.append(f'pedestrians: {row["to_blame"]} contacts to blame')
    if row['longer_than_alone'] > LONGER:
        faults.append(f'pedestrians: {row["longer_than_alone"]:.2f} times as long as alone, {LONGER:g} is allowed')
    if row['pressed_too_fast']:
        faults.append(f'pedestrians: on {row["pressed_too_fast"]} journeys somebody near was approached too fast')
    return faults
