"""Pages in Chromium that fail while a finger drives the simulated chair by them: see `touch_faults`."""

from __future__ import annotations

import os
import signal
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import rospy

from sara_control.gate.comfort import read_profiles
from sara_hmi.browser.page import Page, start_browser
from sara_lab.fuzz.touch.proxy import Network, Proxy
from sara_lab.fuzz.touch.tap import commands
from sara_lab.fuzz.touch.verdict import Times, Trial
from sara_lab.ros.touch.ears import Ears
from sara_lab.ros.touch.whole_chair import a_node, whole_chair
from sara_lab.workers.cost import descendants

MAP, START = 'hall', (15.0, 4.0, 0.0)
FAST, SLOW_BACK = 0.25, 0.15  # m/s forward and backward, from which on the page may fail
WATCH_S, PATIENCE_S = 0.6, 60.0
AWAY = 80.0  # px that the finger is moved from the middle of the stick
TELL_APART = (  # each command a little faster, so that what is published tells which frame asked for it
    'const drive = sara.pump.drive; let k = 0;'
    'sara.pump.drive = (v, w) => drive(v && Math.sign(v) * (Math.abs(v) - 0.1 + 1e-6 * ++k), w)'
)
BUSY = 'setTimeout(() => { const end = performance.now() + 1000 * arguments[0]; while (performance.now() < end); })'


def wait_for(condition: Callable[[], object], what: str) -> None:
    """Raises TimeoutError where it does not come true."""
    end = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f'after {PATIENCE_S:.0f} s still not: {what}')
        time.sleep(0.005)


class Browser:
    """Chromium, started anew after it was killed."""

    def __init__(self) -> None:
        self._folder: tempfile.TemporaryDirectory | None = None
        self._driver = None

    def page(self, url: str) -> Page:
        """A page of that address."""
        if self._driver is None:
            self._folder = tempfile.TemporaryDirectory(prefix='sara_browser_', ignore_cleanup_errors=True)
            self._driver = start_browser(self._folder.name)
        page = Page(self._driver, url)
        page.resize(1024, 768)
        return page

    def processes(self) -> list[int]:
        """Chromium's, the first one first."""
        return descendants(self._driver.service.process.pid)[1:]

    def signal(self, pids: list[int], number: int) -> None:
        """Send a signal to processes of it."""
        for pid in pids:
            with suppress(ProcessLookupError):
                os.kill(pid, number)

    def close(self) -> None:
        """End it."""
        if self._driver is None:
            return
        with suppress(Exception):  # it may be dead already: selenium then raises what urllib3 does
            self._driver.quit()
        self._driver.service.stop()
        self._driver = None
        self._folder.cleanup()


class Drive:
    """A finger that holds the stick of one page, and all that can go wrong with that page."""

    def __init__(self, page: Page, proxy: Proxy, network: Network, browser: Browser) -> None:
        self.page, self.proxy, self.network, self.browser = page, proxy, network, browser
        self._at: tuple[float, float] | None = None  # where the finger is

    def begin(self, forward: bool) -> None:
        """Press and push."""
        page = self.page
        page.load('drive')
        page.until('sara.chair.driver === null && !sara.chair.isStopped')
        self.limits = page.js('sara.chair.welcome.limits')
        page.driver.execute_script(TELL_APART)
        x, y = page.middle('#stick')
        self._at = (x, y - AWAY if forward else y + AWAY)
        page.touch('Start', (x, y))
        page.touch('Move', self._at)

    def lifted(self, _times: Times, _number: int) -> None:
        """The finger."""
        self.end()

    def end(self) -> None:
        """No finger is down any more, in the next page either."""
        if self._at is not None:
            self.page.touch('End')
        self._at = None

    def hidden(self, _times: Times, number: int) -> None:
        """The tab, or the window."""
        page = self.page
        if number % 2:
            window = page.cdp('Browser.getWindowForTarget')['windowId']
            page.cdp('Browser.setWindowBounds', windowId=window, bounds={'windowState': 'minimized'})
            time.sleep(WATCH_S)
            page.cdp('Browser.setWindowBounds', windowId=window, bounds={'windowState': 'normal'})
        else:
            other = page.cdp('Target.createTarget', url='about:blank')['targetId']
            time.sleep(WATCH_S)
            page.cdp('Target.closeTarget', targetId=other)
        page.until('document.visibilityState === "visible"')
        self._move()

    def killed(self, _times: Times, number: int) -> None:
        """kill -9."""
        self.browser.signal(self.browser.processes()[: None if number % 2 else 1], signal.SIGKILL)
        self._close()

    def cut(self, _times: Times, _number: int) -> None:
        """Nothing passes any more."""
        self.network.call(self.proxy.up.clear)
        self.network.call(self.proxy.down.clear)
        time.sleep(WATCH_S)

    def frozen(self, times: Times, number: int) -> None:
        """The page does nothing for some seconds."""
        page = self.page
        if number % 3 == 0:
            page.cdp('Page.setWebLifecycleState', state='frozen')
            time.sleep(times.freeze)
            page.cdp('Page.setWebLifecycleState', state='active')
            time.sleep(WATCH_S)
            self._close()  # the page stays hidden: no finger reaches it any more
            return
        if number % 3 == 1:
            page.driver.execute_script(BUSY, times.freeze)
            time.sleep(times.freeze + 0.2)
        else:
            processes = self.browser.processes()
            self.browser.signal(processes, signal.SIGSTOP)
            time.sleep(times.freeze)
            self.browser.signal(processes, signal.SIGCONT)
        self._move()

    def held(self, times: Times, number: int) -> None:
        """Frames wait on their way, and come in a burst."""
        self.network.call(self.proxy.up.clear)
        if number % 2:
            self.network.call(self.proxy.down.clear)
        end = time.monotonic() + times.hold
        while time.monotonic() < end:
            self._move()
            time.sleep(0.05)
        self.network.call(self.proxy.up.set)
        self.network.call(self.proxy.down.set)
        self._move()

    def _close(self):
        self.browser.close()
        self._at = None

    def _move(self):
        """The finger is still down, and moves."""
        x, y = self._at
        self._at = (x + 1.0, y)
        self.page.touch('Move', self._at)


FAULTS = ('lifted', 'hidden', 'killed', 'cut', 'frozen', 'held')


class Lab:
    """The chair, the network and the browser of all trials."""

    def __init__(self, url: str, times: Times) -> None:
        self._port, self._times = int(url.rsplit(':', 1)[1]), times
        self._network, self.browser, self._ears = Network(), Browser(), Ears(START)
        wait_for(lambda: rospy.has_param('/safety_gate/profiles'), "the gate's profiles")
        self._profile = read_profiles(rospy.get_param('/safety_gate/profiles'))[rospy.get_param('/safety_gate/profile')]

    def trial(self, fault: str, number: int) -> Trial:
        """Drive, fail, and hear what comes."""
        ears = self._ears
        with self._network.proxy(self._port) as proxy:
            wait_for(lambda: ears.still, 'the chair at rest')
            drive = Drive(self.browser.page(proxy.url), proxy, self._network, self.browser)
            ears.forget()
            forward = ears.begin_ahead
            drive.begin(forward)
            fast = FAST if forward else SLOW_BACK
            if not self._drives(drive, fast):
                drive.end()
                return Trial({}, [], 0.0)
            at = time.monotonic()
            getattr(drive, fault)(self._times, number)
            wait_for(lambda: ears.still, 'a chair that comes to rest')
            time.sleep(WATCH_S)
            drive.end()
            said = [one for tap in proxy.taps for one in tap.said]
        heard = list(ears.touched)
        zero = next((t for t, v in heard if v == 0.0), at)
        sent = commands(said, drive.limits)
        return Trial(sent, heard, at, ears.rest_after(zero, self._profile))

    def _drives(self, drive, fast):
        """Wait until the chair is fast; False where the page has given up before, because the machine paused."""
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            if self._ears.true and abs(self._ears.true[-1][1]) > fast:
                return True
            if not drive.page.js('sara.pump.isHeld'):
                return False
            time.sleep(0.02)
        raise TimeoutError(f'the chair does not drive: {drive.page.js("JSON.stringify(sara.chair.state)")}')


@contextmanager
def with_browser(times: Times) -> Iterator[Callable[[str, int], Trial]]:
    """Trials in Chromium, on the simulated chair: made(fault, number)."""
    with a_node('touch_faults'), whole_chair(MAP, START) as url:
        lab = Lab(url, times)
        try:
            with_gate = lab.browser.page(url).load('drive')
            with_gate.until('sara.chair.state?.gate?.state === "IDLE"', timeout=120.0)
            yield lab.trial
        finally:
            lab.browser.close()
