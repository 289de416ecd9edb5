"""`make bench`: how long the parts take, as medians, and as multiples of a yardstick timed in the same run.

The yardstick is a fixed piece of plain Python and numpy; a ratio to it says more than microseconds of one machine.
"""
import json
import sys
import time
from pathlib import Path

import numpy as np

from canserial.bus import BusDescription
from sara_bringup import bench_navigation
from sara_bringup.experiment import run


def yardstick():
    """A fixed amount of work: small matrix products called from Python, a sort of a million doubles, a sum in plain Python."""
    random = np.random.default_rng(0)
    step, matrix = random.standard_normal((15, 15)), np.eye(15)
    for _ in range(20_000):
        matrix = step @ matrix
        matrix /= 1.0 + abs(matrix[0, 0])
    np.sort(random.standard_normal(1_000_000))
    return sum(number * number for number in range(400_000))


def median_s(work, runs, clock=time.perf_counter):
    """Median of the seconds that `work()` takes by a clock, and the runs."""
    taken = []
    for _ in range(runs):
        start = clock()
        work()
        taken.append(clock() - start)
    return float(np.median(taken))


def decode_thousand():
    """Decode 1000 encoder frames."""
    bus = BusDescription.default()
    frames = [bus.encode("ENCODER_LEFT", steps=number, time=1000 * number) for number in range(1000)]
    return lambda: [bus.decode(frame) for frame in frames]


def main():
    """Print the table and write out/bench.json."""
    out = Path("out")
    out.mkdir(exist_ok=True)
    _, lockstep = run("square", 0)  # compiles or loads what is compiled, too
    rows = {"yardstick": median_s(yardstick, 9), "1000 frames decoded": median_s(decode_thousand(), 9),
            "the square in lockstep, seed 0": median_s(lambda: run("square", 0), 3)}
    print(f"{'':34} {'median s':>10} {'yardsticks':>11}")
    for name, seconds in rows.items():
        print(f"{name:34} {seconds:10.4f} {seconds / rows['yardstick']:11.2f}")
    print(f"the square in lockstep: {lockstep.time / rows['the square in lockstep, seed 0']:.0f} times real time, without the start of the process")
    # The process's own time, as navigation's figures are.
    navigation = bench_navigation.table(1e3 * median_s(yardstick, 9, time.process_time))
    (out / "bench.json").write_text(json.dumps({**rows, "navigation": navigation}, indent=1))
    sys.exit(0)
