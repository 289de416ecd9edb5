"""Parts of the campaign that judge the filters: fuzz and NEES."""

from pathlib import Path

from sara_lab.campaign.part import Part, lines_of
from sara_lab.fuzz.localization import fuzz
from sara_lab.studies import consistency

FUZZ_MESSAGES, FUZZ_CASES = 1_000_000, 20


def filter_fuzz(_seeds: int, _folder: Path) -> Part:
    """A million random messages through EKF and UKF, whatever the number of chairs."""

    def case(seed):
        report = fuzz.fuzz(FUZZ_MESSAGES // FUZZ_CASES, seed)
        return {'messages': report.messages, 'faults': [str(fault) for fault in report.faults]}

    return Part({f'filter_fuzz_{seed}': lambda seed=seed: case(seed) for seed in range(FUZZ_CASES)}, _fuzz_summary)


def _fuzz_summary(results):
    figures = {'messages': sum(result['messages'] for result in results)}
    return lines_of(figures), figures


def nees(seeds: int, _folder: Path) -> Part:
    """Whether the filters are as sure as they may be: NEES of (x, y, yaw), the truth drawn from their own model; twice
    as many seeds as chairs.
    """

    def case(kind):
        mean, low, high = consistency.nees_campaign(range(2 * seeds), kind)
        return {
            'filter': kind,
            'mean': mean,
            'low': low,
            'high': high,
            'faults': [] if low <= mean <= high else [f'mean NEES {mean:.2f}, allowed are {low:.2f} to {high:.2f}'],
        }

    return Part({f'nees_{kind}_{2 * seeds}': lambda kind=kind: case(kind) for kind in ('ekf', 'ukf')}, _nees_summary)


def _nees_summary(results):
    figures = {result['filter']: {key: result[key] for key in ('mean', 'low', 'high')} for result in results}
    return lines_of(figures), figures
