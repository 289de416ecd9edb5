"""A headless Chromium, and what one does with the page in it."""

from __future__ import annotations

import json
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

KEY_CODES = {
    ' ': 32,
    'Enter': 13,
    'Escape': 27,
    'Tab': 9,
    'ArrowLeft': 37,
    'ArrowUp': 38,
    'ArrowRight': 39,
    'ArrowDown': 40,
}


def start_browser(profile: str) -> Chrome:
    """A headless Chromium, which asks nothing of any other machine. profile: its folder.

    It has a process group of its own: a Ctrl-C of the terminal is left to whoever started it.
    """
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which('chromium')
    arguments = 'headless=new no-sandbox disable-dev-shm-usage no-first-run disable-background-networking mute-audio'
    for argument in [*arguments.split(), f'user-data-dir={profile}', 'window-size=1024,768', 'disable-gpu']:
        options.add_argument(f'--{argument}')
    options.set_capability('goog:loggingPrefs', {'browser': 'ALL'})
    service = Service(shutil.which('chromedriver'), popen_kw={'start_new_session': True})
    return webdriver.Chrome(service=service, options=options)


@contextmanager
def browsing(url: str) -> Iterator[Page]:
    """A page of that address in a Chromium of its own, for the length of a block."""
    with tempfile.TemporaryDirectory(prefix='sara_browser_', ignore_cleanup_errors=True) as profile:
        driver = start_browser(profile)
        try:
            yield Page(driver, url)
        finally:
            driver.quit()


class Page:
    """What one does with the page. Points: CSS pixels of the window. driver: selenium's. url: the page's address."""

    loads = 0

    def __init__(self, driver: Chrome, url: str) -> None:
        self.driver, self.url = driver, url
        self.down: tuple[float, float] | None = None

    def load(self, screen: str = 'go', **settings: Any) -> Page:
        """Load the page with these settings, and wait until it is connected."""
        kept = json.dumps(json.dumps({'language': 'en', **settings}))
        self.cdp('Storage.clearDataForOrigin', origin=self.url, storageTypes='local_storage')
        script = f'if (location.host) localStorage.setItem("sara.settings", {kept})'
        added = self.cdp('Page.addScriptToEvaluateOnNewDocument', source=script)
        Page.loads += 1
        self.driver.get(f'{self.url}/?{Page.loads}#{screen}')  # another address, so that it is loaded anew
        self.cdp('Page.removeScriptToEvaluateOnNewDocument', identifier=added['identifier'])
        self.until('window.sara && sara.chair.welcome && (sara.chair.state || sara.chair.role === "none")')
        return self

    def debounced(self) -> None:
        """Wait until another press of a switch counts as another one."""
        self.until('performance.now() - sara.scanner.pressedAt > 310')

    def cdp(self, command: str, **arguments: Any) -> Any:
        """A command of Chromium's own protocol."""
        return self.driver.execute_cdp_cmd(command, arguments)

    def js(self, script: str, *arguments: Any) -> Any:
        """Evaluate an expression."""
        return self.driver.execute_script(f'return ({script})', *arguments)

    def until(self, script: str, *arguments: Any, timeout: float = 20.0, every: float = 0.01) -> Any:
        """Wait until an expression is true, asked for `every` so many s; returns its value."""
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            value = self.js(script, *arguments)
            if value:
                return value
            time.sleep(every)
        raise TimeoutError(f'not true within {timeout} s: {script}')

    def resize(self, width: int, height: int) -> None:
        """The size of the window, CSS pixels."""
        self.cdp('Emulation.setDeviceMetricsOverride', width=width, height=height, deviceScaleFactor=1, mobile=False)

    def middle(self, selector: str) -> tuple[float, float]:
        """The middle of an element, scrolled into view, as soon as it is there."""
        self.until('document.querySelector(arguments[0]) !== null', selector)
        return tuple(
            self.driver.execute_script(
                'const node = document.querySelector(arguments[0]); node.scrollIntoView({block: "center"});'
                'const box = node.getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]',
                selector,
            )
        )

    def mouse(self, kind: str, x: float, y: float, held: bool = False) -> None:
        """Pressed, Moved or Released: a real event of a mouse."""
        button = 'none' if kind == 'Moved' and not held else 'left'
        event = {'type': f'mouse{kind}', 'x': x, 'y': y, 'button': button, 'buttons': int(held)}
        self.cdp('Input.dispatchMouseEvent', **event, clickCount=int(kind != 'Moved'))
        self.down = (x, y) if held else None

    def touch(self, kind: str, *points: tuple[float, float]) -> None:
        """Start, Move or End: a real event of a touch screen. points: where fingers are now."""
        self.cdp('Input.dispatchTouchEvent', type=f'touch{kind}', touchPoints=[{'x': x, 'y': y} for x, y in points])

    def let_go(self) -> None:
        """Release the mouse where a button is down."""
        if self.down:
            self.mouse('Released', *self.down)

    def click(self, selector: str) -> None:
        """Press and release on an element."""
        x, y = self.middle(selector)
        self.mouse('Pressed', x, y, held=True)
        self.mouse('Released', x, y)

    def key(self, key: str, kind: str = 'both', repeat: bool = False) -> None:
        """Down, Up or both of a key: a real event of the keyboard."""
        text = {'Enter': '\r', ' ': ' '}.get(key)
        event = {'key': key, 'code': 'Space' if key == ' ' else key, 'windowsVirtualKeyCode': KEY_CODES[key]}
        if kind in ('Down', 'both'):
            down = {'type': 'keyDown', 'text': text} if text else {'type': 'rawKeyDown'}
            self.cdp('Input.dispatchKeyEvent', **event, **down, autoRepeat=repeat)
        if kind in ('Up', 'both'):
            self.cdp('Input.dispatchKeyEvent', **event, type='keyUp')
