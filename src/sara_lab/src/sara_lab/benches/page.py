"""docs/bench.md, made of the rows: a summary of at most 28 lines; every figure is in the JSON file beside it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

from sara_lab.benches import growth
from sara_lab.benches.table import number, wanted
from sara_lab.benches.timed import PEERS_YARDSTICK_MS

if TYPE_CHECKING:
    from sara_lab.benches.timed import Row

HEAD = f"""# How fast SARA is

Written by `rosrun sara_lab bench --save-baseline` with [bench.json](bench.json), which holds every case, the peers'
times and remarks. `make bench` measures the same into out/; with `CHECK=1` it fails on what got slower.

Times are CPU times; nodes take shares of one core. This machine's speed varies by a factor of two, so a yardstick, a
fixed piece of work, is timed beside each figure. Figures are those of the machine on which the C++ peers were timed
(yardstick {PEERS_YARDSTICK_MS:.0f} ms); latencies, start-up and memory are as measured. Ratio: the median by the peer's
(inverse for rates); below 1 is faster. Brackets: how many cases give the range.

"""
COLUMNS = ('', 'median', 'worst p99', 'ratio', 'wanted')
LINES = {  # what a line is called: the names of its rows
    'EKF predict + correct, compiled loop': r'EKF predict.* in the compiled loop',
    'EKF predict + correct, called from Python': r'EKF predict.* called from Python',
    'UKF predict + correct': r'UKF predict',
    'live EKF and UKF node, 50 Hz out, 50 + 100 Hz in': r'[eu]kf_localization_node',
    'memory of a filter, of slam_gmapping, of the touch screen': r'memory of ([eu]kf_local|slam_g|the touch)',
    'the whole stack with the simulator, driving; composed': r'the whole stack.*driving$',
    'memory of the whole stack; composed': r'memory of the whole stack',
    'offline filters over a recorded drive': r'offline [EU]KF over test1',
    'amcl: a scan, 5000 particles x 60 beams': r'amcl, 5000',
    'inflation of 1000 x 1000 cells': r'inflation',
    'plan: NavfnROS': r'plan on \w+: NavfnROS$',
    'plan: NavfnROS, A*': r'plan on \w+: NavfnROS, A\*',
    'plan: GlobalPlanner': r'plan on \w+: GlobalPlanner',
    'plan: LatticePlanner': r'plan on \w+: LatticePlanner',
    'cycle of TrajectoryPlannerROS, DWAPlannerROS': r'cycle of (Trajectory|DWA)Planner',
    'trajectories scored by them': r'trajectories scored',
    'touch screen: finger to command, stop to gate, state to a viewer': (
        r"a page's (frame|stop) to|a (finger|press of stop) in Chromium|a state to the other"
    ),
}
JSON_ONLY = (
    r'a bare rospy node|encoder frame to|CPU of all|node \w+, driving|offline EKF over a made-up|poses on a page|'
    r'goal to first command|frames decoded|update with|plan on \w+: GridPlanner|.* by filterpy|'
    r'shared control: a costmap'
)


def page(rows: Sequence[Row], image: str) -> str:
    """The page; image: path of the figure of growth, or None."""
    missed = [row.name for row in rows if row.met is False]
    lines = summary(rows)
    text = HEAD + '\n'.join([_row(COLUMNS), '|' + '---|' * len(COLUMNS), *(_row(_cells(*line)) for line in lines)])
    text += '\n\n' + ''.join(f'- {row.name}: not measured: {row.text}\n' for row in rows if row.skipped)
    text += '\nNot met: ' + ('; '.join(missed) if missed else 'nothing') + '.\n'
    if image:
        text += f'\n## How cost grows\n\n![time over size]({image})\n\n'
        text += 'n^1: twice as many cost twice as much.\n'
    return text


def summary(rows: Sequence[Row]) -> list[tuple[str, list[Row]]]:
    """[(name, rows)] of the table: rows of a line of LINES together, others by themselves; growth has its figure."""
    found = {}
    for row in rows:
        if row.skipped or row.name.startswith(tuple(growth.FAMILIES)) or re.match(JSON_ONLY, row.name):
            continue
        name = next((name for name, pattern in LINES.items() if re.match(pattern, row.name)), row.name)
        found.setdefault(name, []).append(row)
    return list(found.items())


def _cells(name, rows):
    unit = f' {rows[0].unit}' if rows[0].unit else ''
    p99 = [row.at_peers_speed(row.p99) for row in rows if row.p99 is not None]
    limits = Counter(wanted(row) for row in rows if row.limit)
    return (
        name + (f' ({len(rows)})' if len(rows) > 1 else ''),
        _range([row.at_peers_speed(row.median) for row in rows]) + unit,
        number((min if rows[0].rate else max)(p99)) if p99 else '',
        _range([row.ratio for row in rows if row.ratio]),
        ', '.join(limit + (f' ({of} of {len(rows)})' if of < len(rows) else '') for limit, of in limits.items()),
    )


def _range(values):
    """The least and the greatest as text; one where they are written alike."""
    if not values:
        return ''
    least, most = number(min(values)), number(max(values))
    return least if least == most else f'{least}\N{EN DASH}{most}'


def _row(cells):
    return '| ' + ' | '.join(cells) + ' |'
