"""`experiment E1` to `E10` and `all`: lockstep runs over several chairs, and runs over ROS; pages, figures and JSON."""

import signal
import sys
from argparse import Namespace
from pathlib import Path

from tqdm import tqdm

from sara_bringup.paths import share
from sara_common import platforms
from sara_lab.campaign.results import rows
from sara_lab.experiments import agreement, pages, runner, turns
from sara_lab.experiments.registry import EXPERIMENTS
from sara_lab.workers.sources import fingerprint, folder_of


def pages_folder() -> Path:
    """Where the pages of the experiments belong: docs/experiments of the workspace, or of the working directory where
    there is none.
    """
    docs = share().parents[1] / 'docs'
    return (docs if docs.is_dir() else Path('docs')) / 'experiments'


def run(arguments: Namespace, speed: float) -> list[str]:
    """Run what the command line asks for, over ROS at `speed` times real time; sentences about what must hold and does
    not.
    """
    chosen = list(EXPERIMENTS.values()) if arguments.name == 'all' else [EXPERIMENTS[arguments.name]]
    cases = {experiment.name: experiment.cases(arguments.seeds or experiment.seeds) for experiment in chosen}
    folder = arguments.out or pages_folder()
    failed = _over_ros(arguments, chosen, folder, speed) if arguments.ros else []
    over_ros = {
        experiment.name: agreement.load(experiment.name, folder) or agreement.load(experiment.name, pages_folder())
        for experiment in chosen
    }
    to_run = {
        case.key: case
        for experiment in chosen
        for case in (*cases[experiment.name], *agreement.references(experiment, over_ros[experiment.name]))
    }
    costs = {}
    results = runner.run(
        list(to_run.values()),
        arguments.where,
        lambda total: tqdm(total=total, unit='run', smoothing=0.05),
        arguments.keep,
        costs,
    )
    if arguments.keep:
        _write_rows(arguments.keep, list(to_run.values()), results)
    faults = []
    for experiment in chosen:
        report = experiment.report(results)
        if experiment.figures:
            side = agreement.side(experiment, cases[experiment.name], results)
            report = agreement.with_ros(report, experiment.name, side, over_ros[experiment.name])
        seeds = arguments.seeds or experiment.seeds
        written = pages.write(experiment, report, folder, seeds)
        cost = sum(costs.get(case.key, 0.0) for case in cases[experiment.name])
        print(
            f'{experiment.name}, {experiment.title}: {report.verdict} ({seeds} chairs, {cost:.0f} s of CPU; '
            f'{folder / written[0]}, {len(report.figures)} figures)',
            flush=True,
        )
        faults += [f'{experiment.name}: {fault}' for fault in report.faults]
    pages.summary(EXPERIMENTS, folder)
    return faults + failed


def _write_rows(keep, cases, results):
    """The rows of each experiment that has runs of its own, beside what is kept of these."""
    origin = rows.Origin(platforms.chosen().name, fingerprint(), rows.commit())
    for name in dict.fromkeys(case.key[0] for case in cases):
        of = {
            ' '.join(map(str, case.key)): {**case.options, **results[case.key], 'seed': case.seed}
            for case in cases
            if case.key[0] == name
        }
        rows.write(folder_of(keep) / f'{name}{rows.SUFFIX}', rows.rows(origin, name, of))


def _over_ros(arguments, chosen, folder, speed):
    """Run what is chosen over ROS and put its figures beside the pages; sentences about what came to nothing."""
    from sara_lab.ros.experiments.beside import OverRosError
    from sara_lab.ros.experiments.course_over_ros import BUSY
    from sara_lab.ros.experiments.run_case import run_case

    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that what was started is ended
    cases = _cases_over_ros(arguments, chosen)
    if not cases:
        which = f': no set-up is called {" or ".join(arguments.only)}' if arguments.only else ''
        return [f'nothing is there to run over ROS{which}']
    gains = _gains(arguments, cases)
    failed, done_before = [], {}
    with tqdm(total=len(cases), unit='run over ROS', smoothing=0.05) as done:
        for experiment, case in cases:
            name = ' '.join(map(str, case.key))
            done.set_description(name)

            def say(text, name=name):
                done.set_postfix_str(text)
                if text.startswith(BUSY):
                    tqdm.write(f'{name}: {text}', file=sys.stderr)

            try:
                if case.key not in done_before:  # E1 and E2, E4 and E5 have their runs in common
                    done_before[case.key] = run_case(case, gains.get(case.seed) if case.gain else None, speed, say)
                result = done_before[case.key]
                agreement.store(experiment.name, folder, {case.key: experiment.figures(result)}, speed)
            except OverRosError as error:
                failed.append(f'{name}: {error}')
                tqdm.write(failed[-1], file=sys.stderr)
            done.update()
    return failed


def _cases_over_ros(arguments, chosen):
    """[(experiment, case)] of what is run over ROS: what --only names, else what the experiment chooses."""
    return [
        (experiment, case)
        for experiment in chosen
        if experiment.over_ros
        for case in experiment.cases(arguments.ros)
        if (any(word in case.key for word in arguments.only) if arguments.only else experiment.over_ros(case.key))
    ]


def _gains(arguments, cases):
    """{seed: gain of that chair's gyro} where a case needs it."""
    results = runner.run(
        [turns.case_of(seed) for seed in sorted({case.seed for _, case in cases if case.gain})],
        arguments.where,
        lambda total: tqdm(total=total, unit='gain', disable=not total),
        arguments.keep,
    )
    return {seed: result['gain'] for (_, seed), result in results.items()}
