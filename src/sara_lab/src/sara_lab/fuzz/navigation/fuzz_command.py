"""`rosrun sara_lab fuzz_navigation --count 100000 --seed 0`: goals, maps, sensor messages and cancels at random against
move_base.
"""

import time

from sara_lab.fuzz.blocks import blocks, options_of
from sara_lab.fuzz.navigation.fuzz import fuzz_move_base

BLOCK = 10000


def main(arguments: list[str] | None = None) -> None:
    """Run the fuzz; a failure ends with its seed and input."""
    options = options_of(arguments, 'fuzz', __doc__, 'inputs')
    began, tally = time.monotonic(), {}
    for size, seed in blocks(options, 'inputs to move_base', BLOCK):
        for what, often in fuzz_move_base(size, seed).items():
            tally[what] = tally.get(what, 0) + often
    seen = ', '.join(f'{what} {often}' for what, often in sorted(tally.items()))
    print(f'{options.count} inputs to move_base, no failure, {time.monotonic() - began:.1f} s: {seen}')
