"""The campaign's part `worlds`: the default, the classic planners and a textbook's drive through worlds made by a seed,
and through those of a folder; judged side by side.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sara_lab.campaign.part import Figures, Part, mean
from sara_lab.journeys.worlds.foreign import KIND, digest, entries, foreign
from sara_lab.journeys.worlds.made import CORRIDORS, DENSITIES, DOORS, KINDS, PER_KIND, made
from sara_lab.journeys.worlds.trial import DELIVERED, OURS, PLANNERS, drive

GROUPS = {**{kind: (kind,) for kind in DENSITIES}, 'mazes': tuple(CORRIDORS), 'offices': tuple(DOORS), KIND: (KIND,)}
"""{group of worlds: its kinds}"""
LINE = (
    '{:14} {:22} {success:4}/{cases:<3} {reached:4} {contacts:8} {spl:5.2f} {time_ratio:10.2f} {gap_median_m:8.3f} '
    '{ttc_median_s:5.1f} {intruded_s:10.1f} {jerk:8.2f}'
)
HEAD = (
    f'{"worlds":14} {"planner":22} {"success":>8} {"there":>4} {"contacts":>8} {"SPL":>5} {"time/ideal":>10} '
    f'{"gap m":>8} {"TTC s":>5} {"intruded s":>10} {"jerk":>8}'
)


def worlds(seeds: int, _folder: Path, maps: Path | None = None) -> Part:
    """As many worlds of each kind as chairs, PER_KIND at most, and those of the folder `maps`; every planner on each.
    Raises ForeignError where the folder's list is wrong.
    """
    cases = {
        f'worlds_{kind}_{number}_{planner}': lambda kind=kind, number=number, planner=planner: drive(
            made(kind, number), planner
        ).to_json()
        for number in range(min(seeds, PER_KIND))
        for kind in KINDS
        for planner in PLANNERS
    }
    if maps is not None:
        which = digest(maps)
        cases |= {
            f'worlds_{KIND}_{which}_{entry.name}_{planner}': lambda entry=entry, number=number, planner=planner: drive(
                foreign(entry, number), planner
            ).to_json()
            for number, entry in enumerate(entries(maps))
            for planner in PLANNERS
        }
    return Part(cases, _summary, _verdict)


def _summary(results):
    figures, lines = {}, [HEAD]
    for group, kinds in {**GROUPS, 'all': (*KINDS, KIND)}.items():
        for planner in PLANNERS:
            of = [found for found in results if found['kind'] in kinds and found['planner'] == planner]
            if of:
                row = figures[f'{group}_{planner}'] = world_row(of)
                lines.append(LINE.format(group, planner, **row))
    lines += [
        f'no success: {found["name"]} {found["planner"]}: {found["text"]}'
        + (f' Contacts: {len(found["contacts"])}.' if found['contacts'] else '')
        for found in results
        if not found['success']
    ]
    return lines, figures


def world_row(results: Sequence[dict]) -> Figures:
    """Figures of the drives (plain data) of one planner in a group of worlds. Times and gaps are of drives that
    succeeded; contacts are of all.
    """
    there = [found for found in results if found['success']]
    judgements = [found['judgement'] for found in there]
    clearances = [found['clearance'] for found in results if found['clearance']]
    return {
        'cases': len(results),
        'success': len(there),
        'reached': sum(found['reached'] for found in results),
        'contacts': sum(bool(found['contacts']) for found in results),
        'spl': mean([found['spl'] for found in results]),
        'time_ratio': mean([found['time_ratio'] for found in judgements]),
        'gap_median_m': _median([found['gap_min'] for found in judgements]),
        'gap_min_m': min((found['gap_min'] for found in judgements), default=float('nan')),
        'ttc_median_s': _median([found['ttc_min'] for found in clearances]),
        'intrusions': mean([found['intrusions'] for found in clearances]),
        'intruded_s': mean([found['intruded'] for found in clearances]),
        'jerk': mean([np.hypot(found['jerk_tangential_rms'], found['jerk_normal_rms']) for found in judgements]),
    }


def _median(values):
    return float(np.median(values)) if values else float('nan')


def _verdict(figures):
    """Where the default is not first among the four, in success and in contacts: a sentence each."""
    found = []
    for group in GROUPS:
        mine = figures.get(f'{group}_{OURS}')
        for planner in PLANNERS:
            other = figures.get(f'{group}_{planner}')
            if mine is None or other is None or planner in (OURS, DELIVERED):
                continue
            if other['success'] > mine['success']:
                found.append(f'{group}: {planner} {other["success"]} of {other["cases"]}, ours {mine["success"]}')
            if other['contacts'] < mine['contacts']:
                found.append(f'{group}: contacts of {planner} {other["contacts"]}, ours {mine["contacts"]}')
    return found
