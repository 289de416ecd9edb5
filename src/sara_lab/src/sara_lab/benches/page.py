"""docs/bench.md, made of the rows."""

from sara_lab.benches.table import markdown
from sara_lab.benches.timed import PEERS_YARDSTICK_MS

HEAD = f"""# How fast SARA is

Written by `rosrun sara_lab bench --save-baseline` (`make bench` measures the same and leaves this page alone; `--check` names what got slower).

Every figure stands between two runs of the yardstick, a fixed piece of work, because the speed of a machine swings, by a factor of two here. "At the
peers' speed" is the median on a machine whose yardstick takes {PEERS_YARDSTICK_MS:.0f} ms, as where the C++ peers were timed; the ratio is that by the peer's figure
(for rates the other way round), so that less than 1 is faster than the peer. Limits on times and shares of a core are judged at the peers' speed, those
on seconds from launch to motion, on latencies of goals and on memory as they are. Times are CPU times of the process; of nodes, their share of one core. p99: for
rates the slowest hundredth. MB: the most memory that the measured process held.

"""


def page(rows, image):
    """The page; image: path of the figure of growth, or None."""
    missed = [row.name for row in rows if row.met is False]
    text = HEAD + markdown(rows)
    text += '\nNot met: ' + ('; '.join(missed) if missed else 'nothing') + '.\n'
    if image:
        text += f'\n## How cost grows\n\n![time over size]({image})\n\nThe exponents are slopes of straight lines through all points: n^1 costs twice as much for twice as many.\n'
    return text
