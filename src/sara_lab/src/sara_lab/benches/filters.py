"""The filters' core: predict and correct, in a compiled loop and called one by one from Python; and frames decoded.

The cases are the peer's: (x, y, vx) with the seven variables off the plane forced to zero, and (yaw, vyaw); dt 0.01 s,
variances 0.01.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

from canserial.dbc.bus import BusDescription
from sara_lab.benches import filter_core as bench_core
from sara_lab.benches.peers import peers
from sara_lab.benches.timed import Limit, timed

if TYPE_CHECKING:
    from sara_lab.benches.timed import Clock, Timed

COLUMNS = {
    'x, y, vx and forced zeros': 'predict_and_correct_planar_x_y_vx_plus_forced_zeros',
    'yaw, vyaw': 'predict_and_correct_imu_yaw_vyaw',
}
WAYS = {
    'ekf': (
        ('in the compiled loop', bench_core.in_a_loop, Limit('ratio', 0.5)),
        ('called from Python', bench_core.one_by_one, Limit('ratio', 1.0)),
        ('by filterpy', bench_core.by_filterpy, None),
    ),
    'ukf': (
        ('in the compiled loop', bench_core.in_a_loop, None),
        ('called from Python', bench_core.one_by_one, Limit('ratio', 1.5)),
        ('by filterpy', bench_core.by_filterpy, None),
    ),
}
CALLS, BLOCKS = 2000, 25
SLOWER = 20  # times: so many calls fewer of filterpy


def filter_core(calls: int = CALLS, blocks: int = BLOCKS, clock: Clock = time.process_time) -> Iterator[Timed]:
    """us of a predict with a correct."""
    for kind, ways in WAYS.items():
        for case, column in COLUMNS.items():
            for way, run, limit in ways:
                count = calls // SLOWER if run is bench_core.by_filterpy else calls
                work = run(kind, case, count)
                work()  # kernels are loaded
                taken = []
                for _ in range(blocks):
                    begin = clock()
                    work()
                    taken.append(1e6 * (clock() - begin) / count)
                yield timed(
                    f'{kind.upper()} predict + correct of {case}, {way}',
                    'us',
                    taken,
                    peer=peers()['filter_us_per_call'][kind][column],
                    limit=limit,
                )


def frames(count: int = 2000, blocks: int = 25, clock: Clock = time.process_time) -> Iterator[Timed]:
    """Encoder frames of the bus decoded per second."""
    bus = BusDescription.default()
    coded = [bus.encode('ENCODER_LEFT', steps=number, time=1000 * number) for number in range(count)]
    rates = []
    for _ in range(blocks):
        begin = clock()
        for frame in coded:
            bus.decode(frame)
        rates.append(count / (clock() - begin))
    yield timed('frames decoded', '/s', rates, rate=True)
