"""The campaign's part `amcl`: the tests of the C++ node on simulated robots, judged by that node's tolerances."""

from pathlib import Path

from sara_lab.campaign.part import Part, spread
from sara_lab.studies.amcl_drives import AMCL_TESTS
from sara_lab.studies.amcl_trial import maps, trial

ACCEPTED = dict.fromkeys(AMCL_TESTS, 1.0) | {'global_localization_stage': 0.98}  # share of the seeds


def amcl(seeds: int, _folder: Path) -> Part:
    """Each test with twice as many seeds as chairs: of the odometry, the scanner and the particles."""

    def case(name, seed):
        return trial(AMCL_TESTS[name], *maps(), seed)

    return Part(
        {
            f'amcl_{name}_{seed}': lambda name=name, seed=seed: case(name, seed)
            for name in AMCL_TESTS
            for seed in range(2 * seeds)
        },
        _summary,
        _verdict,
    )


def _summary(results):
    figures, lines = {}, []
    for name in AMCL_TESTS:
        of = [result for result in results if result['test'] == name]
        ended = [result for result in of if 'true' in result]
        passed = sum(not result['faults'] for result in of)
        row = {'cases': len(of), 'passed': passed}
        if ended:
            row |= {'position_m': spread([r['true'] for r in ended]), 'yaw_rad': spread([r['yaw'] for r in ended])}
        known = [r['known_from'] for r in ended if r['known_from'] is not None]
        if known and not AMCL_TESTS[name].told:
            row['known_from_s'] = spread(known)
        figures[name] = row
        lines.append(f'{name:30} {passed:3} of {len(of):3}' + _figures(row))
    return lines, figures


def _figures(row):
    spreads = (('position', 'm', 'position_m'), ('known after', 's', 'known_from_s'))
    form = '  {} {median:.3f} {}, p95 {p95:.3f}, worst {worst:.3f}'
    return ''.join(form.format(what, unit, **row[key]) for what, unit, key in spreads if key in row)


def _verdict(figures):
    return [
        f'{name}: {row["passed"]} of {row["cases"]} within the tolerance, {ACCEPTED[name]:.0%} are asked for'
        for name, row in figures.items()
        if row['passed'] < ACCEPTED[name] * row['cases']
    ]
