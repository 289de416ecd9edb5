"""`rosrun sara_lab fuzz_compass --count 1000000 --seed 0`: nonsense into the compass and its calibration."""

from sara_lab.fuzz.blocks import run
from sara_lab.fuzz.bus.compass import fuzz_compass


def main(arguments: list[str] | None = None) -> None:
    """Run the fuzz test; a failure ends with its seed and input."""
    run(arguments, 'compass', __doc__, fuzz_compass)
