"""The live filter nodes, the bus, move_base and slam_gmapping, each as a bench: what nodes cost and how late messages
are, in real time on a ROS master of their own.
"""

import os
from collections.abc import Iterator

from sara_bringup.ros.masters import in_a_process
from sara_lab.benches.timed import Limit, Timed, timed
from sara_lab.ros.benches import bench_bus, bench_filter, bench_nav, bench_slam

FILTER_SECONDS, ROUNDS = 8.0, {'ekf': 3, 'ukf': 1}
BUS_RATE, BUS_SECONDS, ODOMETRY_SECONDS = 1000, 12.0, 10.0
NAV_PLANNER, PEERS_NAV_PERCENT = 'RotateThenPursue', 6.3
SLAM_PERCENT, SLAM_MB = 25.0, 300.0
LIMITS = {'ekf': Limit('median', 2.5)}


def filter_nodes() -> Iterator[list[Timed]]:
    """CPU of ekf_localization_node and ukf_localization_node, and of a bare rospy node with the same traffic at the
    same time.
    """
    for kind in ('ekf', 'ukf'):
        taken = [result for _, result in in_a_process(_runs, kind)]
        node, bare = ([result[name]['cpu_percent'] for result in taken] for name in ('/filter', '/bare'))
        ratio = min(node) / min(bare)
        peer = bench_filter.PEER_PERCENT[kind]
        yield [
            timed(
                f'{kind}_localization_node, 50 Hz out, 50 + 100 Hz in',
                '% of a core',
                node,
                peer=peer,
                limit=LIMITS.get(kind),
                memory=max(result['/filter']['peak_mb'] for result in taken),
                text=(
                    f'{ratio:.2f} of the bare node beside it; the peer took '
                    f'{peer / bench_filter.PEERS_BARE_PERCENT:.2f} of one'
                ),
            ),
            timed(
                f'a bare rospy node with the same traffic, beside the {kind}',
                '% of a core',
                bare,
                peer=bench_filter.PEERS_BARE_PERCENT,
                memory=max(result['/bare']['peak_mb'] for result in taken),
            ),
            timed(
                f'memory of {kind}_localization_node',
                'MB',
                [result['/filter']['peak_mb'] for result in taken],
                scaled=False,
                limit=Limit('median', 170.0),
            ),
        ]


def _runs(kind):
    return list(bench_filter.runs([kind], FILTER_SECONDS, ROUNDS[kind]))


def bus() -> Iterator[Timed]:
    """From the adapter's bytes to a topic, at 1000 frames a second."""
    with open(os.devnull, 'w', encoding='utf-8') as log:
        result = bench_bus.measure(BUS_RATE, BUS_SECONDS, log)
    cpu = ', '.join(f'{name[1:]} {share:.0f} %' for name, share in result['cpu_percent'].items())
    yield Timed(
        f'byte to topic, {BUS_RATE} frames/s',
        'ms',
        result['p50_ms'],
        result['p99_ms'],
        result['frames'],
        scaled=False,
        limit=Limit('p99', 5.0),
        memory=result['memory_mb'],
        text=f'{result["lost"]} of {result["frames"]} frames lost; CPU {cpu}',
    )


def odometry() -> Iterator[Timed]:
    """From an encoder frame's bytes to the odometry that it makes, at the chair's own rate."""
    with open(os.devnull, 'w', encoding='utf-8') as log:
        latency, lost = bench_bus.measure_odometry(ODOMETRY_SECONDS, log)
    yield timed('encoder frame to odometry', 'ms', latency, scaled=False, text=f'{lost} frames made none')


def move_base() -> Iterator[Timed]:
    """move_base's CPU while it drives 12 m at 10 Hz with the default planner."""
    os.makedirs(bench_nav.LOG.parent, exist_ok=True)
    result = bench_nav.drive(NAV_PLANNER)
    text = (
        f'idle {result["idle_percent"]:.1f} %; {result.get("missed_cycles", "?")} cycles missed; '
        f'{"arrived" if result["reached"] else "NOT arrived: " + result["text"]} after {result["seconds"]:.0f} s'
    )
    yield Timed(
        'move_base driving at 10 Hz',
        '% of a core',
        result['cpu_percent'],
        None,
        1,
        peer=PEERS_NAV_PERCENT,
        limit=Limit('median', PEERS_NAV_PERCENT),
        memory=result['memory_mb'],
        text=text,
    )


def slam_gmapping() -> Iterator[list[Timed]]:
    """slam_gmapping's CPU and memory while a robot drives with 541 rays ten times a second."""
    result = in_a_process(bench_slam.drive)
    text = f'{result["way"]:.0f} m in {result["seconds"]:.0f} s{"" if result["done"] else ": NOT driven to the end"}'
    yield [
        Timed(
            'slam_gmapping driving, 541 rays at 10 Hz',
            '% of a core',
            result['cpu_percent'],
            None,
            1,
            limit=Limit('median', SLAM_PERCENT),
            memory=result['memory_mb'],
            text=text,
        ),
        timed('memory of slam_gmapping', 'MB', [result['memory_mb']], scaled=False, limit=Limit('median', SLAM_MB)),
    ]
