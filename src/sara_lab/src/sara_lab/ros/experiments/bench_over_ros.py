"""E1 to E6 over ROS: the same chips under canserial.py and read.py, and of what is heard the results that the cases
give in lockstep.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from canserial.calibration.gain import GainProcedure
from canserial.dbc.bus import BusDescription
from sara_lab.experiments import orientation, rest, sensor_experiments, turns
from sara_lab.experiments.sensor_experiments import CALIBRATION_S, AtRest, Turns, integrated
from sara_lab.ros.experiments.beside import beside

if TYPE_CHECKING:
    from sara_lab.experiments.core import Case

LONGEST_S = {
    'before': 75.0,
    'after': 65.0,
    'yaw': 160.0,
    'turns': 300.0,
    'filters': 160.0,
}  # of the chair's time, about


def run_case(case: Case, speed: float, say: Callable[[str], None]) -> dict:
    """The result of a case of E1 to E6. Raises OverRosError."""
    return {rest.rest_case: _rest, rest.yaw_case: _yaw, orientation.case: _filters, turns.case: _turns}[case.function](
        lambda task, **launch: heard(task, case.seed, speed, say, **launch)
    )


def heard(task: str, seed: int, speed: float, say: Callable[[str], None] = lambda text: None, **launch) -> Any:
    """What bench_node.py leaves of one of its TASKS with the chair `seed`; `launch`: arguments of bench_top.launch.
    Raises OverRosError.
    """
    say(task)
    with tempfile.TemporaryDirectory(prefix='sara_') as name:
        folder = Path(name)
        arguments = {
            'seed': seed,
            'speed': speed,
            'port': folder / 'can',
            'calibration_file': folder / 'calibration.yaml',
            **launch,
        }
        return beside(
            ('sara_lab', 'bench_top.launch', arguments),
            ('sara_lab.ros.experiments.bench_node', task),
            folder,
            LONGEST_S[task] / speed,
            say,
        )


def _rest(hear):
    bus = BusDescription.default()
    found = {'before': hear('before', calibrate='false'), 'after': hear('after')}
    return rest.moments({when: AtRest.of(bus.decode(frame) for frame in frames) for when, frames in found.items()})


def _yaw(hear):
    bus, wanted = BusDescription.default(), BusDescription.default().id_of('IMPACT_GYRO')
    _, rate, yaw = integrated(
        *np.array([(frame.time, bus.decode(frame)[1]['gz']) for frame in hear('after') if frame.id == wanted]).T
    )
    t, pc = hear('yaw', calibrate='false', calibration_time=CALIBRATION_S)
    pc = np.degrees(pc - pc[0])
    return {
        'node': {'rate': rate, 'end': float(yaw[-1])},
        'pc': [{'rate': float(pc[-1] / (t[-1] - t[0])), 'end': float(pc[-1])}],
    }


def _filters(hear):
    arrays = []
    for frames, yaws in hear('filters'):
        listener = orientation.Listener(BusDescription.default())
        for frame, yaw in zip(frames, yaws):
            listener.on_frame(frame, yaw)
        arrays.append(listener.arrays())
    return orientation.compared(arrays[0], arrays[1:])


def _turns(hear):
    marks, check = hear('turns', calibration_time=sensor_experiments.CALIBRATION_S)
    procedure = GainProcedure()
    for true, measured in marks:
        procedure.add(true, measured)
    gain = procedure.result()
    return turns.judged(Turns(gain, tuple((true, gain.gain * measured) for true, measured in check)))
