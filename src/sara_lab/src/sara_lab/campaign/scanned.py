"""The campaign's part `scan`: the journeys of `travel` with the laser scanner, alone and among pedestrians."""

from pathlib import Path

from sara_lab.campaign.meetings import meeting_figures
from sara_lab.campaign.part import Part
from sara_lab.campaign.travel_times import time_lines
from sara_lab.campaign.travels import TRAVEL_LINE, travel_row
from sara_lab.experiments.gains import gain_of
from sara_lab.journeys import travel as travels
from sara_lab.journeys.ideal_times import ideal_time
from sara_lab.journeys.travel_cases import MAPS, PAIRS

REACHED = {'true': 149 / 150, 'pedestrians': 0.98}  # share of journeys
TIME_RATIO = 1.25  # time / ideal, true pose


def scan(_seeds: int, folder: Path) -> Part:
    """Fifty pairs on each of three maps, whatever the number of chairs: true pose; fused pose among pedestrians."""

    def case(name, mode, number):
        gain = gain_of(number, folder) if mode in travels.FUSED else None
        outcome = travels.drive(name, mode, number, gain, scan=True)
        return (outcome.with_ideal(ideal_time(name, number, folder)) if mode == 'true' else outcome).to_json()

    return Part(
        {
            f'scan_{name}_{mode}_{number}': lambda name=name, mode=mode, number=number: case(name, mode, number)
            for mode in REACHED
            for name in MAPS
            for number in range(PAIRS)
        },
        _summary,
        _verdict,
    )


def _summary(results):
    figures, lines = {}, []
    for mode in REACHED:
        for name in (*MAPS, 'all'):
            of = [found for found in results if found['mode'] == mode and name in (found['map'], 'all')]
            row = travel_row(of, name == 'all')
            if mode in travels.AMONG_PEOPLE:
                row |= meeting_figures(of)
            figures[f'{mode}_{name}'] = row
            lines.append(TRAVEL_LINE.format(mode, name, **row))
    return lines + time_lines(figures), figures


def _verdict(figures):
    """What does not hold, one sentence each."""
    rows = {mode: figures[f'{mode}_all'] for mode in REACHED}
    found = [
        f'{mode}: {row["reached"]} of {row["cases"]} reached, {REACHED[mode]:.1%} are asked for'
        for mode, row in rows.items()
        if row['reached'] < REACHED[mode] * row['cases']
    ]
    if rows['true'].get('time_ratio', 0.0) > TIME_RATIO:
        found.append(f'true: time / ideal {rows["true"]["time_ratio"]:.2f}, {TIME_RATIO:g} is allowed')
    return found
