"""The campaign's parts `made_maps` and `sonar_made_maps`: the journeys of `travel`, true pose, by maps that simulated
chairs made, with the laser scanner and by ultrasonic sensors alone.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

from sara_lab.campaign.part import Part
from sara_lab.campaign.travels import TRAVEL_LINE, travel_row
from sara_lab.journeys import travel
from sara_lab.journeys.travel_cases import MAPS, PAIRS
from sara_lab.studies import explored, sonar_drives, sonar_trial
from sara_nav.maps.map_io import GridMap

MAPS_MADE = 3
"""Maps that are made of each world: a journey is by that of its number modulo this."""
REACHED, SONAR_REACHED = 0.98, 0.95
"""Share of the journeys."""


def made_maps(_seeds: int, folder: Path) -> Part:
    """The fifty journeys on each map, with the scanner, by the maps of chairs that explored. Maps are kept in the
    folder.
    """
    return _part(
        'made_maps', MAPS, REACHED, True, lambda name, made: explored.kept_map(name, made, folder / 'explored')
    )


def sonar_made_maps(_seeds: int, folder: Path) -> Part:
    """The fifty journeys on each map that `sonar_mapping` drives on, by its maps, laid on the true one by their walls
    as localization by walls would. Drives and maps are kept in the folder.
    """
    names = [name for name in MAPS if name in sonar_drives.MAPS]
    return _part(
        'sonar_made_maps', names, SONAR_REACHED, False, lambda name, made: sonar_trial.kept_map(name, made, folder)
    )


def _part(part: str, names: Sequence[str], reached: float, scan: bool, map_of: Callable[[str, int], GridMap]) -> Part:
    def case(name, number):
        return travel.drive(name, 'true', number, scan=scan, known=map_of(name, number % MAPS_MADE)).to_json()

    return Part(
        {
            f'{part}_{name}_{number}': lambda name=name, number=number: case(name, number)
            for number in range(PAIRS)
            for name in names
        },
        lambda results: _summary(names, results),
        lambda figures: _verdict(reached, figures['all']),
    )


def _summary(names, results):
    figures, lines = {}, []
    for name in (*names, 'all'):
        of = [found for found in results if name in (found['map'], 'all')]
        figures[name] = travel_row(of, name == 'all')
        lines.append(TRAVEL_LINE.format('made', name, **figures[name]))
    lines += [
        f'not reached: {result["map"]} {result["number"]}: {result["text"]}'
        for result in results
        if not result['reached']
    ]
    return lines, figures


def _verdict(reached, row):
    if row['reached'] < reached * row['cases']:
        return [f'{row["reached"]} of {row["cases"]} reached, {reached:.0%} are asked for']
    return []
