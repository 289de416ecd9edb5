"""The touch screen in Chromium, with the whole stack and the simulator: how soon a finger's event is a command on
/cmd_vel/touch, and a press of stop the safety gate's own state. In real time, on a ROS master of its own.

An event's time is its `timeStamp`: when Chromium got it, before the page did. The page's clock and this process's are
the same computer's, compared by the quickest of some questions.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator

import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger

from sara_hmi.browser.page import Page, browsing
from sara_lab.benches.timed import Limit, Timed, timed
from sara_lab.benches.touch_delays import delays
from sara_lab.ros.touch.whole_chair import a_node, whole_chair

MAP, START = 'hall', (2.0, 4.0, 0.0)
MOVES, MOVE_S = 500, 0.05  # of a finger, 20 Hz
STOPS = 100
NEAR, SPAN = 50.0, 40.0  # px that the finger is away from the middle of the stick, and moves about
PATIENCE_S = 30.0
PRESSED = 'the emergency stop was pressed'
TEXT = 'beside the whole stack and the simulator'
ASKED = 20  # times that the page is asked for its clock
NOTE = (  # which event made which command
    'window.moved = []; window.pressed = []; const move = sara.pump.move;'
    'sara.pump.move = function (token, v, w) {'
    '  if (window.event?.type.startsWith("pointer") && v !== moved.at(-1)?.[1])'
    '    moved.push([performance.timeOrigin + event.timeStamp, v]);'
    '  return move.call(this, token, v, w); };'
    'document.getElementById("stop").addEventListener("pointerdown",'
    '  (event) => pressed.push(performance.timeOrigin + event.timeStamp), true)'
)


class Ears:
    """touched: [(when by the monotonic clock, m/s)] of the page's commands. held: since when the gate says that the
    emergency stop holds the chair, None where it does not.
    """

    def __init__(self) -> None:
        self.touched: list[tuple[float, float]] = []
        self.held: float | None = None
        self._ears = [
            rospy.Subscriber('/cmd_vel/touch', Twist, self._on_touch, tcp_nodelay=True),
            rospy.Subscriber('/safety_gate/status', String, self._on_status, tcp_nodelay=True),
        ]

    def _on_touch(self, message):
        self.touched.append((time.monotonic(), message.linear.x))

    def _on_status(self, message):
        held = PRESSED in message.data
        self.held = (self.held or time.monotonic()) if held else None


def until(condition: Callable[[], object], what: str) -> None:
    """Raises TimeoutError where it does not come true."""
    end = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f'after {PATIENCE_S:.0f} s still not: {what}')
        time.sleep(0.002)


def page_clock(page: Page) -> float:
    """s from the page's clock (ms since 1970) to this process's monotonic one."""
    asked = []
    for _ in range(ASKED):
        before = time.monotonic()
        theirs = page.js('performance.timeOrigin + performance.now()')
        after = time.monotonic()
        asked.append((after - before, 0.5 * (before + after) - 1e-3 * theirs))
    return min(asked)[1]


def pointing(page: Page, ears: Ears) -> list[float]:
    """ms from each movement of a finger on the stick to the first command of it; infinite where none came."""
    x, y = page.middle('#stick')
    limit = page.js('sara.chair.welcome.limits.max_forward')
    due = time.monotonic()
    page.touch('Start', (x, y))
    for number in range(MOVES):
        up = NEAR + SPAN * (number * 0.618 % 1.0)  # by the golden section: neighbours differ, none comes twice
        page.touch('Move', (x, y - up))
        if not page.js('sara.pump.isHeld'):  # the page took it away, as the machine paused: lift, take it again
            page.touch('End')
            page.touch('Start', (x, y))
        due = max(due + MOVE_S, time.monotonic())
        time.sleep(max(0.0, due - time.monotonic()))
    page.touch('End')
    until(lambda: ears.touched[-1][1] == 0.0, 'a zero')
    clock = page_clock(page)
    moved = [(clock + 1e-3 * at, v * limit) for at, v in page.js('moved')]
    return [1e3 * delay for delay in delays(moved, list(ears.touched))]


def pressing(page: Page, ears: Ears) -> list[float]:
    """ms from each press of stop to the gate's word that it holds the chair."""
    release = rospy.ServiceProxy('/emergency_stop/reset', Trigger)
    lift = rospy.Publisher('/emergency_stop', Bool, queue_size=1)
    at, found = page.middle('#stop'), []
    for _ in range(STOPS):
        until(lambda: ears.held is None, 'a gate that is free')
        page.touch('Start', at)
        until(lambda: ears.held is not None, 'an emergency stop')
        found.append(ears.held)
        page.touch('End')
        end = time.monotonic() + PATIENCE_S
        while not release().success and time.monotonic() < end:
            lift.publish(Bool(False))
            time.sleep(0.05)
    clock = page_clock(page)
    return [1e3 * (held - clock) - at for held, at in zip(found, page.js('pressed'), strict=True)]


def touch_screen() -> Iterator[Timed | list[Timed]]:
    """All of it."""
    if shutil.which('chromium') is None:
        yield Timed('the touch screen in Chromium', text='chromium is not installed')
        return
    with a_node('bench_hmi_browser'), whole_chair(MAP, START) as url, browsing(url) as page:
        ears = Ears()
        page.resize(1024, 768)
        page.load('drive')
        page.until('sara.chair.state?.gate?.state === "IDLE" && sara.chair.driver === null', timeout=120.0)
        page.driver.execute_script(NOTE)
        moved = pointing(page, ears)
        page.until('!sara.chair.isMoving')
        pressed = pressing(page, ears)
    yield [
        timed(
            'a finger in Chromium to /cmd_vel/touch, 20 Hz',
            'ms',
            moved,
            scaled=False,
            limit=Limit('p99', 60.0),
            text=TEXT,
        ),
        timed(
            'a press of stop in Chromium to the gate', 'ms', pressed, scaled=False, limit=Limit('p99', 100.0), text=TEXT
        ),
    ]
