"""How long journeys take beside the ideal time, and where the time went."""

from __future__ import annotations

from collections.abc import Sequence

from sara_lab.campaign.part import Figures
from sara_lab.journeys.ideal_times import QUICK
from sara_lab.judge.time_split import KINDS


def time_figures(results: Sequence[dict]) -> Figures:
    """Figures of journeys (plain data) of one mode: those reached in all, and as shares of all; empty where no ideal
    time is known.
    """
    there = [found['judgement'] for found in results if found['reached'] and found['judgement'].get('ideal')]
    if not there:
        return {}
    seconds, ideal = sum(found['seconds'] for found in there), sum(found['ideal'] for found in there)
    split = {kind: sum(found['split'][kind] for found in there) for kind in KINDS}
    return {
        'time_s': seconds,
        'ideal_s': ideal,
        'time_ratio': seconds / ideal,
        'quick': sum(found['time_ratio'] < QUICK for found in there) / len(results),
        'total_speed': sum(found['length'] for found in there) / seconds,
        'split_s': split,
    }


def time_lines(figures: Figures) -> list[str]:
    """The table of all groups that have such figures: the split in multiples of the ideal time, which add up to time /
    ideal.
    """
    head = f'{"mode":11} {"map":8} {"time s":>8} {"ideal s":>8} {"ratio":>6} {f"< {QUICK:g}":>6} {"m/s":>6}'
    lines = [head + ''.join(f' {kind:>10}' for kind in KINDS)]
    for group, row in figures.items():
        if 'time_s' in row:
            mode, name = group.split('_')
            lines.append(
                f'{mode:11} {name:8} {row["time_s"]:8.0f} {row["ideal_s"]:8.0f} {row["time_ratio"]:6.2f} '
                f'{row["quick"]:6.0%} {row["total_speed"]:6.3f}'
                + ''.join(f' {row["split_s"][kind] / row["ideal_s"]:10.3f}' for kind in KINDS)
            )
    return lines if len(lines) > 1 else []
