"""`draw_map_growth`: how time and memory of slam_gmapping grow with the way driven, as a table and a picture: laps of
one drive through the school, in lockstep.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from sara_bringup.paths import share
from sara_lab.experiments.plotting import figure
from sara_lab.studies.map_drives import kept
from sara_lab.studies.map_growth import Grown, grown
from sara_lab.workers.sources import folder_of

LINE = '{way:7.0f} m {key_scans:6} key scans {loops:6} loops {core_s:8.1f} core s {share:6.1%} of a core {mb:5.0f} MB'


def shares(laps: Sequence[Grown]) -> list[float]:
    """Of a core, in each lap."""
    before = [Grown(0.0, 0.0, 0.0, 0.0, 0, 0), *laps]
    return [(b.core_s - a.core_s) / (b.driven_s - a.driven_s) for a, b in zip(before, before[1:])]


def picture(laps: Sequence[Grown], path: Path) -> None:
    """Write it."""
    ways = [lap.way for lap in laps]
    with figure(path, 1, 2, size=(9, 3.6)) as (_, (time, memory)):
        time.plot(ways, [100.0 * share for share in shares(laps)], marker='o', ms=3)
        time.set(xlabel='way driven (m)', ylabel='% of a core while driving', ylim=(0.0, None))
        memory.plot(ways, [lap.mb for lap in laps], marker='o', ms=3)
        memory.set(xlabel='way driven (m)', ylabel='MB', ylim=(0.0, None))


def main(words: list[str] | None = None) -> None:
    """Entry point of nodes/draw_map_growth."""
    parser = argparse.ArgumentParser(prog='draw_map_growth', description=__doc__)
    parser.add_argument('--way', type=float, default=2000.0, help='m that are driven (default: %(default)s)')
    parser.add_argument('--results', type=Path, default=Path('out/campaign'), help='folder of the campaign')
    folder = share('sara_slam') / 'docs' / 'images'
    parser.add_argument('--out', type=Path, default=folder, help='folder (default: %(default)s)')
    options = parser.parse_args(words)
    if not options.way > 0.0:
        parser.error(f'--way is {options.way:g}, allowed are m above 0')
    laps: list[Grown] = []
    for lap in grown(kept('school', 0, False, folder_of(options.results) / 'map_drives'), options.way):
        laps.append(lap)
        print(LINE.format(**lap._asdict(), share=shares(laps)[-1]), flush=True)
    options.out.mkdir(parents=True, exist_ok=True)
    picture(laps, options.out / 'growth.png')
