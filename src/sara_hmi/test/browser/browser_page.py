"""A headless Chromium, and what tests and screenshots do with the page in it."""

import json
import os
import shutil
import time

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


def start_browser(profile):
    """A headless Chromium with a folder of its own, which nothing outside this machine is asked for."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which('chromium')
    arguments = 'headless=new no-sandbox disable-dev-shm-usage no-first-run disable-background-networking mute-audio'
    for argument in [*arguments.split(), f'user-data-dir={profile}', 'window-size=1024,768', 'disable-gpu']:
        options.add_argument(f'--{argument}')
    options.set_capability('goog:loggingPrefs', {'browser': 'ALL'})
    return webdriver.Chrome(service=Service(shutil.which('chromedriver'), log_output=os.devnull), options=options)


class Page:
    """What one does with the page. Points: CSS pixels of the window. chair: the FakeChair behind it, if it is one."""

    loads = 0

    def __init__(self, driver, chair, url):
        self.driver, self.chair, self.url = driver, chair, url
        self.down = None

    def load(self, screen='go', role='rider', **settings):
        """Load the page with these settings, and as this role if the chair is a fake; wait until it is connected."""
        if self.chair:
            self.chair.reset()
            self.chair.role = role
        kept = json.dumps(json.dumps({'language': 'en', **settings}))
        self.cdp('Storage.clearDataForOrigin', origin=self.url, storageTypes='local_storage')
        script = f'if (location.host) localStorage.setItem("sara.settings", {kept})'
        added = self.cdp('Page.addScriptToEvaluateOnNewDocument', source=script)
        Page.loads += 1
        self.driver.get(f'{self.url}/?{Page.loads}#{screen}')  # another address, so that it is loaded anew
        self.cdp('Page.removeScriptToEvaluateOnNewDocument', identifier=added['identifier'])
        self.until('window.sara && sara.chair.welcome && (sara.chair.state || sara.chair.role === "none")')
        if self.chair:
            self.limits(20_000, 20_000, 20_000)
        return self

    def limits(self, stale_beat_ms=200, slow_ms=180, frozen_ms=300):
        """What the page takes for a lost or a slow connection. A fake chair's page is patient until a test wants the
        real limits, so that a busy machine is not taken for a slow network.
        """
        self.driver.execute_script(
            'Object.assign(sara.connection.limits, {staleBeatMs: arguments[0], slowMs: arguments[1]});'
            'sara.pump.frozenMs = arguments[2]',
            stale_beat_ms,
            slow_ms,
            frozen_ms,
        )

    def debounced(self):
        """Wait until another press of a switch counts as another one."""
        self.until('performance.now() - sara.scanner.pressedAt > 310')

    def cdp(self, command, **arguments):
        """A command of Chromium's own protocol."""
        return self.driver.execute_cdp_cmd(command, arguments)

    def js(self, script, *arguments):
        """Evaluate an expression."""
        return self.driver.execute_script(f'return ({script})', *arguments)

    def until(self, script, *arguments, timeout=20.0):
        """Wait until an expression is true; returns its value."""
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            value = self.js(script, *arguments)
            if value:
                return value
            time.sleep(0.01)
        raise AssertionError(f'not true within {timeout} s: {script}')

    def resize(self, width, height):
        """The size of the window, CSS pixels."""
        self.cdp('Emulation.setDeviceMetricsOverride', width=width, height=height, deviceScaleFactor=1, mobile=False)

    def middle(self, selector):
        """The middle of an element, scrolled into view."""
        return tuple(
            self.driver.execute_script(
                'const node = document.querySelector(arguments[0]); node.scrollIntoView({block: "center"});'
                'const box = node.getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]',
                selector,
            )
        )

    def mouse(self, kind, x, y, held=False):
        """Pressed, Moved or Released: a real event of a mouse."""
        button = 'none' if kind == 'Moved' and not held else 'left'
        event = {'type': f'mouse{kind}', 'x': x, 'y': y, 'button': button, 'buttons': int(held)}
        self.cdp('Input.dispatchMouseEvent', **event, clickCount=int(kind != 'Moved'))
        self.down = (x, y) if held else None

    def let_go(self):
        """No mouse button stays down for the next test."""
        if self.down:
            self.mouse('Released', *self.down)

    def click(self, selector):
        """Press and release on an element."""
        x, y = self.middle(selector)
        self.mouse('Pressed', x, y, held=True)
        self.mouse('Released', x, y)

    def key(self, key, kind='both', repeat=False):
        """Down, Up or both of a key: a real event of the keyboard."""
        text = {'Enter': '\r', ' ': ' '}.get(key)
        event = {'key': key, 'code': 'Space' if key == ' ' else key, 'windowsVirtualKeyCode': KEY_CODES[key]}
        if kind in ('Down', 'both'):
            down = {'type': 'keyDown', 'text': text} if text else {'type': 'rawKeyDown'}
            self.cdp('Input.dispatchKeyEvent', **event, **down, autoRepeat=repeat)
        if kind in ('Up', 'both'):
            self.cdp('Input.dispatchKeyEvent', **event, type='keyUp')

    def round_trip(self):
        """Wait until the page's timers have run a few times and all that it sent before has come to the fake chair."""
        count = len(self.chair.frames('echo'))
        self.driver.execute_async_script(
            'const done = arguments[0]; let k = 4;const tick = () => (--k ? setTimeout(tick, 50) : done(true)); tick();'
        )
        self.driver.execute_script('sara.connection.askedAt = null; sara.connection.ask()')
        self.chair.wait(lambda: len(self.chair.frames('echo')) > count)
