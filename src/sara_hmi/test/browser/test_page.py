"""The page as a whole: accessibility (axe-core), sizes, weight, and that it asks nobody but its server."""

import importlib.util
import json
import re
from pathlib import Path

import pytest

WWW = Path(__file__).resolve().parents[2] / 'www'
SCREENS = ('go', 'drive', 'map', 'why', 'settings')
WINDOWS = {'320': (320, 640), '768': (768, 1024), '1280': (1280, 800), '1920': (1920, 1080), '400 % zoom': (320, 256)}
LEVELS = ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa']
AXE = (
    'const done = arguments[0]; axe.run({runOnly: ' + json.dumps(LEVELS) + ', resultTypes: ["violations"]}).then('
    '(r) => done(r.violations.map((v) => [v.id, v.nodes.map((n) => [n.html.slice(0, 200), n.failureSummary])])))'
)
SMALL = (
    '[...document.querySelectorAll("button, input, #stick")].filter((n) => n.getClientRects().length)'
    '.map((n) => [n.textContent || n.id, n.getBoundingClientRect()])'
    '.filter(([, b]) => Math.min(b.width, b.height) < 59.9)'
    '.map(([name, b]) => [name, b.width, b.height])'
)
WIDER = (
    '[document.scrollingElement, ...["screen", "tabs", "top"].map((id) => document.getElementById(id))]'
    '.filter((n) => n.clientWidth > 0 && n.scrollWidth > n.clientWidth + 1)'
    '.map((n) => [n.id || n.tagName, n.scrollWidth, n.clientWidth])'
)


HIDDEN = '(({scrollHeight, clientHeight}) => scrollHeight - clientHeight)(document.getElementById("screen"))'


def axe_source():
    """axe-core's text, from the package that carries it."""
    folder = Path(importlib.util.find_spec('axe_playwright_python').origin).parent
    return (folder / 'axe.min.js').read_text(encoding='utf-8')


def check(page, where):
    """0 violations, targets large enough, nothing wider than the window, in all WINDOWS."""
    for name, size in WINDOWS.items():
        page.resize(*size)
        page.js('document.body.offsetHeight')
        assert page.js(SMALL) == [], (where, name)
        assert page.js(WIDER) == [], (where, name)
        assert page.driver.execute_async_script(AXE) == [], (where, name)


@pytest.mark.parametrize('contrast', ['light', 'dark', 'high'])
@pytest.mark.parametrize('language', ['en', 'es'])
def test_no_violation_of_wcag_on_any_screen(page, language, contrast):
    page.load('go', language=language, contrast=contrast)
    page.driver.execute_script(axe_source())
    for screen in SCREENS:
        page.driver.execute_script(f'location.hash = "{screen}"')
        page.until(f'sara.shown === "{screen}"')
        check(page, (language, contrast, screen))


@pytest.mark.parametrize('language', ['en', 'es'])
def test_no_violation_while_something_happens(page, language):
    page.load('go', language=language)
    page.driver.execute_script(axe_source())
    page.click('[data-place=childs_room]')
    page.until('!document.getElementById("question").hidden')
    check(page, (language, 'question'))
    page.click('[data-answer=go]')
    page.until('sara.chair.isGoing')
    page.chair.state |= {'asked': {'v': 0.8, 'w': 0.0}, 'gate': {'state': 'WAITING', 'reasons': ['IMU_FROZEN']}}
    page.until('!document.getElementById("deviation").hidden')
    check(page, (language, 'journey'))
    page.key('Escape')
    page.until('!document.getElementById("reset").hidden')
    page.driver.execute_script('location.hash = "map"')
    page.until('sara.shown === "map"')
    page.click('[data-mark=chair]')
    check(page, (language, 'marking'))


ASSIST = {'command': None, 'lasts': 20, 'profile': 'much', 'profiles': ['much', 'little', 'gate_only']}
HELPING, ALONE = {'does': '', 'left': 0}, {'does': 'OVERRIDE', 'left': 13}


@pytest.mark.parametrize('language', ['en', 'es'])
def test_no_violation_with_shared_control_and_the_drive_screen_fits(page, language):
    page.load('drive', language=language)
    page.driver.execute_script(axe_source())
    for does in (HELPING, ALONE):
        page.chair.state |= {'assist': ASSIST | does, 'driver': 7}
        page.until(
            f'sara.chair.state.assist?.left === {does["left"]} && !!document.querySelector("[data-offer=release]")'
        )
        for window in ((1024, 768), (390, 844)):
            page.resize(*window)
            assert page.js(HIDDEN) <= 0, (window, does)
        check(page, (language, does['does'], 'drive'))
    page.driver.execute_script('location.hash = "settings"')
    page.until('document.querySelectorAll("[data-help]").length === 3')
    check(page, (language, 'settings'))


@pytest.mark.parametrize('language', ['en', 'es'])
def test_no_violation_while_the_chair_is_lost(page, language):
    page.load('go', language=language)
    page.chair.state['lost'] = True
    page.driver.execute_script(axe_source())
    for screen in ('go', 'map', 'why'):
        page.driver.execute_script(f'location.hash = "{screen}"')
        page.until(f'sara.shown === "{screen}" && document.querySelectorAll("[data-here]").length === 9')
        check(page, (language, 'lost', screen))


def test_no_violation_where_the_code_is_asked(page):
    page.load('go', role='none')
    page.until('!!document.getElementById("code")')
    page.driver.execute_script(axe_source())
    check(page, 'pair')


def test_the_page_is_light_and_asks_nobody_else(page):
    page.chair.requests.clear()
    page.load('go')
    for screen in SCREENS:
        page.driver.execute_script(f'location.hash = "{screen}"')
        page.until(f'sara.shown === "{screen}"')
    names = page.js('performance.getEntriesByType("resource").map((e) => e.name)')
    assert names and all(name.startswith(page.url) for name in names)
    loaded = {path for path in page.chair.requests if path != '/ws'}
    weight = sum((WWW / (path.lstrip('/') or 'index.html')).stat().st_size for path in loaded)
    print(f'first load: {weight} bytes in {len(loaded)} files')
    assert {'/', '/style.css', '/js/app.js', '/words/en.json'} <= loaded
    assert weight <= 300_000


def test_no_file_names_a_foreign_host():
    known = {'http://www.w3.org/2000/svg'}
    for path in WWW.rglob('*.*'):
        found = set(re.findall(r'\bhttps?://[\w./-]+', path.read_text(encoding='utf-8'))) - known
        assert not found, path


def words(language):
    """The catalogue of a language."""
    return json.loads((WWW / 'words' / f'{language}.json').read_text(encoding='utf-8'))


def test_both_languages_have_the_same_keys_with_the_same_values():
    english, spanish = words('en'), words('es')
    assert english.keys() == spanish.keys()
    slots = re.compile(r'\{\w+\}')
    for key, text in english.items():
        assert set(slots.findall(text)) == set(slots.findall(spanish[key])), key
        assert text.strip() and spanish[key].strip(), key


def test_every_key_that_the_page_uses_is_in_the_catalogue():
    source = '\n'.join(path.read_text(encoding='utf-8') for path in WWW.rglob('*.js'))
    used = set(re.findall(r"'((?:ui|goal|state|reason|help)\.[\w.]+)'", source))
    assert len(used) > 80
    assert used - words('en').keys() == set()
    stems = set(re.findall(r'`(ui\.[\w.]+\.)\$\{', source))
    assert all(any(key.startswith(stem) for key in words('en')) for stem in stems) and stems


def test_no_code_is_shown_where_a_key_is_unknown(page):
    page.load('go')
    page.chair.send({'op': 'error', 'key': 'error.of_tomorrow', 'values': {}, 'of': 'go'})
    page.until('document.getElementById("notice").textContent.includes("does not know")')
