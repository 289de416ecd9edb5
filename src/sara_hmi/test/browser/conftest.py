"""One headless Chromium and one fake chair for all browser tests; each loads the page anew with its own settings."""

import importlib.util
import shutil
import sys
import tempfile
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for fake_chair and chair_page
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


@pytest.fixture(scope='session')
def browser():
    """selenium's driver."""
    from sara_hmi.browser.page import start_browser

    with tempfile.TemporaryDirectory(prefix='sara_hmi_browser_') as profile:
        driver = start_browser(profile)
        yield driver
        driver.quit()


@pytest.fixture
def page(browser, chair):
    """The ChairPage, loaded with the default settings."""
    from chair_page import ChairPage

    page = ChairPage(browser, chair)
    page.resize(1024, 768)
    yield page
    faults = [
        entry['message']
        for entry in browser.get_log('browser')
        if entry['level'] == 'SEVERE' and 'WebSocket' not in entry['message']
    ]
    page.let_go()
    assert faults == []
