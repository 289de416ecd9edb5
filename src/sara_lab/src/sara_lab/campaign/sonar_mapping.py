"""The campaign's part `sonar_mapping`: maps that uncalibrated chairs make by ultrasonic sensors alone, beside plain
grids of arcs on the same drives.
"""

from collections.abc import Sequence
from pathlib import Path

from sara_lab.campaign.part import Figures, Part, spread
from sara_lab.judge.passed_walls import MapErrors
from sara_lab.studies.draw_maps import draw
from sara_lab.studies.sonar_drives import MAPS, kept
from sara_lab.studies.sonar_trial import heard_share, made_of
from sara_nav.maps.map_saver import SaverConfig, save_map

MOST = {'pose_rms': 0.12, 'median': 0.03, 'p95': 0.12, 'false': 0.01, 'shut': 0}
"""Of MapErrors: m; occupied cells that are no walls, for each free cell; doors."""
MAPPED = 0.90
"""Share of the walls passed that must be mapped."""
HOW = ('lines', 'arcs')


def sonar_mapping(seeds: int, folder: Path) -> Part:
    """On each map as many drives as chairs. Drives and maps are kept in the folder."""

    def case(name, number):
        drive = kept(name, number, folder / 'sonar_drives')
        both = made_of(name, drive)
        path = folder / 'sonar_maps' / f'{name}_{number}'
        path.parent.mkdir(parents=True, exist_ok=True)
        save_map(both[0].grid, SaverConfig(name=str(path)))
        for how, made in zip(HOW, both):
            draw(name, made, made.places, path.with_name(f'{path.name}_{how}.png'))
        return {
            'map': name,
            'number': number,
            'way': drive.way,
            'heard': heard_share(name, drive),
            **{how: made.errors._asdict() for how, made in zip(HOW, both)},
            'faults': faults(both[0].errors),
        }

    return Part(
        {
            f'sonar_mapping_{name}_{number}': lambda name=name, number=number: case(name, number)
            for name in MAPS
            for number in range(seeds)
        },
        _summary,
    )


def faults(errors: MapErrors) -> list[str]:
    """What is wrong with a map, one sentence each."""
    found = [
        f'{name} is {getattr(errors, name):.3f}, {most:g} is allowed'
        for name, most in MOST.items()
        if not getattr(errors, name) <= most
    ]
    if not errors.mapped >= MAPPED:
        found.append(f'{errors.mapped:.1%} of the walls passed are mapped, {MAPPED:.0%} are asked for')
    return found


def errors_row(errors: Sequence[dict]) -> Figures:
    """Figures of the MapErrors (plain data) of some maps."""
    return {
        **{key: spread([one[key] for one in errors]) for key in ('pose_rms', 'median', 'p95', 'mapped', 'false')},
        'least_mapped': min(one['mapped'] for one in errors),
        **{key: sum(one[key] for one in errors) for key in ('doors', 'shut')},
    }


def _summary(results):
    lines = [
        f'{"map":8} {"by":5} {"maps":>4} {"good":>4} {"pose m":>6} {"worst":>6} {"median m":>8} {"p95 m":>6} '
        f'{"heard":>6} {"mapped":>7} {"least":>6} {"false":>6} {"doors":>5} {"shut":>4}'
    ]
    figures: Figures = {}
    for name in MAPS:
        of = [result for result in results if result['map'] == name]
        for how in HOW if of else ():
            row = errors_row([result[how] for result in of])
            row['heard'] = spread([result['heard'] for result in of])
            row['good'] = sum(not faults(MapErrors(**result[how])) for result in of)
            figures[f'{name}_{how}'] = {'maps': len(of), **row}
            lines.append(
                f'{name:8} {how:5} {len(of):4} {row["good"]:4} {row["pose_rms"]["median"]:6.3f} '
                f'{row["pose_rms"]["worst"]:6.3f} {row["median"]["median"]:8.3f} {row["p95"]["median"]:6.3f} '
                f'{row["heard"]["median"]:6.1%} {row["mapped"]["median"]:7.1%} {row["least_mapped"]:6.1%} '
                f'{row["false"]["median"]:6.2%} {row["doors"]:5} {row["shut"]:4}'
            )
    return lines, figures
