"""`rosrun sara_lab touch_journeys --count 20`: journeys through the flat's doors, driven in Chromium by each input.

The whole stack runs on a simulated chair. Each journey ends at the next stop of a round through five rooms. Judged by
the simulator's own truth: at the place, and no contact; the gap is that of the true pose to the map.

- places: a tap on the tile, a tap on yes
- map: a tap where the place is, a tap on "go here"
- switch: one switch, scanned at 1 s
- dwell: a pointer that rests on the tile, then on yes
- stick: a finger on the joystick, steered by the pose that the page shows
- arrows: a finger that holds one arrow at a time, steered by what is seen from the seat: where the chair is, and how
  much room it has
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import rospkg

from sara_common.platforms import chosen
from sara_hmi.browser.page import Page, browsing
from sara_lab.journeys.by_arrows import ArrowRider
from sara_lab.journeys.by_hand import Point, Rider, legs, stop
from sara_lab.journeys.touch_journey import TouchJourney, journeys_of, missing, summary
from sara_lab.judge import gaps
from sara_lab.ros.touch.whole_chair import Truth, a_node, whole_chair
from sara_nav.maps import places as places_file
from sara_sim.world.world import World

MAP = 'flat'
LONGEST_S = 300.0  # of a journey
TICK_S = 0.1  # between two looks of the rider
GAP_STEP_S = 0.04
REST = '!sara.chair.isGoing && !sara.chair.isMoving'


class JourneyFault(Exception):
    """What the page said instead of an arrival."""


class Task(NamedTuple):
    """name: of the place to drive to. way: corners of the legs to it. truth, world: what the rider sees."""

    name: str
    way: Sequence[Point]
    truth: Truth
    world: World


def opened(page: Page, screen: str, **settings: Any) -> None:
    """Load that screen with these settings; the page notes how the goal ends."""
    page.load(screen, **settings)
    page.driver.execute_script(
        'window.lastEnd = null; sara.connection.addEventListener("ended", (event) => { lastEnd = event.detail.key; })'
    )


def wait_for_end(page: Page) -> None:
    """Until the chair has arrived and rests."""
    page.until('sara.chair.isGoing')
    page.until(f'sara.chair.state && {REST}', timeout=LONGEST_S, every=0.25)
    end = page.js('window.lastEnd')
    if end not in (None, 'goal.succeeded'):  # None: the page was not connected at that moment
        raise JourneyFault(end)


def by_places(page: Page, task: Task) -> None:
    """Tap the place, confirm."""
    opened(page, 'go')
    page.click(f'[data-place={task.name}]')
    page.click('[data-answer=go]')
    wait_for_end(page)


def by_map(page: Page, task: Task) -> None:
    """Tap where the place is on the map, go there."""
    opened(page, 'map')
    page.until('sara.chair.image !== null && document.getElementById("map").width > 300')
    page.middle('#map')
    script = (
        'const box = document.getElementById("map").getBoundingClientRect();'
        'const [x, y] = sara.current.view.toPixel(...arguments); return [box.x + x, box.y + y]'
    )
    x, y = page.driver.execute_script(script, *task.way[-1])
    page.touch('Start', (x, y))
    page.touch('End')
    page.click('[data-use=go_here]')
    wait_for_end(page)


def press_when(page: Page, lit: str) -> None:
    """Press the switch as soon as that is lit."""
    page.debounced()
    page.until(f'!!({lit})', timeout=60.0)
    page.key(' ')


def by_switch(page: Page, task: Task) -> None:
    """One switch: its row, the place, the answer, each when it lights up."""
    opened(page, 'go', scan='auto', scan_period=1.0)
    lit, asked = 'document.querySelector(".scanned")', '!document.getElementById("question").hidden'
    press_when(page, f'document.querySelector(".scanned.tilerow")?.querySelector("[data-place={task.name}]")')
    page.until(f'{asked} || {lit}?.dataset.place === "{task.name}"', timeout=60.0)
    if not page.js(asked):  # a row of one tile is that tile
        press_when(page, f'{lit}?.dataset.place === "{task.name}"')
    press_when(page, f'{lit}?.dataset.answer === "go"')
    wait_for_end(page)


def by_dwell(page: Page, task: Task) -> None:
    """Rest the pointer on the place, then on the answer."""
    opened(page, 'go', dwell='on', dwell_time=0.5)
    page.mouse('Moved', *page.middle(f'[data-place={task.name}]'))
    page.until('!document.getElementById("question").hidden')
    page.mouse('Moved', *page.middle('[data-answer=go]'))
    wait_for_end(page)


def gently(page: Page) -> None:
    """Choose the gentle speed, as a careful rider does indoors."""
    page.click('[data-profile=gentle]')
    page.until('sara.chair.welcome.profile === "gentle"')


def in_time() -> Iterator[float]:
    """The time (s) of each look of the rider, for as long as a journey may take."""
    end = time.monotonic() + LONGEST_S
    while time.monotonic() < end:
        yield time.monotonic()
        time.sleep(TICK_S)
    raise JourneyFault(f'not there after {LONGEST_S:.0f} s')


def by_stick(page: Page, task: Task) -> None:
    """A finger on the joystick."""
    opened(page, 'drive')
    gently(page)
    x, y = page.middle('#stick')
    radius = page.js('document.getElementById("stick").getBoundingClientRect().width') / 3.0
    rider, down = Rider(task.way), False
    try:
        for t in in_time():
            pose, held = page.js('[sara.chair.state?.pose, sara.pump.isHeld]')
            if not pose:
                continue
            if rider.is_there(pose):
                break
            if down and not held:  # the page has taken it away: lift, and take it again
                page.touch('End')
                down = False
            forward, left = rider.stick(t, pose)
            if not down:
                page.touch('Start', (x, y))
                down = True
            page.touch('Move', (x - radius * left, y - radius * forward))
    finally:
        if down:
            page.touch('End')
    page.until(REST)


def by_arrows(page: Page, task: Task) -> None:
    """A finger that holds one arrow at a time."""
    opened(page, 'drive')
    gently(page)
    rider, down = ArrowRider(task.way, lambda pose: gaps.at(task.world, pose, chosen().size)), None
    places = {name: page.middle(f'.arrow-{name}') for name in ('up', 'left', 'right', 'down')}
    try:
        for t in in_time():
            pose = task.truth.track[-1][1:]
            if rider.is_there(pose):
                break
            wanted = rider.arrow(t, pose, down)
            if down and (wanted != down or not page.js('sara.pump.isHeld')):
                page.touch('End')
                down = None
                page.until('!sara.chair.isMoving')
            elif not down and wanted:
                page.touch('Start', places[wanted])
                down = wanted
    finally:
        if down:
            page.touch('End')
    page.until(REST)


INPUTS: dict[str, Callable[[Page, Task], None]] = {
    'places': by_places,
    'map': by_map,
    'switch': by_switch,
    'dwell': by_dwell,
    'stick': by_stick,
    'arrows': by_arrows,
}


def journey(page: Page, truth: Truth, world: World, which: tuple[str, int], places: dict) -> TouchJourney:
    """Drive one. which: (input, number)."""
    by, number = which
    start, goal, before, fault = stop(number - 1), stop(number), truth.contacts(), ''
    truth.track.clear()
    try:
        INPUTS[by](page, Task(goal, legs(start, goal, places), truth, world))
    except (JourneyFault, TimeoutError) as error:
        fault = str(error)
    contacts = truth.contacts() - before
    track = np.array(truth.track)
    moved = np.hypot(*np.diff(track[:, 1:3], axis=0).T)
    driven = np.flatnonzero(moved > 1e-4)
    return TouchJourney(
        by,
        number,
        start,
        goal,
        off=round(float(np.hypot(*(track[-1, 1:3] - places[goal][:2]))), 3),
        contacts=contacts,
        gap=round(float(gaps.along(world, track[:, 0], track[:, 1:], chosen().size, GAP_STEP_S).min()), 3),
        way=round(float(moved.sum()), 2),
        seconds=round(float(track[driven[-1], 0] - track[driven[0], 0]), 1) if len(driven) else 0.0,
        fault=fault,
    )


def drive(out: Path, inputs: Sequence[str], count: int, **arguments: Any) -> list[TouchJourney]:
    """Drive what is missing in the file, a line each; returns all. After a journey that failed another chair begins
    where the next journey does. arguments: of sara.launch.
    """
    maps = Path(rospkg.RosPack().get_path('sara_bringup')) / 'maps'
    world, kept = World.from_yaml(maps / f'{MAP}.yaml'), places_file.load(maps / f'{MAP}.places.yaml')
    places = {name: (place.x, place.y, place.yaw) for name, place in kept.items()}
    truth = Truth()
    while left := missing(made := journeys_of(out.read_text()), inputs, count):
        (by, first), one = left[0], None
        with (
            whole_chair(MAP, places[stop(first - 1)], out.with_suffix('.log'), **arguments) as url,
            browsing(url) as page,
        ):
            page.resize(1024, 768)
            page.load('go')
            page.until('sara.chair.state?.gate?.state === "IDLE"', timeout=120.0)
            for number in [number for name, number in left if name == by]:
                if one is not None and (not one.arrived or number != one.number + 1):
                    break
                one = journey(page, truth, world, (by, number), places)
                with out.open('a') as file:
                    file.write(f'{one.line()}\n')
                print(one, flush=True)
    return made


def main(arguments: Sequence[str] | None = None) -> None:
    """Exit status 0 if every journey arrived without a contact."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog='touch_journeys', description=__doc__, formatter_class=form)
    parser.add_argument('inputs', nargs='*', metavar='INPUT', default=list(INPUTS), help=f'of {", ".join(INPUTS)}')
    parser.add_argument('--count', type=int, default=20, help='journeys by each input (default: %(default)s)')
    parser.add_argument(
        '--out', type=Path, default=Path('touch_journeys.jsonl'), help='what is in it is not driven again'
    )
    parser.add_argument('--speed', type=float, default=1.0, help='simulated seconds per second (default: %(default)s)')
    parser.add_argument('--assist', action='store_true', help='with shared control, for stick and arrows')
    options = parser.parse_args(arguments)
    unknown = [name for name in options.inputs if name not in INPUTS]
    if unknown or options.count < 1:
        parser.error(f'{", ".join(unknown)}: of {", ".join(INPUTS)}' if unknown else f'--count is {options.count}')
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.touch()
    with a_node('touch_journeys'):
        made = drive(
            options.out, options.inputs, options.count, speed=options.speed, assist=str(options.assist).lower()
        )
    made = [one for one in made if one.by in options.inputs and one.number <= options.count]
    for by in options.inputs:
        print(summary([one for one in made if one.by == by]))
    sys.exit(int(any(not one.arrived or one.contacts for one in made)))
