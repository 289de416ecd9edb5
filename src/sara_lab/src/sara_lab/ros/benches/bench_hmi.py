"""The touch screen's server as a node, with a stand-in for the robot and pages as clients: how soon a page's frame is
on /cmd_vel/touch, a stop on /emergency_stop, a pose on a page, and what ten viewers cost. In real time, on a ROS master
of its own; pages, stand-in and clocks are in this process.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Iterator
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np

from sara_bringup.ros.processes import process_of
from sara_lab.benches.timed import Limit, Timed, timed
from sara_lab.fuzz.touch.page import Page, until
from sara_lab.fuzz.touch.proxy import Proxy
from sara_lab.ros.touch.stand_in import StandIn, serving
from sara_lab.workers.cost import cpu_seconds, peak_memory_mb

DRIVE_S, STOPS, STOP_PAUSE_S = 10.0, 100, 0.02
MAPS, MAP_PAUSE_S, MAP_CELLS = 3, 1.5, 2000
VIEWERS, SLOW_BYTES_PER_S, VIEW_S = 10, 1000.0, 7.0
SETTLE_S = 1.0


def large_map(seed: int) -> np.ndarray:
    """Cells (2000, 2000): rooms of 5 m with walls; one in twenty is drawn by chance, which packs badly."""
    random = np.random.default_rng(seed)
    cells = np.zeros((MAP_CELLS, MAP_CELLS), np.int8)
    cells[::100], cells[:, ::100] = 100, 100
    spots = random.random(cells.shape) < 0.05
    cells[spots] = random.choice(np.array([-1, 0, 100], np.int8), np.count_nonzero(spots))
    return cells


def memory_mb(pid: int) -> float:
    """What a process holds now, MB."""
    line = next(line for line in Path(f'/proc/{pid}/status').read_text().splitlines() if line.startswith('VmRSS'))
    return int(line.split()[1]) / 1024.0


def delays(pages: list[Page]) -> np.ndarray:
    """ms from the making of a state to its arrival, of all that came; forgets them."""
    found = []
    for page in pages:
        offset = time.time() - time.monotonic()
        found += [1e3 * (came + offset) - frame['t'] for came, frame in page.states]
        page.states.clear()
    return np.array(found)


async def driving(session: aiohttp.ClientSession, url: str, robot: StandIn) -> list[float]:
    """ms from a frame to its command, of each command at 20 Hz that came."""
    robot.touched.clear()
    async with Page(session, url) as page:
        await page.take()
        await page.drive_for(DRIVE_S)
        await page.halt()
        await until(lambda: robot.touched and robot.touched[-1][1] == 0.0, 'a zero')
        first: dict[float, float] = {}
        for t, v, _ in robot.touched:
            first.setdefault(round(v, 9), t)
        return [1e3 * (first[v] - at) if v in first else float('inf') for v, at in page.sent.items()]


async def stopping(session: aiohttp.ClientSession, url: str, robot: StandIn) -> list[float]:
    """ms from a stop to the topic, again and again."""
    found = []
    async with Page(session, url) as page:
        for _ in range(STOPS):
            robot.stops.clear()
            began = time.monotonic()
            await page.send('stop')
            await until(lambda: robot.stops, 'an emergency stop')
            found.append(1e3 * (robot.stops[0] - began))
            await asyncio.sleep(STOP_PAUSE_S)
    return found


async def map_going_out(session: aiohttp.ClientSession, url: str, robot: StandIn) -> tuple[float, np.ndarray]:
    """(poses/s, gaps between two poses in ms) on a page while maps go out to it."""
    maps = [large_map(seed) for seed in range(MAPS)]
    async with Page(session, url) as page:
        await until(lambda: page.states and page.states[-1][1]['pose'], 'a pose')
        page.states.clear()
        for cells in maps:
            await asyncio.to_thread(robot.show_map, cells)
            await asyncio.sleep(MAP_PAUSE_S)
        await until(lambda: page.maps >= MAPS, f'{MAPS} maps')
        came: dict[float, float] = {}
        for t, frame in page.states:
            came.setdefault(frame['pose'][0], t)
        times = np.array(list(came.values()))
    rate = (len(times) - 1) / (times[-1] - times[0])
    return round(float(rate), 1), 1e3 * np.diff(times)


async def slow_viewer(session: aiohttp.ClientSession, url: str, told: dict[str, int]) -> None:
    """A page that reads 1 kB/s, and opens anew when the server gives it up."""
    async with Proxy(int(url.rsplit(':', 1)[1]), SLOW_BYTES_PER_S) as proxy:
        while True:
            with contextlib.suppress(ConnectionError, aiohttp.ClientError, TimeoutError):
                async with Page(session, proxy.url) as page:
                    try:
                        await until(lambda: page.gone, 'an end')
                    finally:
                        proxy.abort()  # else the page reads all that waits for it, at 1 kB/s, before it closes
                told['ended'] += 1


async def viewing(session: aiohttp.ClientSession, url: str, pid: int) -> dict[str, Any]:
    """Nine viewers without, and then with a slow tenth: delays in ms, and with it CPU in % of a core and MB."""
    result, told = {}, {'ended': 0}
    async with AsyncExitStack() as stack:
        pages = [await stack.enter_async_context(Page(session, url)) for _ in range(VIEWERS - 1)]
        await asyncio.sleep(SETTLE_S)
        delays(pages)
        await asyncio.sleep(VIEW_S)
        result['alone'] = delays(pages)
        slow = asyncio.create_task(slow_viewer(session, url, told))
        await asyncio.sleep(SETTLE_S)
        delays(pages)
        before, began = cpu_seconds(pid), time.monotonic()
        await asyncio.sleep(VIEW_S)
        result['cpu'] = 100.0 * (cpu_seconds(pid) - before) / (time.monotonic() - began)
        result['beside'], result['memory'] = delays(pages), memory_mb(pid)
        slow.cancel()
        await asyncio.gather(slow, return_exceptions=True)
    return {**result, 'ended': told['ended']}


async def _measure(url, robot, pid):
    async with aiohttp.ClientSession() as session:
        result = {'driving': await driving(session, url, robot), 'map': await map_going_out(session, url, robot)}
        result['with_map'] = memory_mb(pid)
        result['viewing'] = await viewing(session, url, pid)
        result['stopping'] = await stopping(session, url, robot)
    return {**result, 'peak': peak_memory_mb(pid)}


def touch_screen() -> Iterator[list[Timed]]:
    """All of it, measured in one run of the node."""
    with serving() as (url, robot):
        result = asyncio.run(_measure(url, robot, process_of('/hmi')))
    command, stop = Limit('p99', 60.0), Limit('p99', 100.0)
    yield [
        timed("a page's frame to /cmd_vel/touch, 20 Hz", 'ms', result['driving'], scaled=False, limit=command),
        timed("a page's stop to /emergency_stop", 'ms', result['stopping'], scaled=False, limit=stop),
        *_poses(*result['map']),
        *_viewers(result),
    ]


def _poses(rate, gaps):
    what = f'while {MAPS} maps of {MAP_CELLS} x {MAP_CELLS} go out'
    yield Timed(f'poses on a page {what}', '/s', rate, None, 1, rate=True, scaled=False, limit=Limit('median', 10.0))
    yield Timed(
        f'longest gap between two poses {what}',
        'ms',
        float(gaps.max()),
        None,
        len(gaps),
        scaled=False,
        limit=Limit('median', 200.0),
    )


def _viewers(result):
    seen, who = result['viewing'], f'{VIEWERS} viewers, one at 1 kB/s'
    yield Timed(f'touch screen: {who}', '% of a core', seen['cpu'], None, 1, limit=Limit('median', 10.0))
    yield Timed(
        f'memory of the touch screen: {who}',
        'MB',
        seen['memory'],
        None,
        1,
        scaled=False,
        limit=Limit('median', 80.0),
        text=(
            f'after {MAPS} maps of {MAP_CELLS} x {MAP_CELLS}; {result["with_map"]:.0f} MB without the viewers, '
            f'{result["peak"]:.0f} MB at the most, while a map came'
        ),
    )
    alone = seen['alone']
    yield timed(
        f'a state to the other viewers: {who}',
        'ms',
        seen['beside'],
        scaled=False,
        limit=Limit('p99', 50.0),
        text=(
            f'without the slow one {np.median(alone):.1f} ms, p99 {np.percentile(alone, 99.0):.1f} ms; '
            f'the server ended the slow connection {seen["ended"]} times'
        ),
    )
