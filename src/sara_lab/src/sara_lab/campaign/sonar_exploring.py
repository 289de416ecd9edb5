"""The campaign's part `sonar_explore`: uncalibrated chairs explore the maps of `sonar_mapping` by themselves with
ultrasonic sensors alone, 20 minutes at most; their maps are judged as there.
"""

from __future__ import annotations

from pathlib import Path

from sara_lab.campaign.exploring import AT_HOME
from sara_lab.campaign.part import Figures, Part, spread
from sara_lab.campaign.sonar_mapping import errors_row, faults
from sara_lab.studies.draw_maps import draw
from sara_lab.studies.sonar_drives import MAPS
from sara_lab.studies.sonar_explored import LIMIT_S, SonarExplored, explored
from sara_lab.studies.sonar_trial import heard_share
from sara_nav.maps.map_saver import SaverConfig, save_map
from sara_slam.exploring.orders import State


def sonar_explore(seeds: int, folder: Path) -> Part:
    """On each map as many chairs, each from a start of its own. Maps and pictures are kept in the folder."""
    return Part(
        {
            f'sonar_explore_{name}_{number}': lambda name=name, number=number: _case(name, number, folder / 'maps')
            for number in range(seeds)
            for name in MAPS
        },
        _summary,
    )


def _case(name, number, folder):
    found = explored(name, number)
    path = folder / f'sonar_explored_{name}_{number}'
    path.parent.mkdir(parents=True, exist_ok=True)
    save_map(found.made.grid, SaverConfig(name=str(path)))
    draw(name, found.made, found.made.places, path.with_suffix('.png'))
    return {
        'map': name,
        'number': number,
        'seconds': found.seconds,
        'way': found.drive.way,
        'contacts': found.contacts,
        'heard': heard_share(name, found.drive),
        'errors': found.made.errors._asdict(),
        'said': found.said,
        'faults': faults(found.made.errors) + ended_wrong(found),
    }


def ended_wrong(found: SonarExplored) -> list[str]:
    """What is wrong with how an exploration ended, one sentence each."""
    wrong = []
    if found.state is not State.DONE or found.seconds > LIMIT_S:
        wrong.append(f'it was not back after {LIMIT_S:.0f} s')
    elif not found.off_home <= AT_HOME:
        wrong.append(f'it ended {found.off_home:.2f} m from where it began')
    if found.contacts:
        wrong.append(f'{found.contacts} contacts')
    return wrong


def _summary(results):
    lines = [
        f'{"map":8} {"chairs":>6} {"good":>4} {"s":>6} {"worst":>6} {"way m":>6} {"pose m":>6} {"worst":>6} '
        f'{"median m":>8} {"p95 m":>6} {"mapped":>7} {"least":>6} {"false":>6} {"doors":>5} {"shut":>4} {"contacts":>8}'
    ]
    figures: Figures = {}
    for name in MAPS:
        of = [result for result in results if result['map'] == name]
        if not of:
            continue
        row = {
            'chairs': len(of),
            'good': sum(not result['faults'] for result in of),
            **{key: spread([result[key] for result in of]) for key in ('seconds', 'way', 'heard')},
            **errors_row([result['errors'] for result in of]),
            'contacts': sum(result['contacts'] for result in of),
        }
        figures[name] = row
        lines.append(
            f'{name:8} {row["chairs"]:6} {row["good"]:4} {row["seconds"]["median"]:6.0f} '
            f'{row["seconds"]["worst"]:6.0f} {row["way"]["median"]:6.1f} {row["pose_rms"]["median"]:6.3f} '
            f'{row["pose_rms"]["worst"]:6.3f} {row["median"]["median"]:8.3f} {row["p95"]["median"]:6.3f} '
            f'{row["mapped"]["median"]:7.1%} {row["least_mapped"]:6.1%} {row["false"]["median"]:6.2%} '
            f'{row["doors"]:5} {row["shut"]:4} {row["contacts"]:8}'
        )
    return lines, figures
