"""The campaign's part `kidnapped`: robots that are carried away; whether amcl notices, and finds its place again."""

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

from sara_lab.campaign.part import Figures, Part, mean, spread
from sara_lab.journeys.travel_cases import MAPS
from sara_lab.studies.carried import GROUPS, Case, Step, drive
from sara_lab.studies.consistency import CONSISTENT, QUANTILE, reliability

NOTICED, FOUND = (5.0, 0.95), (25.0, 0.90)  # m of driving; share of the robots
AMONG_PEOPLE = 0.05  # by so much less
IS_LOST, IS_FOUND = 0.5, 0.2  # probability of being lost
ERROR = 0.05  # greatest expected calibration error


def kidnapped(seeds: int, _folder: Path) -> Part:
    """Each map with each of GROUPS; as many robots as chairs and a third more: 201 in a group's three maps with 50."""
    robots = -(-4 * seeds // 3)
    return Part(
        {
            f'kidnapped_{case.heading}_{case.map}_{_people(case.people)}_{case.number}': lambda case=case: judged(
                case, list(drive(case))
            )
            for (heading, people), name, number in product(GROUPS, MAPS, range(robots))
            for case in [Case(name, number, people, heading=heading)]
        },
        _summary,
        _verdict,
    )


def judged(case: Case, steps: Sequence[Step]) -> dict[str, Any]:
    """{map, people, heading; noticed, found: m of driving after which it was, None where it was not: found is from
    where on the pose is right to the end and counts as found as in move_base, from a probability below IS_FOUND on and
    never above IS_LOST; alarms: how often the probability was above IS_LOST at a right pose before, of how many
    `before`; moments: [[probability, whether the pose is wrong]]; nees: of amcl_pose while the robot is tracked}.
    """
    before, after = ([step for step in steps if (step.after is None) == first] for first in (True, False))
    found = None
    for step in after:
        if step.wrong or step.probability > IS_LOST:
            found = None
        elif found is None and step.probability < IS_FOUND:
            found = step.after
    return {
        'map': case.map,
        'people': case.people,
        'heading': case.heading,
        'noticed': next((step.after for step in after if step.probability > IS_LOST), None),
        'found': found,
        'before': len(before),
        'alarms': sum(step.probability > IS_LOST and not step.wrong for step in before),
        'moments': [[round(step.probability, 4), step.wrong] for step in steps],
        'nees': [round(step.nees, 3) for step in before if step.nees is not None],
        'faults': [],
    }


def _row(of) -> Figures:
    row = {'cases': len(of), 'alarms': sum(r['alarms'] for r in of), 'before': sum(r['before'] for r in of)}
    for what, (limit, _) in (('noticed', NOTICED), ('found', FOUND)):
        ways = [result[what] for result in of if result[what] is not None]
        row[what] = sum(way <= limit for way in ways)
        if ways:
            row[f'{what}_m'] = spread(ways)
    row['calibration_error'] = reliability([moment for result in of for moment in result['moments']])[1]
    values = [value for result in of for value in result['nees']]
    row |= {'nees': mean(values), 'within_nees': mean([value <= QUANTILE for value in values])}
    return row


def _summary(results):
    figures, lines = {}, []
    for (heading, people), name in product(GROUPS, (*MAPS, 'all')):
        of = [r for r in results if (r['heading'], r['people']) == (heading, people) and name in (r['map'], 'all')]
        if not of:
            continue
        key = f'{heading}_{_people(people)}_{name}'
        figures[key] = row = _row(of)
        lines.append(
            f'{key:20} noticed {row["noticed"]:3} and found {row["found"]:3} of {row["cases"]:3}; false alarms at '
            f'{row["alarms"]:3} of {row["before"]:5} scans; calibration error {row["calibration_error"]:.3f}; NEES '
            f'{row["nees"]:.2f}, {row["within_nees"]:.1%} within the 95 % quantile'
        )
    rows, error = reliability([moment for result in results for moment in result['moments']])
    figures['calibration_error'] = error
    lines += [f'{n:6} scans: probability {p:.3f}, wrong {wrong:.3f}' for n, p, wrong in rows]
    return lines, figures


def _people(about):
    return 'people' if about else 'alone'


def _verdict(figures):
    """Without a gyro nobody can tell places apart that look alike under a turn: there only noticing is asked for."""
    found = []
    for heading, people in GROUPS:
        key, less = f'{heading}_{_people(people)}_all', AMONG_PEOPLE if people else 0.0
        row = figures[key]
        for what, (_, share) in {'noticed': NOTICED, **({'found': FOUND} if heading == 'gyro' else {})}.items():
            if row[what] < (share - less) * row['cases']:
                found.append(f'{key}: {what} {row[what]} of {row["cases"]}, {share - less:.0%} are asked for')
        if not row['within_nees'] >= CONSISTENT:
            found.append(f'{key}: {row["within_nees"]:.1%} of the poses are as right as they claim, 95% are asked for')
    if figures['calibration_error'] > ERROR:
        found.append(f'the calibration error is {figures["calibration_error"]:.3f}, {ERROR:g} is allowed')
    return found
