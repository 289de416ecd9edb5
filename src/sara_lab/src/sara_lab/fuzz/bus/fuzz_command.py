"""`rosrun sara_lab fuzz_bus --count 1000000 --seed 0`: random bytes and frames into all that reads the bus."""

import time

from canserial.dbc.bus import BusDescription, packaged
from sara_lab.fuzz.blocks import blocks, options_of
from sara_lab.fuzz.bus.frames import fuzz_reader
from sara_lab.fuzz.bus.lawicel import fuzz_lawicel

BLOCK = 10000


def main(arguments: list[str] | None = None) -> None:
    """Run the fuzz tests; a failure ends with its seed and input."""
    options = options_of(arguments, 'fuzz', __doc__)
    kinds = {'lines through the Lawicel path': (lambda count, seed: fuzz_lawicel(count, seed), 'frames')}
    for name in packaged():
        kinds[f'frames through the reader ({name})'] = (
            lambda count, seed, bus=BusDescription.named(name): fuzz_reader(count, seed, bus),
            'readings',
        )
    for title, (run, what) in kinds.items():
        start, came = time.monotonic(), 0
        for size, seed in blocks(options, title, BLOCK):
            came += run(size, seed)
        print(f'{options.count} {title}: {came} {what}, no failure, {time.monotonic() - start:.1f} s')
