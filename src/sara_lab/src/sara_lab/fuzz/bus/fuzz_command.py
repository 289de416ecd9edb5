"""`rosrun sara_lab fuzz_bus --count 1000000 --seed 0`: random bytes and frames into all that reads the bus."""

import argparse
import time

from canserial.dbc.bus import PACKAGED, BusDescription
from sara_lab.fuzz.bus.frames import fuzz_reader
from sara_lab.fuzz.bus.lawicel import fuzz_lawicel

BLOCK = 10000


def main(arguments: list[str] | None = None) -> None:
    """Run the fuzz tests; a failure ends with its seed and input."""
    from tqdm import tqdm

    parser = argparse.ArgumentParser(prog='fuzz', description=__doc__)
    parser.add_argument('--count', type=int, default=20000, help='inputs of each kind (default: %(default)s)')
    parser.add_argument('--seed', type=int, default=0)
    options = parser.parse_args(arguments)
    if options.count < 1:
        parser.error(f'--count is {options.count}, allowed are whole numbers above 0')
    kinds = {'lines through the Lawicel path': (lambda count, seed: fuzz_lawicel(count, seed), 'frames')}
    for name in PACKAGED:
        kinds[f'frames through the reader ({name})'] = (
            lambda count, seed, bus=BusDescription.named(name): fuzz_reader(count, seed, bus),
            'readings',
        )
    for title, (run, what) in kinds.items():
        start, came = time.monotonic(), 0
        with tqdm(total=options.count, desc=title, delay=1.0, disable=None) as progress:
            for number, first in enumerate(range(0, options.count, BLOCK)):
                size = min(BLOCK, options.count - first)
                came += run(size, options.seed * 1000000 + number)
                progress.update(size)
        print(f'{options.count} {title}: {came} {what}, no failure, {time.monotonic() - start:.1f} s')
