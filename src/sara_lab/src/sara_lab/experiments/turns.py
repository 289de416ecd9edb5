"""E6: full turns both ways by the joystick, the gyroscope's scale, and the gain k that mends it (table 4.11, figure
4.17).
"""

import numpy as np

from sara_lab.experiments import core, sensor_experiments, sensor_figures, sensor_report
from sara_lab.experiments.agreement import Figure, every_case
from sara_lab.experiments.core import (
    CONFIRMED,
    PARTLY,
    Case,
    Experiment,
    Report,
    Results,
    Row,
    interval,
    mean,
    results_of,
    spread,
)

SETTING = """
The chair turns in place to 90, 180, 270 and 360 deg, both ways, by its joystick. read.py integrates the calibrated
rate, and the angle is compared with the true one (thesis 4.2.3.3). The factor k is the slope of a line through all
angles (`canserial.calibration.gain`); one more turn each way tests it. The chairs of E7 to E10 get their k here.
"""


ENOUGH, HALF_RANGE = (
    10,
    0.0035,
)  # fewer chairs than this need not have the mean of all scales, which are within so much of it


def case(seed: int, trace: bool = False) -> dict:
    """The marks both ways, k, and another full turn each way with it; `trace`: rate and angle over time."""
    recorder = _Recorder(seed) if trace else None
    result = judged(sensor_experiments.full_turns(seed))
    if recorder:
        result['trace'] = [recorder.turn(360.0), recorder.turn(-360.0)]
    return result


def judged(turns: sensor_experiments.Turns) -> dict:
    """The result of Turns."""
    return {
        'gain': turns.gain.gain,
        'error': turns.gain.error,
        'rows': turns.gain.rows,
        'check': turns.check,
        'marks': {mark: sensor_report.at_mark(turns, mark) for mark in sensor_report.TURNS},
    }


def _figures(result):
    """What of a result is compared with a run over ROS."""
    return {
        **{Figure(f'{mark:.0f} deg is measured as, deg', 2): measured for mark, measured in result['marks'].items()},
        Figure('k', 4): result['gain'],
        Figure('left of a full turn after k, deg', 2): max(abs(measured - true) for true, measured in result['check']),
    }


def case_of(seed: int) -> Case:
    """Its Case."""
    return Case(('E6', seed), case, seed, {'trace': seed == 0})


class _Recorder(sensor_experiments.Turner):
    """A Turner that keeps what passes."""

    def __init__(self, seed):
        self.kept = []
        super().__init__(seed, calibration_time=sensor_experiments.CALIBRATION_S)

    def _step(self):
        super()._step()
        if self.reader.ready:
            self.kept.append((self.chair.time, self.reader.turned, self.chair.drive.yaw))

    def turn(self, angle):
        """(t, rate deg/s, angle deg, true deg) of a turn, at the IMU's frames."""
        del self.kept[:]
        self.start_over()
        self.turn_to(angle)
        t, turned, true = np.array(self.kept)[::20].T
        turned, true = np.degrees(turned - turned[0]), np.degrees(true - true[0])
        return t - t[0], np.gradient(turned, t), turned, true


def report(results: Results) -> Report:
    """E6's Report."""
    found = results_of(results, 'E6')
    gain = spread([result['gain'] for result in found])
    check = [abs(measured - true) for result in found for true, measured in result['check']]
    residual = max(abs(true - corrected) for result in found for true, _, corrected in result['rows'])
    faults = _faults(found, max(check))
    return Report(
        _findings(gain, max(check), residual, faults),
        (*_rows_of_marks(found), *_rows(gain)),
        (_figure(found),),
        data={'gain': gain, 'left_after_gain_deg': spread(check), 'gains': [result['gain'] for result in found]},
        faults=tuple(faults),
        short=f'k = {gain["mean"]:.3f}; with its own k a full turn is at most {max(check):.2f} deg off.',
    )


def _rows_of_marks(found):
    for mark, theirs in sensor_report.TURNS.items():
        ours = spread([result['marks'][mark] for result in found])
        yield Row(
            f'a turn of {mark:.0f} deg is measured as',
            f'{theirs:g} deg (k = {mark / theirs:.2f})',
            mean(ours, 2, 'deg') + f' (k = {mark / ours["mean"]:.3f})',
            "each chair's gyroscope has its own scale, 0.920 to 0.927",
        )


def _rows(gain):
    return [
        Row('k', '1.08 (table 4.11), 1.09 (listing)', interval(gain, 4), 'the mean over chairs'),
    ]


def _faults(found, worst):
    faults = []
    for mark, theirs in sensor_report.TURNS.items():
        ours = spread([result['marks'][mark] for result in found])
        if abs(ours['mean'] - theirs) > sensor_report.TURN_BEFORE_GAIN + (
            0.0 if len(found) >= ENOUGH else HALF_RANGE * mark
        ):
            faults.append(f'{mark:.0f} deg is read as {ours["mean"]:.2f}, the thesis has {theirs}')
    if worst > sensor_report.TURN_AFTER_GAIN:
        faults.append(f'a full turn is {worst:.2f} deg off after k')
    return faults


def _findings(gain, worst, residual, faults):
    linear = residual < 2.0
    return (
        (
            'the gyroscope measures turns too small, in proportion to the angle',
            f'{interval(gain, 3)} times; no turn is more than {residual:.1f} deg off the line',
            CONFIRMED if linear and not faults else PARTLY,
        ),
        (
            'a factor k of about 1.08 mends it',
            f"k = {gain['mean']:.3f}; with its own k a chair's full turn is at most {worst:.2f} deg off",
            CONFIRMED if not faults else PARTLY,
        ),
    )


def _figure(found):
    traced = next(result for result in found if 'trace' in result)
    return core.Figure(
        sensor_figures.name(17),
        'Rate and angle of a full turn each way, as measured and times k.',
        lambda path: sensor_figures.turn_both_ways(
            path, [(*turn, traced['gain']) for turn in traced['trace']], 'measured', 'times k ='
        ),
    )


EXPERIMENT = Experiment(
    'E6',
    'full turns and the gain k',
    SETTING,
    10,
    lambda seeds: [case_of(seed) for seed in range(seeds)],
    report,
    every_case,
    _figures,
)
