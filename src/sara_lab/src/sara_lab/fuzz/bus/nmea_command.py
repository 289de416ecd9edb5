"""`rosrun sara_lab fuzz_nmea --count 1000000 --seed 0`: nonsense at a GPS receiver's port."""

from sara_lab.fuzz.blocks import run
from sara_lab.fuzz.bus.nmea import fuzz_nmea


def main(arguments: list[str] | None = None) -> None:
    """Run the fuzz test; a failure ends with its seed and input."""
    run(arguments, 'nmea', __doc__, fuzz_nmea)
