"""The campaign's part `explore`: simulated chairs explore three maps by themselves with the laser scanner, and the maps
that come of it are judged as those of `mapping`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy import ndimage

from sara_common.planar import inverse
from sara_common.platforms import chosen
from sara_lab.campaign.mapping import faults
from sara_lab.campaign.part import Figures, Part, spread
from sara_lab.journeys.travel_cases import MAPS, grid_of
from sara_lab.judge.walls import Pose, placed
from sara_lab.studies.draw_maps import draw
from sara_lab.studies.explored import Explored, explored
from sara_lab.studies.map_trial import judged
from sara_nav.maps.map_io import FREE, GridMap
from sara_slam.exploring.orders import State

KNOWN = 0.98
"""Share of the places which the chair can reach that must be free on its map."""
AT_HOME = 0.3
"""m from where it began that it must end."""
HERE = (0.0, 0.0, 0.0)


def explore(seeds: int, folder: Path) -> Part:
    """On each map as many chairs, each from a start of its own; a picture of each in the folder."""
    cases = {
        f'explore_{name}_{number}': lambda name=name, number=number: _case(name, number, folder / 'maps')
        for number in range(seeds)
        for name in MAPS
    }
    return Part(cases, _summary)


def _case(name, number, pictures):
    found = explored(name, number)
    made = judged(name, found.drive, found.slam, HERE)
    pictures.mkdir(parents=True, exist_ok=True)
    draw(name, made, found.slam.poses, pictures / f'explored_{name}_{number}.png')
    known = known_share(name, found.drive.poses[0, 4:], made.grid, made.errors.pose)
    return {
        'map': name,
        'number': number,
        'seconds': found.seconds,
        'way': found.drive.way,
        'known': known,
        'contacts': found.drive.contacts,
        'median_m': made.errors.median,
        'p95_m': made.errors.p95,
        'mapped': made.errors.mapped,
        'pose_rms_m': made.pose_rms,
        'said': found.said,
        'faults': faults(made, False) + ended_wrong(found, known),
    }


def ended_wrong(found: Explored, known: float) -> list[str]:
    """What is wrong with how an exploration ended, one sentence each. known: see known_share."""
    wrong = []
    if found.state is not State.DONE:
        wrong.append(f'it did not end in {found.seconds:.0f} s')
    if not known >= KNOWN:
        wrong.append(f'{known:.1%} of the places that it can reach are on its map, {KNOWN:.0%} are asked for')
    if not found.off_home <= AT_HOME:
        wrong.append(f'it ended {found.off_home:.2f} m from where it began')
    if found.drive.contacts:
        wrong.append(f'{found.drive.contacts} contacts')
    return wrong


def known_share(name: str, start: Pose, made: GridMap, offset: Pose) -> float:
    """The share (0 to 1) of the cells of a true map that a disc as wide as the body reaches from `start` (m) which are
    free on a map that was made. offset: where the made map's frame is on the true one.
    """
    true = grid_of(name)
    g = true.geometry
    room = ndimage.distance_transform_edt(true.data == FREE) * g.resolution
    labels, _ = ndimage.label(room > 0.5 * chosen().body.width)
    column, row = g.to_cell(float(start[0]), float(start[1]))
    rows, columns = np.nonzero(labels == labels[row, column])
    points = placed(np.column_stack(g.to_world(columns, rows)), inverse(offset))
    m = made.geometry
    columns, rows = np.floor((points - (m.origin_x, m.origin_y)) / m.resolution).astype(int).T
    inside = (columns >= 0) & (columns < m.width) & (rows >= 0) & (rows < m.height)
    return float(np.count_nonzero(made.data[rows[inside], columns[inside]] == FREE)) / len(points)


def _summary(results):
    lines = [
        f'{"map":8} {"chairs":>6} {"good":>4} {"s":>6} {"worst":>6} {"way m":>6} {"worst":>6} {"known":>7} '
        f'{"median m":>8} {"p95 m":>6} {"mapped":>7} {"contacts":>8}'
    ]
    figures: Figures = {}
    for name in MAPS:
        of = [result for result in results if result['map'] == name]
        row = {
            'chairs': len(of),
            'good': sum(not result['faults'] for result in of),
            **{key: spread([result[key] for result in of]) for key in ('seconds', 'way', 'median_m', 'p95_m')},
            'least_known': min(result['known'] for result in of),
            'least_mapped': min(result['mapped'] for result in of),
            'contacts': sum(result['contacts'] for result in of),
        }
        figures[name] = row
        lines.append(
            f'{name:8} {row["chairs"]:6} {row["good"]:4} {row["seconds"]["median"]:6.0f} '
            f'{row["seconds"]["worst"]:6.0f} {row["way"]["median"]:6.1f} {row["way"]["worst"]:6.1f} '
            f'{row["least_known"]:7.1%} {row["median_m"]["worst"]:8.3f} {row["p95_m"]["worst"]:6.3f} '
            f'{row["least_mapped"]:7.1%} {row["contacts"]:8}'
        )
    return lines, figures
