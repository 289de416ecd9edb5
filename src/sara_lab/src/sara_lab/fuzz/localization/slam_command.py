"""`rosrun sara_lab fuzz_slam --count 1000000 --seed 0`: random scans, odometry and parameters at slam_gmapping."""

from sara_lab.fuzz import blocks
from sara_lab.fuzz.localization.fuzz_slam import fuzz_slam


def main(arguments: list[str] | None = None) -> None:
    """Run the fuzz; status 1 with a sentence for each fault."""
    blocks.run(arguments, 'slam', __doc__, fuzz_slam)
