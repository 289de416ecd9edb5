"""Drawing on the map: erase, close, keep out, by taps and by keyboard alone; taking it back."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))
from test_page import axe_source, check  # noqa: E402  pylint: disable=wrong-import-position

COLOURS = (
    '(() => { const c = document.getElementById("map"); const d = c.getContext("2d").getImageData(0, 0, c.width,'
    ' c.height).data; let n = 0; for (let k = 0; k < d.length; k += 4)'
    ' n += d[k] > 150 && d[k] < 220 && d[k + 1] < 120 && d[k + 2] < 130; return n; })()'
)
"""How many pixels of the map are as red as a keep-out place."""


def tap(page, east, north):
    """Tap the map so many pixels east and north of its middle."""
    x, y = page.middle('#map')
    page.mouse('Pressed', x + east, y - north, held=True)
    page.mouse('Released', x + east, y - north)


def begin(page):
    page.load('map')
    page.until_painted()
    page.click('[data-edit=begin]')
    page.until('!!document.querySelector("[data-edit=wall]")')


def metres(page, pixels):
    return pixels / page.js('sara.current.view.scale')


def drawn(page, count):
    page.until(f'document.querySelectorAll("[data-drawn]").length === {count}')


@pytest.mark.parametrize('kind', ['free', 'wall', 'keep_out', 'slow'])
def test_two_taps_and_a_button_draw(page, kind):
    begin(page)
    page.click(f'[data-edit={kind}]')
    tap(page, -60, -30)
    page.until('!!document.querySelector("[data-edit=next]")')
    tap(page, 40, 20)
    page.until('!!document.querySelector("[data-edit=draw]")')
    tap(page, 60, 30)  # the second point once more: it moves
    assert page.chair.frames('edit', 'go', 'pose') == []
    page.click('[data-edit=draw]')
    (frame,) = page.chair.wait_for('edit')
    (ax, ay), (bx, by) = frame['points']
    assert frame['kind'] == kind
    assert (bx - ax, by - ay) == pytest.approx((metres(page, 120), metres(page, 60)), abs=0.05)
    drawn(page, 1)
    assert page.js('document.activeElement.dataset.edit') == 'start'


def test_by_keyboard_alone(page):
    def press(selector):
        page.driver.execute_script(f"document.querySelector('{selector}').focus()")
        page.key('Enter')

    page.load('map')
    page.until_painted()
    press('[data-edit=begin]')
    page.until('document.activeElement.dataset.edit === "wall"')
    press('[data-edit=keep_out]')
    assert page.js('document.activeElement.dataset.edit') == 'keep_out'
    press('[data-edit=start]')
    assert page.js('document.activeElement.dataset.edit') == 'next'
    press('.editing [data-move=west]')
    press('.editing [data-move=south]')
    assert page.js('document.activeElement.dataset.move') == 'south'
    press('[data-edit=next]')
    assert page.js('document.activeElement.dataset.edit') == 'draw'
    press('.editing [data-move=east]')
    press('[data-edit=draw]')
    (frame,) = page.chair.wait_for('edit')
    # the middle of the map of 12 x 8 m, moved by 0.1 m each way; the second point 0.5 m off, moved by 0.1 m
    assert frame['kind'] == 'keep_out'
    assert sum(frame['points'], []) == pytest.approx([5.9, 3.9, 6.5, 4.4], abs=1e-6)
    drawn(page, 1)
    press('[data-edit=undo]')
    (back,) = page.chair.wait_for('unedit')
    assert back == {'op': 'unedit', 'kind': 'keep_out', 'points': frame['points']}
    drawn(page, 0)
    press('[data-edit=done]')
    page.until('document.querySelector(".editing").children.length === 0')
    assert page.js('document.activeElement.dataset.edit') == 'begin'
    tap(page, 0, 0)
    page.until('!!document.querySelector("[data-use=go_here]")')  # taps mark a goal again


def test_any_edit_is_taken_back_from_the_list(page):
    page.load('map')
    assert page.js('document.querySelector(".edits").closest("section").hidden')
    page.chair.edits = [
        {'kind': 'wall', 'points': [[1, 1], [1, 2.5]]},
        {'kind': 'keep_out', 'points': [[3, 3], [5, 4]]},
        {'kind': 'free', 'points': [[6, 6], [6.5, 7]]},
    ]
    page.chair.send({'op': 'edits', 'edits': page.chair.edits})
    drawn(page, 3)
    texts = page.js('[...document.querySelectorAll("[data-drawn] > span")].map((n) => n.textContent)')
    assert texts == ['1: wall, 1.5 m', '2: keep out, 2.0 × 1.0 m', '3: erased, 0.5 × 1.0 m']
    page.click('[data-unedit="2"]')
    assert page.chair.wait_for('unedit') == [{'op': 'unedit', 'kind': 'keep_out', 'points': [[3, 3], [5, 4]]}]
    drawn(page, 2)


def test_keep_out_places_are_hatched_on_the_map_of_everybody(page):
    page.load('map', role='look')
    page.until_painted()
    before = page.js(COLOURS)  # the arcs of the ranges are red, too
    page.chair.edits = [{'kind': 'keep_out', 'points': [[3, 3], [5, 4]]}]
    page.chair.send({'op': 'edits', 'edits': page.chair.edits})
    page.until(f'{COLOURS} > {before + 300}')
    assert page.js('document.querySelectorAll("[data-edit], [data-unedit]").length') == 0


def test_where_the_map_cannot_be_drawn_over_nothing_is_offered(page):
    begin(page)
    page.chair.send({'op': 'edits', 'edits': None})
    page.until('document.querySelector(".editing").children.length === 0')
    assert page.js('document.querySelectorAll("[data-edit]").length') == 0


def test_what_is_refused_is_said(page):
    begin(page)
    page.chair.send({'op': 'error', 'key': 'error.edit_small', 'values': {}, 'of': 'edit'})
    page.until('document.getElementById("notice").textContent.startsWith("That is too small.")')


@pytest.mark.parametrize('language, contrast', [('en', 'light'), ('es', 'light'), ('es', 'high'), ('en', 'dark')])
def test_no_violation_of_wcag_while_drawing(page, language, contrast):
    page.load('map', language=language, contrast=contrast)
    page.driver.execute_script(axe_source())
    page.chair.edits = [{'kind': 'wall', 'points': [[1, 1], [1, 2.5]]}]
    page.chair.send({'op': 'edits', 'edits': page.chair.edits})
    drawn(page, 1)
    page.click('[data-edit=begin]')
    check(page, (language, contrast, 'begun'))
    page.click('[data-edit=start]')
    page.click('[data-edit=next]')
    check(page, (language, contrast, 'two points'))
