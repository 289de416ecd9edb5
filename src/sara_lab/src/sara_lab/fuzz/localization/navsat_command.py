"""`rosrun sara_lab fuzz_navsat --count 1000000 --seed 0`: fixes, headings and clocks at random against
navsat_transform_node.
"""

from sara_lab.fuzz import blocks
from sara_lab.fuzz.localization.fuzz_navsat import fuzz_navsat


def main(arguments: list[str] | None = None) -> None:
    """Run the fuzz; status 1 with a sentence for each fault."""
    blocks.run(arguments, 'navsat', __doc__, fuzz_navsat)
