"""`rosrun sara_lab fuzz_amcl --count 1000000 --seed 0`: scans, maps, poses and parameters at random against amcl."""

import sys
import time
from collections import Counter

from sara_lab.fuzz.blocks import blocks, options_of
from sara_lab.fuzz.localization.fuzz_amcl import fuzz_amcl

BLOCK = 20000


def main(arguments: list[str] | None = None) -> None:
    """Run the fuzz; status 1 with a sentence for each fault."""
    options = options_of(arguments, 'fuzz_amcl', __doc__, 'inputs')
    began, kinds = time.monotonic(), Counter()
    for size, seed in blocks(options, 'inputs to amcl', BLOCK):
        report = fuzz_amcl(size, seed)
        if report.faults:
            sys.exit(f'seed {seed}: ' + '\n'.join(report.faults))
        kinds.update(report.kinds)
    seen = ', '.join(f'{what} {often}' for what, often in sorted(kinds.items()))
    print(f'{options.count} inputs to amcl, no failure, {time.monotonic() - began:.1f} s: {seen}')
