#!/usr/bin/env python3
"""Journeys of the simulated chair through the page, by each input in turn: which arrive, and whether it was hit.

    source devel/setup.bash; .venv/bin/python src/sara_hmi/test/journeys.py --count 20 places stick

Each journey leads along the flat's corridor, to the other of its two ends. Inputs: places, map, switch,
dwell, stick, arrows; all if none is named.
"""

import argparse
import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parent / 'browser')]

from browser_page import Page, start_browser  # noqa: E402
from screenshots import end_chair, free_port, start_chair, wait_for_page  # noqa: E402

ENDS = {'front_door': (2.0, 4.9), 'corridor': (9.8, 4.9)}
ARRIVED = 0.5  # m from the end's place counts as there, by hand
LONGEST_S = 150.0


def pose(page):
    """(x, y, yaw) of the chair, as the page has it."""
    return page.js('sara.chair.state.pose')


def bearing(page, target):
    """(distance m, how far to turn rad) to a point."""
    x, y, yaw = pose(page)
    dx, dy = target[0] - x, target[1] - y
    turn = math.atan2(dy, dx) - yaw
    return math.hypot(dx, dy), math.atan2(math.sin(turn), math.cos(turn))


def wait_for_end(page):
    """Wait until the goal has ended; returns whether the page says that the chair arrived."""
    page.until('sara.chair.isGoing')
    page.until('!sara.chair.isGoing && !sara.chair.isMoving', timeout=LONGEST_S)
    return 'arrived' in page.js('document.getElementById("notice").textContent')


def by_places(page, name):
    """Tap the place, confirm."""
    page.load('go')
    page.click(f'[data-place={name}]')
    page.click('[data-answer=go]')
    return wait_for_end(page)


def by_map(page, name):
    """Tap where the place is on the map, go there."""
    page.load('map')
    page.until('sara.chair.image !== null && document.getElementById("map").width > 300')
    page.middle('#map')
    x, y = page.driver.execute_script(
        'const box = document.getElementById("map").getBoundingClientRect();'
        'const [x, y] = sara.current.view.toPixel(...arguments); return [box.x + x, box.y + y]',
        *ENDS[name],
    )
    page.mouse('Pressed', x, y, held=True)
    page.mouse('Released', x, y)
    page.click('[data-use=go_here]')
    return wait_for_end(page)


def by_switch(page, name):
    """One switch: its row, the place, the answer, each when it lights up."""
    page.load('go', scan='auto', scan_period=1.0)
    for lit in (
        f'document.querySelector(".scanned.tilerow")?.querySelector("[data-place={name}]")',
        f'document.querySelector(".scanned")?.dataset.place === "{name}"',
        'document.querySelector(".scanned")?.dataset.answer === "go"',
    ):
        page.debounced()
        page.until(f'!!({lit})')
        page.key(' ')
    return wait_for_end(page)


def by_dwell(page, name):
    """Rest the pointer on the place, then on the answer."""
    page.load('go', dwell='on', dwell_time=0.5)
    page.mouse('Moved', *page.middle(f'[data-place={name}]'))
    page.until('!document.getElementById("question").hidden')
    page.mouse('Moved', *page.middle('[data-answer=go]'))
    return wait_for_end(page)


def by_stick(page, name):
    """Hold the stick towards the end of the corridor."""
    page.load('drive')
    x, y = page.middle('#stick')
    end = time.monotonic() + LONGEST_S
    page.mouse('Pressed', x, y, held=True)
    while time.monotonic() < end:
        away, turn = bearing(page, ENDS[name])
        if away < ARRIVED:
            break
        if not page.js('sara.pump.isHeld'):  # the page took it away: let go, take it again
            page.let_go()
            page.mouse('Pressed', x, y, held=True)
        aside = max(-1.0, min(1.0, 1.5 * turn))
        page.mouse('Moved', x - 80 * aside, y - (80 * max(0.0, 1.0 - abs(turn))), held=True)
        time.sleep(0.05)
    page.let_go()
    page.until('!sara.chair.isMoving', timeout=30.0)
    return bearing(page, ENDS[name])[0] < 2 * ARRIVED


def by_arrows(page, name):
    """Hold one arrow at a time: turn until the end lies ahead, then forward."""
    page.load('drive')
    end = time.monotonic() + LONGEST_S
    held = None
    while time.monotonic() < end:
        away, turn = bearing(page, ENDS[name])
        if away < ARRIVED:
            break
        ahead = 0.15 if held == 'up' else 0.08
        wanted = 'up' if abs(turn) < ahead else 'left' if turn > 0 else 'right'
        if wanted != held or not page.js('sara.pump.isHeld'):
            page.let_go()
            page.mouse('Pressed', *page.middle(f'.arrow-{wanted}'), held=True)
            held = wanted
        time.sleep(0.05)
    page.let_go()
    page.until('!sara.chair.isMoving', timeout=30.0)
    return bearing(page, ENDS[name])[0] < 2 * ARRIVED


INPUTS = {
    'places': by_places,
    'map': by_map,
    'switch': by_switch,
    'dwell': by_dwell,
    'stick': by_stick,
    'arrows': by_arrows,
}


def main():
    """Drive, print a line for each journey and the sum."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('inputs', nargs='*', help='default: all')
    parser.add_argument('--count', type=int, default=20, help='journeys by each input')
    arguments = parser.parse_args()
    port = free_port()
    with tempfile.TemporaryDirectory(prefix='sara_hmi_') as folder:
        chair = start_chair(folder, port)
        browser = start_browser(f'{folder}/browser')
        arrived, driven, impacts = 0, 0, None
        try:
            wait_for_page(port)
            impacts = subprocess.Popen(
                ['rostopic', 'echo', '-p', '/impact'], env=chair.environment, stdout=subprocess.PIPE, text=True
            )
            page = Page(browser, None, f'http://127.0.0.1:{port}')
            page.resize(1024, 768)
            page.load('go')
            page.until('sara.chair.state?.gate?.state === "IDLE"', timeout=120.0)
            for number in range(arguments.count):
                for name in arguments.inputs or INPUTS:
                    target = max(ENDS, key=lambda end: bearing(page, ENDS[end])[0])
                    began = time.monotonic()
                    there = INPUTS[name](page, target)
                    driven, arrived = driven + 1, arrived + there
                    took = time.monotonic() - began
                    print(
                        f'{number + 1} {name}: {target}, {"arrived" if there else "FAILED"}, {took:.0f} s', flush=True
                    )
                    time.sleep(1.0)
        finally:
            browser.quit()
            end_chair(chair)
            if impacts:
                impacts.terminate()
        said = impacts.stdout.read().splitlines()[1:]  # after the head: stamp, value
    touched = sum(line.endswith(('True', ',1')) for line in said)
    print(f'{arrived} of {driven} journeys arrived, {touched} of {len(said)} messages on /impact told of a hit')
    return 0 if arrived == driven and said and not touched else 1


if __name__ == '__main__':
    sys.exit(main())
