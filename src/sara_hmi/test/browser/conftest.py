"""One headless Chromium for all browser tests, one fake chair; each test loads the page anew with settings of its own."""

import importlib.util
import json
import os
import sys
import shutil
import tempfile
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for fake_chair
MISSING = [name for name in ('chromium', 'chromedriver') if shutil.which(name) is None]
MISSING += [name for name in ('selenium', 'aiohttp', 'axe_playwright_python') if importlib.util.find_spec(name) is None]


def pytest_collection_modifyitems(items):
    """Skips these tests by name where no browser can be installed."""
    mine = [item for item in items if Path(__file__).parent in item.path.parents]
    for item in mine if MISSING else []:
        item.add_marker(pytest.mark.skip(reason=f'not installed: {", ".join(MISSING)} (tools/apt-packages.txt)'))


@pytest.fixture(scope='session')
def chair_server():
    """The FakeChair of this session."""
    from fake_chair import FakeChair

    return FakeChair()


@pytest.fixture
def chair(chair_server):
    """The FakeChair, as new."""
    chair_server.let_through()
    chair_server.reset()
    return chair_server


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


@pytest.fixture(scope='session')
def browser():
    """selenium's driver."""
    with tempfile.TemporaryDirectory(prefix='sara_hmi_browser_') as profile:
        driver = start_browser(profile)
        yield driver
        driver.quit()


@pytest.fixture
def page(browser, chair):
    """The Page, loaded with the default settings."""
    page = Page(browser, chair)
    page.resize(1024, 768)
    yield page
    faults = [entry['message'] for entry in browser.get_log('browser') if entry['level'] == 'SEVERE' and 'WebSocket' not in entry['message']]
    page.let_go()
    assert faults == []


class Page:
    """What tests do with the page. Points are in CSS pixels of the window."""

    loads = 0

    def __init__(self, driver, chair):
        self.driver, self.chair = driver, chair
        self.down = None

    def load(self, screen='go', role='rider', **settings):
        """Load the page with these settings and wait until it is connected."""
        self.chair.reset()
        self.chair.role = role
        self.cdp('Storage.clearDataForOrigin', origin=self.url, storageTypes='local_storage')
        script = f'if (location.host) localStorage.setItem("sara.settings", {json.dumps(json.dumps({"language": "en", **settings}))})'
        added = self.cdp('Page.addScriptToEvaluateOnNewDocument', source=script)
        Page.loads += 1
        self.driver.get(f'{self.url}/?{Page.loads}#{screen}')  # another address, so that it is loaded anew
        self.cdp('Page.removeScriptToEvaluateOnNewDocument', identifier=added['identifier'])
        self.until('window.sara && sara.chair.welcome && (sara.chair.state || sara.chair.role === "none")')
        return self

    @property
    def url(self):
        return f'http://127.0.0.1:{self.chair.port}'

    def cdp(self, command, **arguments):
        """A command of Chromium's own protocol."""
        return self.driver.execute_cdp_cmd(command, arguments)

    def js(self, script, *arguments):
        """Evaluate an expression."""
        return self.driver.execute_script(f'return ({script})', *arguments)

    def until(self, script, *arguments, timeout=20.0):
        """Wait until an expression is true; returns its value."""
        return self.chair.wait(lambda: self.js(script, *arguments), timeout)

    def resize(self, width, height):
        """The size of the window, CSS pixels."""
        self.cdp('Emulation.setDeviceMetricsOverride', width=width, height=height, deviceScaleFactor=1, mobile=False)

    def middle(self, selector):
        """The middle of an element that is shown, scrolled into view."""
        box = self.js(
            '(() => { const n = document.querySelector(arguments[0]); n.scrollIntoView({block: "center"});'
            ' const b = n.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()'.replace('arguments[0]', json.dumps(selector))
        )
        return tuple(box)

    def mouse(self, kind, x, y, held=False):
        """Pressed, Moved or Released: a real event of a mouse."""
        button = 'none' if kind == 'Moved' and not held else 'left'
        self.cdp('Input.dispatchMouseEvent', type=f'mouse{kind}', x=x, y=y, button=button, buttons=int(held), clickCount=int(kind != 'Moved'))
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
        code = {' ': 32, 'Enter': 13, 'Escape': 27, 'Tab': 9, 'ArrowUp': 38, 'ArrowDown': 40, 'ArrowLeft': 37, 'ArrowRight': 39}[key]
        text = {'Enter': '\r', ' ': ' '}.get(key)
        if kind in ('Down', 'both'):
            extra = {'text': text} if text else {}
            self.cdp('Input.dispatchKeyEvent', type='keyDown' if text else 'rawKeyDown', key=key, code=key if key != ' ' else 'Space', windowsVirtualKeyCode=code, autoRepeat=repeat, **extra)
        if kind in ('Up', 'both'):
            self.cdp('Input.dispatchKeyEvent', type='keyUp', key=key, code=key if key != ' ' else 'Space', windowsVirtualKeyCode=code)

    def round_trip(self):
        """Wait until the page's timers have run a few times and all that it sent before has come."""
        count = len(self.chair.frames('echo'))
        done = self.driver.execute_async_script('const done = arguments[0]; let k = 4; const tick = () => (--k ? setTimeout(tick, 50) : done(true)); tick();')
        assert done
        self.driver.execute_script('sara.connection.askedAt = null; sara.connection.ask()')
        self.chair.wait(lambda: len(self.chair.frames('echo')) > count)
