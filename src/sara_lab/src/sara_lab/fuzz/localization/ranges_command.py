"""`rosrun sara_lab fuzz_ranges --count 1000000 --seed 0`: ranges, dead reckoning, maps and parameters at random against
range_localization.
"""

from sara_lab.fuzz import blocks
from sara_lab.fuzz.localization.fuzz_ranges import fuzz_ranges


def main(arguments: list[str] | None = None) -> None:
    """Run the fuzz; status 1 with a sentence for each fault."""
    blocks.run(arguments, 'ranges', __doc__, fuzz_ranges)
