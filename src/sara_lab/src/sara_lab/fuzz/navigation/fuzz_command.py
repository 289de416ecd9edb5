"""`rosrun sara_lab fuzz_navigation --count 100000 --seed 0`: goals, maps, sensor messages and cancels at random against
move_base.
"""

import argparse
import time

from sara_lab.fuzz.navigation.fuzz import fuzz_move_base

BLOCK = 10000


def main(arguments: list[str] | None = None) -> None:
    """Run the fuzz; a failure ends with its seed and input."""
    from tqdm import tqdm

    parser = argparse.ArgumentParser(prog='fuzz', description=__doc__)
    parser.add_argument('--count', type=int, default=20000, help='inputs (default: %(default)s)')
    parser.add_argument('--seed', type=int, default=0)
    options = parser.parse_args(arguments)
    if options.count < 1:
        parser.error(f'--count is {options.count} but must be at least 1')
    began, tally = time.monotonic(), {}
    with tqdm(total=options.count, desc='inputs to move_base', delay=1.0, disable=None) as progress:
        for number, first in enumerate(range(0, options.count, BLOCK)):
            size = min(BLOCK, options.count - first)
            for what, often in fuzz_move_base(size, options.seed * 1000000 + number).items():
                tally[what] = tally.get(what, 0) + often
            progress.update(size)
    seen = ', '.join(f'{what} {often}' for what, often in sorted(tally.items()))
    print(f'{options.count} inputs to move_base, no failure, {time.monotonic() - began:.1f} s: {seen}')
