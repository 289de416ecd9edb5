"""One switch, two switches, dwell, keyboard alone."""

import json
import time

import pytest

LIT = '(document.querySelector(".scanned")?.textContent ?? "")'
ROW = 'document.querySelector(".scanned.tilerow")'


def wait_for_scan(page, what):
    """Wait until `what` (an expression) is true; the scan then waits for the press, however slow this machine is."""
    page.until(f'({what}) && (clearTimeout(sara.scanner.timer), true)')


def switch_when(page, what):
    """Press the switch as soon as `what` (an expression) is true, as a rider does who waits for it."""
    page.debounced()
    wait_for_scan(page, what)
    page.key(' ')


def test_one_switch_starts_the_way_to_the_kitchen_by_three_presses(page):
    page.load('go', scan='auto', scan_period=1.0)
    began = time.monotonic()
    switch_when(page, f'{ROW}?.querySelector("[data-place=kitchen]")')
    switch_when(page, 'document.querySelector(".scanned")?.dataset.place === "kitchen"')
    page.until('!document.getElementById("question").hidden')
    switch_when(page, 'document.querySelector(".scanned")?.dataset.answer === "go"')
    assert page.chair.wait_for('go') == [{'op': 'go', 'place': 'kitchen'}]
    took = time.monotonic() - began
    print(f'one switch, kitchen among nine places: 3 presses, {took:.1f} s')


def test_one_switch_says_where_the_chair_is(page):
    page.load('go', scan='auto', scan_period=1.0)
    page.chair.state['lost'] = True
    switch_when(page, '!!document.querySelector(".scanned [data-here=kitchen]")')
    switch_when(page, 'document.querySelector(".scanned")?.dataset.here === "kitchen"')
    assert page.chair.wait_for('pose') == [{'op': 'pose', 'place': 'kitchen'}]


def test_the_keyboard_says_where_the_chair_is(page):
    page.load('why')
    page.chair.state['lost'] = True
    page.until('!!document.querySelector("[data-here=library]")')
    page.driver.execute_script('document.querySelector("[data-here=library]").focus()')
    page.key('Enter')
    assert page.chair.wait_for('pose') == [{'op': 'pose', 'place': 'library'}]
    page.chair.state['lost'] = False
    page.until('document.querySelector(".where").hidden && document.activeElement.id === "screen"')


def test_every_place_takes_three_presses_and_at_most_20_s(page):
    """By the order and times of the scan alone: rows, items, the answer; the first of each is lit for 1.5 periods."""
    page.load('go', scan='step')
    order = page.js(
        '[...document.querySelectorAll(".tilerow")].map((row) => [...row.children].map((n) => n.dataset.place))'
    )
    assert sum(map(len, order)) == 9
    waits = [
        row + column + 0.5 * (row > 0) + 0.5 * (column > 0)
        for row in range(len(order))
        for column in range(len(order[row]))
    ]
    assert max(waits) + 2 * 0.3 + 1.5 <= 20.0


def test_a_press_while_the_chair_moves_stops_it(page):
    page.load('go', scan='auto', scan_period=0.5)
    page.chair.state |= {'v': 0.3}
    page.until('sara.chair.isMoving')
    page.key(' ')
    page.chair.wait_for('stop')


def test_of_a_stop_that_a_silent_network_swallows_it_is_said_that_it_may_not_have_come(page):
    page.load('go')
    page.chair.hold()
    try:
        told = page.driver.execute_script('sara.stopper.press(); return document.getElementById("notice").textContent')
        assert told == 'Stop!'
        page.until('document.getElementById("notice").textContent.startsWith("The stop could not be sent")')
    finally:
        page.chair.let_through()
    page.until('sara.chair.isStopped')


@pytest.mark.parametrize('press', ['switch', 'screen'])
def test_a_press_on_the_way_to_a_place_pauses_it(page, press):
    page.load('go', scan='auto', scan_period=0.5)
    page.chair.state |= {'v': 0.3, 'goal': {'state': 'going', 'place': 'kitchen', 'pose': [0, 0, 0], 'left': 3.0}}
    page.until('sara.chair.isGoing')
    page.key('Enter') if press == 'switch' else page.click('h1')
    page.chair.wait_for('pause')
    page.chair.state |= {'v': 0.0}
    page.until('sara.chair.isPaused && !sara.chair.isMoving')
    switch_when(page, f'{LIT}.startsWith("The way to Kitchen")')
    switch_when(page, 'document.querySelector(".scanned")?.dataset.do === "resume"')
    page.chair.wait_for('resume')
    assert page.chair.frames('stop') == []


def test_a_pause_that_does_not_come_becomes_a_stop(page):
    page.load('go', scan='auto', scan_period=0.5)
    page.chair._on_pause = lambda frame: []
    try:
        page.chair.state |= {'v': 0.3, 'goal': {'state': 'going', 'place': 'kitchen', 'pose': [0, 0, 0], 'left': 3.0}}
        page.until('sara.chair.isGoing')
        page.key(' ')
        page.chair.wait_for('pause')
        page.chair.wait_for('stop')
    finally:
        del page.chair._on_pause


def test_two_switches_step_and_choose(page):
    page.load('why', scan='step')
    assert page.js('document.querySelector(".scanned")') is None
    for _ in range(20):
        page.debounced()
        page.key(' ')
        if page.js('document.querySelector(".scanned")?.id === "tabs"'):
            break
    page.debounced()
    page.key('Enter')
    assert page.js('document.querySelector(".scanned").dataset.tab') == 'go'
    page.debounced()
    page.key(' ')
    page.debounced()
    page.key('Enter')
    page.until('location.hash === "#drive"')


def test_the_screen_as_the_switch(page):
    page.load('settings', scan='auto', scan_touch='on', scan_period=0.5)
    wait_for_scan(page, 'document.querySelector(".scanned [data-set=language]")')
    page.click('h1')
    wait_for_scan(page, 'document.querySelector(".scanned")?.dataset.value === "es"')
    page.click('h1')
    page.until(
        'document.querySelector("h1").textContent === "Ajustes" || document.querySelector(".scanned")?.dataset.value'
    )


def test_the_screen_as_the_switch_may_be_pressed_slowly(page):
    """What lies under the finger is not pressed, too."""
    page.load('go', scan='auto', scan_touch='on', scan_period=5.0)
    page.chair.state['goal'] = {'state': 'paused', 'place': 'kitchen', 'pose': [0, 0, 0], 'left': 8.0}
    page.until('!!document.querySelector("[data-do=resume]")')
    page.debounced()
    page.driver.execute_script('sara.scanner.row = document.getElementById("tabs"); sara.scanner.item = null')
    x, y = page.middle('[data-do=resume]')
    page.mouse('Pressed', x, y, held=True)
    page.driver.execute_async_script('setTimeout(arguments[0], 1200)')
    page.mouse('Released', x, y)
    page.round_trip()
    assert not page.chair.frames('resume')


def test_one_switch_drives_a_step_and_a_press_ends_it(page):
    page.load('drive', scan='auto', scan_period=0.5, step=3.0)
    switch_when(page, 'document.querySelector(".scanned")?.classList.contains("arrows")')
    switch_when(page, 'document.querySelector(".scanned")?.dataset.way === "up"')
    page.chair.wait_for('drive', count=2)
    page.debounced()
    page.key(' ')
    page.chair.wait_for('halt')
    page.round_trip()
    assert page.chair.frames('drive', 'halt')[-1]['op'] == 'halt'


def test_dwell_presses_what_is_pointed_at_once(page):
    page.load('go', dwell='on', dwell_time=0.3)
    page.driver.execute_script(
        'const ring = document.getElementById("dwell");'
        'new MutationObserver(() => { window.ringed ||= !ring.hidden; }).observe(ring, { attributes: true })'
    )
    x, y = page.middle('[data-place=kitchen]')
    page.mouse('Moved', x, y)
    page.until('window.ringed')
    page.until('!document.getElementById("question").hidden')
    assert page.chair.frames('go') == []
    x, y = page.middle('[data-answer=go]')
    page.mouse('Moved', x, y)
    page.chair.wait_for('go')
    page.round_trip()
    assert len(page.chair.frames('go')) == 1


def test_dwell_says_where_the_chair_is(page):
    page.load('go', dwell='on', dwell_time=0.3)
    page.chair.state['lost'] = True
    page.until('!!document.querySelector("[data-here=kitchen]")')
    page.mouse('Moved', *page.middle('[data-here=kitchen]'))
    assert page.chair.wait_for('pose') == [{'op': 'pose', 'place': 'kitchen'}]
    page.round_trip()
    assert page.chair.frames('pose') == [{'op': 'pose', 'place': 'kitchen'}], 'it was told more than once'


def test_dwell_that_leaves_in_time_presses_nothing(page):
    page.load('go', dwell='on', dwell_time=3.0)
    x, y = page.middle('[data-place=kitchen]')
    page.mouse('Moved', x, y)
    page.until('!document.getElementById("dwell").hidden')
    page.mouse('Moved', *page.middle('h1'))
    page.until('document.getElementById("dwell").hidden')
    assert page.js('document.getElementById("question").hidden')


def test_dwell_drives_a_step_and_stops(page):
    page.load('drive', dwell='on', dwell_time=0.3, step=0.5)
    page.controls()
    x, y = page.middle('.arrow-up')
    page.mouse('Moved', x, y)
    page.chair.wait_for('drive', count=2)
    page.chair.wait_for('halt')
    page.round_trip()
    assert page.chair.frames('drive', 'halt')[-1]['op'] == 'halt'
    page.mouse('Moved', *page.middle('#stop'))
    page.chair.wait_for('stop')


FOCUS = """
(() => {
  const n = document.activeElement;
  if (!n || n === document.body) return null;
  const b = n.getBoundingClientRect();
  const s = getComputedStyle(n);
  const at = document.elementFromPoint(Math.min(innerWidth - 1, Math.max(0, b.x + b.width / 2)), b.y + b.height / 2);
  window.order ??= [];
  if (!window.order.includes(n)) window.order.push(n);
  const outline = s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) >= 3;
  const shown = at !== null && (n.contains(at) || at.contains(n));
  return {name: n.textContent || n.id, index: window.order.indexOf(n), outline, shown, main: n.id === 'screen'};
})()
"""
ALL = (
    '[...document.querySelectorAll("button:not([disabled]), input, a[href]")]'
    '.filter((n) => n.getClientRects().length && !n.closest("[inert]")).length'
)


@pytest.mark.parametrize('size', [(1024, 768), (320, 256)], ids=['tablet', '400 % zoom'])
def test_all_is_reached_by_keyboard_with_a_focus_that_shows(page, size):
    page.resize(*size)
    page.load('go')
    page.resize(*size)
    for screen in ('go', 'drive', 'map', 'why', 'settings'):
        page.driver.execute_script(f'location.hash = "{screen}"')
        page.until(f'sara.shown === "{screen}"')
        page.driver.execute_script('document.activeElement.blur(); window.order = []')
        count = page.js(ALL)
        seen = set()
        for _ in range(count + 3):
            page.key('Tab')
            focus = page.js(FOCUS)
            if focus is None or focus['main']:
                continue
            assert focus['outline'] and focus['shown'], json.dumps([screen, focus])
            seen.add(focus['index'])
        assert len(seen) >= count, (screen, count, len(seen))


def test_a_place_is_reached_by_keyboard_alone(page):
    page.load('go')
    for _ in range(40):
        page.key('Tab')
        if page.js('document.activeElement.dataset.place') == 'garden':
            break
    page.key('Enter')
    page.until('document.activeElement.dataset.answer === "go"')
    page.key('Enter')
    assert page.chair.wait_for('go') == [{'op': 'go', 'place': 'garden'}]
