"""`rosrun sara_lab fuzz_navsat --count 1000000 --seed 0`: fixes, headings and clocks at random against
navsat_transform_node.
"""

import sys
import time
from collections import Counter

from sara_lab.fuzz.blocks import blocks, options_of
from sara_lab.fuzz.localization.fuzz_navsat import fuzz_navsat

BLOCK = 20000


def main(arguments: list[str] | None = None) -> None:
    """Run the fuzz; status 1 with a sentence for each fault."""
    options = options_of(arguments, 'fuzz_navsat', __doc__, 'inputs')
    began, kinds = time.monotonic(), Counter()
    for size, seed in blocks(options, 'inputs to navsat', BLOCK):
        report = fuzz_navsat(size, seed)
        if report.faults:
            sys.exit(f'seed {seed}: ' + '\n'.join(report.faults))
        kinds.update(report.kinds)
    seen = ', '.join(f'{what} {often}' for what, often in sorted(kinds.items()))
    print(f'{options.count} inputs to navsat, no failure, {time.monotonic() - began:.1f} s: {seen}')
