"""The campaign's parts `doors`, `tight`, `pillars`, `travel` and `journeys`: drives through a door, into tight places,
among pillars and between poses on three maps, judged by limits that SARA's default planners are held to.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sara_lab.campaign.comfort import calm_faults, calm_figures
from sara_lab.campaign.meetings import longer_than_alone, meeting_faults, meeting_figures
from sara_lab.campaign.part import Figures, Part, lines_of, mean, spread
from sara_lab.campaign.travel_times import time_figures, time_lines
from sara_lab.experiments.gains import gain_of
from sara_lab.journeys import doors as crossings
from sara_lab.journeys import journeys as trips
from sara_lab.journeys import pillars as pillar_worlds
from sara_lab.journeys import tight_places
from sara_lab.journeys import travel as travels
from sara_lab.journeys.ideal_times import TIMED, ideal_time
from sara_lab.journeys.travel_cases import MAPS, PAIRS

SHORT_M = 10.0
# Share of journeys; fused: of those of SHORT_M at most.
REACHED = {'true': 0.98, 'fused': 0.95, 'boxes': 0.90, 'pedestrians': 0.95}
FALSE_STOPS = 1.0  # in ten minutes, for pedestrians where none is
COMFORT = ('reversals_per_m', 'last_metre_s', 'last_metre_and_turn_s', 'acceleration_rms')
MEETING = ('yields', 'nearest_m', 'pressed', 'pressed_too_fast', 'longer_than_alone')
TRAVEL_LINE = (
    '{:11} {:8} {reached:4}/{cases:<4} {short_reached:4}/{short:<4} {contacts:8} {to_blame:8} '
    '{gap_min_m:9.3f} {detour:10.2f} {speed:5.2f} {discomfort_per_m:14.2f} {false_stops_in_10_min:11.2f}'
)


def doors(_seeds: int, _folder: Path) -> Part:
    """A door of 0.80 m from 20 angles, whatever the number of chairs."""
    return Part(
        {
            f'doors_{number}': lambda number=number: crossings.cross(number).to_json()
            for number in range(crossings.APPROACHES)
        },
        _doors_summary,
    )


def _doors_summary(results):
    figures = {
        'crossed': sum(result['reached'] for result in results),
        'approaches': len(results),
        'contacts': sum(len(result['contacts']) for result in results),
        'gap_min_m': min(result['judgement']['gap_min'] for result in results),
        'seconds': spread([result['judgement']['seconds'] for result in results]),
    }
    return lines_of(figures), figures


def tight(_seeds: int, folder: Path) -> Part:
    """Into tight places and out again, ten chairs each, whatever the number of chairs: true pose and fused."""

    def case(name, mode, number):
        gain = gain_of(number, folder) if mode == 'fused' else None
        return tight_places.visit(name, mode, number, gain).to_json()

    return Part(
        {
            f'tight_{name}_{mode}_{number}': lambda name=name, mode=mode, number=number: case(name, mode, number)
            for mode in travels.POSES
            for name in tight_places.places()
            for number in range(tight_places.CHAIRS)
        },
        _tight_summary,
    )


def _tight_summary(results):
    figures = {}
    for result in results:
        figures.setdefault(f'{result["mode"]}_{result["place"]}', []).append(result)
    figures = {
        name: {
            'visits': len(of),
            'in_and_out': sum(result['came_out'] for result in of),
            'contacts': sum(len(result['contacts']) for result in of),
            'recoveries': sum(result['recoveries'] for result in of),
            'seconds': float(np.median([result['judgement']['seconds'] for result in of])),
            'gap_min_m': min(result['judgement']['gap_min'] for result in of),
        }
        for name, of in figures.items()
    }
    return lines_of(figures), figures


def pillars(_seeds: int, folder: Path) -> Part:
    """Ten worlds of pillars, whatever the number of chairs: true pose and fused."""

    def case(mode, number):
        return pillar_worlds.drive(number, mode, gain_of(number, folder) if mode == 'fused' else None).to_json()

    return Part(
        {
            f'pillars_{mode}_{number}': lambda mode=mode, number=number: case(mode, number)
            for mode in travels.POSES
            for number in range(pillar_worlds.WORLDS)
        },
        _pillars_summary,
        _pillars_verdict,
    )


def _pillars_summary(results):
    figures = {}
    for mode in travels.POSES:
        of = [result for result in results if result['mode'] == mode]
        found = [result['judgement'] for result in of]
        seconds, length = (sum(judgement[key] for judgement in found) for key in ('seconds', 'length'))
        figures[mode] = {
            'goals': pillar_worlds.GOALS * len(of),
            'reached': sum(result['reached'] for result in of),
            'contacts': sum(len(result['contacts']) for result in of),
            'recoveries': sum(result['recoveries'] for result in of),
            'gap_min_m': min(judgement['gap_min'] for judgement in found),
            'speed': length / seconds,
            'discomfort_per_m': sum(judgement['discomfort'] for judgement in found) / length,
            'false_stops_in_10_min': _in_10_min(found),
        }
    return lines_of(figures), figures


def _pillars_verdict(figures):
    return [sentence for mode, row in figures.items() for sentence in _false_stop_faults(mode, row)]


def _false_stop_faults(mode, row):
    """A sentence where the drives of a mode have too many false stops."""
    often = row['false_stops_in_10_min']
    return (
        [f'{mode}: {often:.2f} false stops in ten minutes, {FALSE_STOPS:g} is allowed'] if often > FALSE_STOPS else []
    )


def _in_10_min(judgements):
    """False stops in ten minutes with a goal, of the drives that were watched for them; NaN where there is none."""
    watched = [found for found in judgements if found.get('meetings')]
    seconds = sum(found['seconds'] for found in watched)
    return 600.0 * sum(found['meetings']['false_stops'] for found in watched) / seconds if seconds else math.nan


def travel(seeds: int, folder: Path) -> Part:
    """Pairs of any poses on each of three maps, as many as chairs, fifty at most: true pose, fused, with unknown boxes,
    with pedestrians, with people who stop for nobody, with those who are expected.
    """

    def case(name, mode, number):
        outcome = travels.drive(name, mode, number, gain_of(number, folder) if mode in travels.FUSED else None)
        if mode in TIMED:
            outcome = outcome.with_ideal(ideal_time(name, number, folder))
        return outcome.to_json()

    return Part(
        {
            f'travel_{name}_{mode}_{number}': lambda name=name, mode=mode, number=number: case(name, mode, number)
            for mode in travels.MODES
            for name in MAPS
            for number in range(min(seeds, PAIRS))
        },
        _travel_summary,
        _travel_verdict,
    )


def _travel_summary(results):
    lines = [
        f'{"mode":11} {"map":8} {"reached":>9} {"to 10 m":>9} {"contacts":>8} {"to blame":>8} {"gap min m":>9} '
        f'{"driven/way":>10} {"m/s":>5} {"discomfort s/m":>14} {"false/10min":>11}'
    ]
    figures, alone = {}, [r for r in results if r['mode'] == 'fused']
    for mode in travels.MODES:
        for name in (*MAPS, 'all'):
            of = [r for r in results if r['mode'] == mode and name in (r['map'], 'all')]
            row = travel_row(of, name == 'all')
            if mode in travels.AMONG_PEOPLE:
                row |= meeting_figures(of) | {'longer_than_alone': longer_than_alone(of, alone)}
            figures[f'{mode}_{name}'] = row
            lines.append(TRAVEL_LINE.format(mode, name, **row))
        comfort = {key: figures[f'{mode}_all'][key] for key in COMFORT}
        if mode in travels.AMONG_PEOPLE:
            comfort |= {key: figures[f'{mode}_all'][key] for key in MEETING}
        lines += [f'{mode}: ' + line for line in lines_of(comfort)]
    lines += time_lines(figures)
    lines += [
        f'not reached: {result["map"]} {result["mode"]} {result["number"]} ({result["way"]:.1f} m): {result["text"]}'
        for result in results
        if not result['reached']
    ]
    return lines, figures


def travel_row(results: Sequence[dict], with_comfort: bool) -> Figures:
    """Figures of the drives (plain data) of one mode on one map, or on all maps."""
    there = [result['judgement'] for result in results if result['reached']]
    short = [result for result in results if result['way'] <= SHORT_M]
    return {
        'cases': len(results),
        'reached': sum(result['reached'] for result in results),
        'short': len(short),
        'short_reached': sum(result['reached'] for result in short),
        'contacts': sum(len(result['contacts']) for result in results),
        'to_blame': sum(not contact['blameless'] for result in results for contact in result['contacts']),
        'gap_min_m': min((r['judgement']['gap_min'] for r in results if r['judgement']), default=math.nan),
        'detour': mean([found['detour'] for found in there]),
        'speed': mean([found['length'] / found['seconds'] for found in there]),
        'discomfort_per_m': mean([found['discomfort'] / found['length'] for found in there]),
        'false_stops_in_10_min': _in_10_min([r['judgement'] for r in results if r['judgement']]),
        **(calm_figures(there) if with_comfort else {}),
        **time_figures(results),
    }


def _travel_verdict(figures):
    found = []
    for mode, share in REACHED.items():
        row = figures[f'{mode}_all']
        reached, cases, which = (
            (row['short_reached'], row['short'], f' of ways up to {SHORT_M:g} m')
            if mode == 'fused'
            else (row['reached'], row['cases'], '')
        )
        if reached < share * cases:
            found.append(f'{mode}: {reached} of {cases} reached{which}, {share:.0%} are asked for')
        found += _false_stop_faults(mode, row)
    found += meeting_faults(figures['pedestrians_all'])
    return found + [f'true: {sentence}' for sentence in calm_faults(figures['true_all'], '')]


def journeys(_seeds: int, _folder: Path) -> Part:
    """Each local planner from ten starts to ten goals on each map, whatever the number of chairs."""
    return Part(
        {
            f'journey_{name}_{planner}_{number}': lambda name=name, planner=planner, number=number: trips.drive(
                name, planner, number
            ).to_json()
            for name in trips.MAPS
            for planner in trips.PLANNERS
            for number in range(trips.PAIRS)
        },
        _journeys_summary,
    )


def _journeys_summary(results):
    lines = [
        (
            f'{"map":8} {"planner":22} {"reached":>7} {"contacts":>8} {"worst m off":>11} {"deg":>5} {"m/s":>5} '
            f'{"longer by":>9} {"turned rad/m":>12}'
        )
    ]
    figures = {}
    for name in trips.MAPS:
        for planner in trips.PLANNERS:
            of = [result for result in results if (result['map'], result['planner']) == (name, planner)]
            there = [result for result in of if result['reached']] or of
            row = {
                'cases': len(of),
                'reached': sum(result['reached'] for result in of),
                'contacts': sum(result['contacts'] for result in of),
                'worst_position_m': max(result['position_error'] for result in there),
                'worst_yaw_deg': max(abs(math.degrees(result['yaw_error'])) for result in there),
                'mean_speed': float(np.mean([result['driven'] / max(result['seconds'], 1.0) for result in there])),
                'longer_than_planned': float(np.mean([result['driven'] / result['way'] for result in there])) - 1.0,
                'turned_per_m': float(np.mean([result['turned'] / result['way'] for result in there])),
            }
            figures[f'{name}_{planner}'] = row
            lines.append(
                '{:8} {:22} {reached:4}/{cases:<2} {contacts:8} {worst_position_m:11.3f} {worst_yaw_deg:5.1f} '
                '{mean_speed:5.2f} {longer_than_planned:9.1%} '
                '{turned_per_m:12.2f}'.format(name, planner, **row)
            )
    return lines, figures
