"""`rosrun sara_lab fuzz_amcl --count 1000000 --seed 0`: scans, maps, poses and parameters at random against amcl."""

from sara_lab.fuzz import blocks
from sara_lab.fuzz.localization.fuzz_amcl import fuzz_amcl


def main(arguments: list[str] | None = None) -> None:
    """Run the fuzz; status 1 with a sentence for each fault."""
    blocks.run(arguments, 'amcl', __doc__, fuzz_amcl)
