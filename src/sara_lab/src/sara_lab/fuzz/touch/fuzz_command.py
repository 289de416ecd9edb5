"""`rosrun sara_lab fuzz_hmi --count 1000000 --seed 0`: random frames against the touch screen's server."""

import argparse
import resource
import time

from sara_lab.fuzz.touch.frames import fuzz_hub

BLOCK = 5000


def main(arguments: list[str] | None = None) -> None:
    """Run the fuzz tests; a failure ends with its seed."""
    from tqdm import tqdm

    parser = argparse.ArgumentParser(prog='fuzz_hmi', description=__doc__)
    parser.add_argument('--count', type=int, default=20000, help='frames of each kind (default: %(default)s)')
    parser.add_argument('--seed', type=int, default=0)
    options = parser.parse_args(arguments)
    if options.count < 1:
        parser.error(f'--count is {options.count}, allowed are whole numbers above 0')
    for title, strangers in (('frames of strangers', True), ('frames of pages', False)):
        start, came, before = time.monotonic(), 0, 0
        with tqdm(total=options.count, desc=title, delay=1.0, disable=None) as progress:
            for number, first in enumerate(range(0, options.count, BLOCK)):
                size = min(BLOCK, options.count - first)
                came += fuzz_hub(size, options.seed * 1000000 + number, strangers)
                before = before or memory_mb()
                progress.update(size)
        print(
            f'{options.count} {title}: {came} actions, no failure, {time.monotonic() - start:.1f} s, '
            f'memory {before:.1f} MB after the first {BLOCK}, {memory_mb():.1f} MB after all'
        )


def memory_mb() -> float:
    """The most memory that this process has had."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
