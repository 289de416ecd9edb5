"""The campaign's part `mapping`: maps that slam_gmapping makes of drives of the simulated chair, with its scanner,
through the rooms of three maps, alone and among two pedestrians.
"""

import math
from pathlib import Path

from sara_lab.campaign.part import Figures, Part, spread
from sara_lab.journeys.travel_cases import MAPS
from sara_lab.studies.draw_maps import draw
from sara_lab.studies.map_drives import kept
from sara_lab.studies.map_trial import Made, judged, mapped
from sara_nav.maps.map_saver import SaverConfig, save_map

MEDIAN, P95 = 0.02, 0.06
"""m that walls may be off."""
MAPPED = 0.95
"""Share of the walls seen that must be mapped."""
BROKEN = 0.30
"""m off a pose may be that a broken map is not."""
THEIRS = 0.005
"""Share of the occupied cells that pedestrians may leave behind."""


def mapping(seeds: int, folder: Path) -> Part:
    """On each map as many drives as chairs, alone and among pedestrians. Drives and maps are kept in the folder: what
    changes the map builder alone needs no new drives.
    """

    def case(name, number, people):
        drive = kept(name, number, people, folder / 'map_drives')
        slam = mapped(drive)
        made = judged(name, drive, slam)
        path = folder / 'maps' / f'{name}_{"people_" * people}{number}'
        path.parent.mkdir(parents=True, exist_ok=True)
        save_map(made.grid, SaverConfig(name=str(path)))
        draw(name, made, slam.poses, path.with_suffix('.png'))
        return {
            'map': name,
            'people': people,
            'number': number,
            'way': drive.way,
            'missed': drive.missed,
            'pose': made.errors.pose,
            'median_m': made.errors.median,
            'p95_m': made.errors.p95,
            'mapped': made.errors.mapped,
            'strays': made.errors.strays,
            'pose_rms_m': made.pose_rms,
            'pose_max_m': made.pose_max,
            'counts': made.counts,
            'faults': faults(made, people),
        }

    return Part(
        {
            f'mapping_{name}_{"people_" * people}{number}': lambda name=name, number=number, people=people: case(
                name, number, people
            )
            for people in (False, True)
            for number in range(seeds)
            for name in MAPS
        },
        _summary,
    )


def faults(made: Made, people: bool) -> list[str]:
    """What is wrong with a map, one sentence each."""
    errors, found = made.errors, []
    if not made.pose_max <= BROKEN or math.isinf(errors.median):
        found.append(f'the map is broken: a pose is {made.pose_max:.2f} m off')
    if not errors.median <= MEDIAN:
        found.append(f'walls are {errors.median:.3f} m off (median), {MEDIAN:g} is allowed')
    if not errors.p95 <= P95:
        found.append(f'walls are {errors.p95:.3f} m off (p95), {P95:g} is allowed')
    if not errors.mapped >= MAPPED:
        found.append(f'{errors.mapped:.1%} of the walls seen are mapped, {MAPPED:.0%} are asked for')
    if people and not errors.strays <= THEIRS:
        found.append(f'{errors.strays:.2%} of the occupied cells are no walls, {THEIRS:.1%} are allowed')
    return found


def _summary(results):
    lines = [
        f'{"map":8} {"people":>6} {"maps":>4} {"good":>4} {"median m":>8} {"worst":>6} {"p95 m":>6} {"worst":>6} '
        f'{"mapped":>7} {"strays":>7} {"pose m":>7} {"way m":>6}'
    ]
    figures: Figures = {}
    for people in (False, True):
        for name in MAPS:
            of = [result for result in results if (result['map'], result['people']) == (name, people)]
            row = {
                'maps': len(of),
                'good': sum(not result['faults'] for result in of),
                **{key: spread([result[key] for result in of]) for key in ('median_m', 'p95_m', 'pose_rms_m', 'way')},
                'least_mapped': min(result['mapped'] for result in of),
                'most_strays': max(result['strays'] for result in of),
            }
            figures[f'{name}{"_people" * people}'] = row
            lines.append(
                f'{name:8} {"two" if people else "none":>6} {row["maps"]:4} {row["good"]:4} '
                f'{row["median_m"]["median"]:8.3f} {row["median_m"]["worst"]:6.3f} {row["p95_m"]["median"]:6.3f} '
                f'{row["p95_m"]["worst"]:6.3f} {row["least_mapped"]:7.1%} {row["most_strays"]:7.2%} '
                f'{row["pose_rms_m"]["worst"]:7.3f} {row["way"]["median"]:6.1f}'
            )
    return lines, figures
