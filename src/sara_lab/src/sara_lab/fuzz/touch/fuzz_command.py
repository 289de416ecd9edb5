"""`rosrun sara_lab fuzz_hmi --count 1000000 --seed 0`: random frames against the touch screen's server."""

import resource
import time

from sara_lab.fuzz.blocks import blocks, options_of
from sara_lab.fuzz.touch.frames import fuzz_hub

BLOCK = 5000


def main(arguments: list[str] | None = None) -> None:
    """Run the fuzz tests; a failure ends with its seed."""
    options = options_of(arguments, 'fuzz_hmi', __doc__, 'frames of each kind')
    for title, strangers in (('frames of strangers', True), ('frames of pages', False)):
        start, came, before = time.monotonic(), 0, 0
        for size, seed in blocks(options, title, BLOCK):
            came += fuzz_hub(size, seed, strangers)
            before = before or memory_mb()
        print(
            f'{options.count} {title}: {came} actions, no failure, {time.monotonic() - start:.1f} s, '
            f'memory {before:.1f} MB after the first {BLOCK}, {memory_mb():.1f} MB after all'
        )


def memory_mb() -> float:
    """The most memory that this process has had."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
