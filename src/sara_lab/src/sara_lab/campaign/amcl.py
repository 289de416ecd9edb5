"""The campaign's part `amcl`: the nine tests of the C++ node on simulated robots, judged by that node's tolerances."""

from functools import cache
from pathlib import Path

from sara_lab.campaign.part import Part, spread
from sara_lab.studies.amcl_drives import AMCL_TESTS, map_file
from sara_lab.studies.amcl_trial import trial
from sara_localization.ranges.range_data import RangeMap
from sara_nav.maps.map_io import load_map
from sara_sim.world.world import World

ACCEPTED = dict.fromkeys(AMCL_TESTS, 1.0) | {'global_localization_stage': 0.98}  # share of the seeds


def amcl(seeds: int, _folder: Path) -> Part:
    """Each test with twice as many seeds as chairs: of the odometry, the scanner and the particles."""

    def case(name, seed):
        return trial(AMCL_TESTS[name], *_maps(), seed)

    return Part(
        {
            f'amcl_{name}_{seed}': lambda name=name, seed=seed: case(name, seed)
            for name in AMCL_TESTS
            for seed in range(2 * seeds)
        },
        _summary,
        _verdict,
    )


@cache
def _maps() -> tuple[World, RangeMap]:
    """What the robot meets, and what the filter knows."""
    grid = load_map(map_file())
    origin = grid.geometry.origin_x, grid.geometry.origin_y, grid.origin_yaw
    return World.from_yaml(map_file()), RangeMap.from_occupancy(grid.data, grid.geometry.resolution, origin, 65)


def _summary(results):
    figures, lines = {}, []
    for name in AMCL_TESTS:
        of = [result for result in results if result['test'] == name]
        ended = [result for result in of if 'true' in result]
        passed = sum(not result['faults'] for result in of)
        row = {'cases': len(of), 'passed': passed}
        if ended:
            row |= {'position_m': spread([r['true'] for r in ended]), 'yaw_rad': spread([r['yaw'] for r in ended])}
        figures[name] = row
        lines.append(f'{name:30} {passed:3} of {len(of):3}' + _errors(row))
    return lines, figures


def _errors(row):
    if 'position_m' not in row:
        return ''
    return '  position {median:.3f} m, p95 {p95:.3f}, worst {worst:.3f}'.format(**row['position_m'])


def _verdict(figures):
    return [
        f'{name}: {row["passed"]} of {row["cases"]} within the tolerance, {ACCEPTED[name]:.0%} are asked for'
        for name, row in figures.items()
        if row['passed'] < ACCEPTED[name] * row['cases']
    ]
