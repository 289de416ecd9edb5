"""`rosrun sara_lab touch_faults [--browser] --count 50`: pages that fail while they drive, against the touch screen's
real node.

Judged on /cmd_vel/touch: no command whose frame is older than 200 ms, exactly one zero within 150 ms of the last
command, nothing after it. With --browser the page is in Chromium, a finger drives the simulated chair through the whole
stack, and the chair must be at rest as soon as the safety gate says that it stops.

- lifted: the finger; the page says `halt`
- hidden: the page's tab, by another tab and by minimising the window in turn (--browser)
- killed: the page's connection is closed; --browser: kill -9, of Chromium's first process and of all in turn
- cut: the network carries nothing more, either way
- frozen: the page does nothing for 2 s, then goes on with the beat that it had, then with new ones; --browser: it is
  frozen by Chromium, by a script that does not end, and by SIGSTOP in turn, and then the finger moves
- held: the page's frames are held for 5 s while it goes on driving, and come in a burst; every second time its beats
  are held, too
"""

from __future__ import annotations

import argparse
import asyncio
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial

import aiohttp

from sara_lab.fuzz.touch.page import Page, until
from sara_lab.fuzz.touch.proxy import Proxy
from sara_lab.fuzz.touch.verdict import Limits, Times, Trial, repeat
from sara_lab.ros.touch import browser_faults
from sara_lab.ros.touch.stand_in import StandIn, serving

FAULTS = ('lifted', 'killed', 'cut', 'frozen', 'held')
DRIVE_S, WATCH_S = 0.4, 0.5


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


@contextmanager
def without_browser(times: Times) -> Iterator[Callable[[str, int], Trial]]:
    """Trials of a page without a browser, on a stand-in for the robot: made(fault, number)."""
    with serving() as (url, robot):
        yield lambda fault, number: asyncio.run(trial(url, robot, fault, number, times))


def main(arguments: Sequence[str] | None = None) -> None:
    """Exit status 1 if anything is wrong."""
    from tqdm import tqdm

    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog='touch_faults', description=__doc__, formatter_class=form)
    parser.add_argument('--count', type=int, default=50, help='times of each fault (default: %(default)s)')
    parser.add_argument('--only', nargs='+', choices=browser_faults.FAULTS, metavar='FAULT', help='some of them')
    parser.add_argument('--browser', action='store_true', help='in Chromium, with the simulated chair')
    parser.add_argument(
        '--hold', type=float, default=Times().hold, help='s that frames are held (default: %(default)s)'
    )
    options = parser.parse_args(arguments)
    known = browser_faults.FAULTS if options.browser else FAULTS
    faults = options.only or known
    if options.count < 1:
        parser.error(f'--count is {options.count}, allowed are whole numbers above 0')
    if not 1.0 <= options.hold <= 10.0:
        parser.error(f'--hold is {options.hold}, allowed are 1 to 10 s')
    if not set(faults) <= set(known):
        parser.error('hidden: only a page in a browser can be, add --browser')
    bad = False
    with (browser_faults.with_browser if options.browser else without_browser)(Times(hold=options.hold)) as make:
        for fault in faults:
            with tqdm(total=options.count, desc=fault, delay=1.0, disable=None) as progress:
                result = repeat(fault, partial(make, fault), options.count, Limits(), progress.update)
            print(result.line(), flush=True)
            for number, sentence in result.wrong:
                print(f'  {fault}, trial {number}: {sentence}', flush=True)
            bad |= bool(result.wrong)
    sys.exit(int(bad))
