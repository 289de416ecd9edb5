"""`rosrun sara_lab touch_faults --count 50`: pages that fail while they drive, against the touch screen's real node.

Judged on /cmd_vel/touch: no command whose frame is older than 200 ms, exactly one zero within 150 ms of the last
command, nothing after it.

- lifted: the finger; the page says `halt`
- killed: the page's connection is closed
- cut: the network carries nothing more, either way
- frozen: the page does nothing for 2 s, then goes on with the beat that it had, then with new ones
- held: the page's frames are held for 5 s while it goes on driving, and come in a burst; every second time its beats
  are held, too
"""

from __future__ import annotations

import argparse
import asyncio
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import NamedTuple

import aiohttp
import numpy as np

from sara_lab.fuzz.touch.page import Page, until
from sara_lab.fuzz.touch.proxy import Proxy
from sara_lab.fuzz.touch.verdict import Limits, Trial, wrongs
from sara_lab.ros.touch.stand_in import StandIn, serving

FAULTS = ('lifted', 'killed', 'cut', 'frozen', 'held')
DRIVE_S, WATCH_S = 0.4, 0.5
AGAIN = 5  # trials that say nothing, for each one wanted, until the machine is too busy


class Times(NamedTuple):
    """s that a page is frozen, and that frames are held."""

    freeze: float = 2.0
    hold: float = 5.0


class Result(NamedTuple):
    """Trials of one fault that count, how many did not, and what was wrong: (number of the trial, sentence)."""

    fault: str
    trials: list[Trial]
    disturbed: int
    wrong: list[tuple[int, str]]

    def line(self) -> str:
        """In a sentence."""
        oldest = 1e3 * max(trial.oldest for trial in self.trials)
        zero = 1e3 * np.array([trial.zero_after for trial in self.trials])
        return (
            f'{self.fault}: {len(self.trials)} times, {len({number for number, _ in self.wrong})} wrong; '
            f'oldest command {oldest:.0f} ms; '
            f'zero after {np.median(zero):.0f} ms (median), {zero.max():.0f} ms (most); '
            f'{self.disturbed} repeated, as the machine paused'
        )


async def _lifted(page, _proxy, _times, _number):
    await page.halt()


async def _killed(_page, proxy, _times, _number):
    proxy.abort()


async def _cut(page, proxy, _times, _number):
    proxy.up.clear()
    proxy.down.clear()
    await page.drive_for(WATCH_S)


async def _frozen(page, _proxy, times, _number):
    page.awake.clear()
    held = page.beat
    await asyncio.sleep(times.freeze)
    for _ in range(3):
        await page.drive(held)
    page.awake.set()
    await until(lambda: page.beat > held, 'a new beat')
    await page.drive_for(0.2)


async def _held(page, proxy, times, number):
    proxy.up.clear()
    if number % 2:
        proxy.down.clear()
    await page.drive_for(times.hold)
    proxy.up.set()
    proxy.down.set()
    await page.drive_for(0.2)


DO = dict(zip(FAULTS, (_lifted, _killed, _cut, _frozen, _held)))


async def trial(url: str, robot: StandIn, fault: str, number: int, times: Times) -> Trial:
    """Drive, fail, and hear what comes."""
    port = int(url.rsplit(':', 1)[1])
    async with Proxy(port) as proxy, aiohttp.ClientSession() as session:
        page = Page(session, proxy.url, first=number * 500)
        await page.__aenter__()
        await page.take()
        robot.touched.clear()
        await page.drive_for(DRIVE_S)
        await until(lambda: robot.touched, 'a command')
        at = time.monotonic()
        with suppress(ConnectionError):
            await DO[fault](page, proxy, times, number)
        await asyncio.sleep(WATCH_S)
        heard = [(t, v) for t, v, _ in list(robot.touched)]
        proxy.abort()
        proxy.up.set()
        proxy.down.set()
        await until(lambda: page.gone, 'the end of a connection')
    return Trial(page.sent, heard, at)


async def repeat(
    where: tuple[str, StandIn], fault: str, count: int, times: Times, limits: Limits, tick: Callable[[], None]
) -> Result:
    """One fault so many times. where: the server's address, and the robot."""
    result, disturbed, number = Result(fault, [], 0, []), 0, 0
    while len(result.trials) < count:
        made = await trial(*where, fault, number, times)
        number += 1
        if made.disturbed:
            disturbed += 1
            if disturbed > AGAIN * count:
                raise RuntimeError(f'{fault}: the machine paused in {disturbed} of {number} drives')
            continue
        result.wrong.extend((number, sentence) for sentence in wrongs(made, limits))
        result.trials.append(made)
        tick()
    return result._replace(disturbed=disturbed)


def main(arguments: Sequence[str] | None = None) -> None:
    """Exit status 1 if anything is wrong."""
    from tqdm import tqdm

    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog='touch_faults', description=__doc__, formatter_class=form)
    parser.add_argument('--count', type=int, default=50, help='times of each fault (default: %(default)s)')
    parser.add_argument('--only', nargs='+', choices=FAULTS, default=FAULTS, metavar='FAULT', help='some of them')
    parser.add_argument(
        '--hold', type=float, default=Times().hold, help='s that frames are held (default: %(default)s)'
    )
    options = parser.parse_args(arguments)
    if options.count < 1:
        parser.error(f'--count is {options.count}, allowed are whole numbers above 0')
    if not 1.0 <= options.hold <= 10.0:
        parser.error(f'--hold is {options.hold}, allowed are 1 to 10 s')
    times, bad = Times(hold=options.hold), False
    with serving() as where:
        for fault in options.only:
            with tqdm(total=options.count, desc=fault, delay=1.0, disable=None) as progress:
                result = asyncio.run(repeat(where, fault, options.count, times, Limits(), progress.update))
            print(result.line(), flush=True)
            for number, sentence in result.wrong:
                print(f'  {fault}, trial {number}: {sentence}')
            bad |= bool(result.wrong)
    sys.exit(int(bad))
