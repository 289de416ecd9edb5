"""What each screen does, and the stop on all of them."""

import json

import pytest

SCREENS = ('go', 'drive', 'map', 'why', 'settings')


def text(page, selector):
    """The text of an element."""
    return page.js(f'document.querySelector({json.dumps(selector)}).textContent')


def asked(page):
    """The question that is shown."""
    page.until('!document.getElementById("question").hidden')
    return text(page, '#question-title')


@pytest.mark.parametrize('screen', SCREENS)
def test_the_stop_acts_on_press(page, screen):
    page.load(screen)
    x, y = page.middle('#stop')
    page.mouse('Pressed', x, y, held=True)
    page.chair.wait_for('stop')  # before it is released
    page.mouse('Released', x, y)
    page.round_trip()
    assert len(page.chair.frames('stop')) == 1


def test_the_stop_acts_by_keyboard_and_in_a_question(page):
    page.load('go')
    page.driver.execute_script('document.getElementById("stop").focus()')
    page.key('Enter', 'Down')
    page.chair.wait_for('stop')
    page.key('Enter', 'Up')
    page.key('Escape')
    page.chair.wait_for('stop', count=2)
    page.until('!document.getElementById("reset").hidden')
    page.click('#reset')
    asked(page)
    page.click('#stop')
    page.chair.wait_for('stop', count=3)


def test_keys_that_stop_are_a_setting(page):
    page.load('drive', stop_keys='escape_space')
    page.key(' ')
    page.chair.wait_for('stop')
    page.load('drive', stop_keys='none')
    page.key('Escape')
    page.round_trip()
    assert page.chair.frames('stop') == []


def test_a_stop_that_cannot_be_sent_is_said(page):
    page.load('go')
    page.driver.execute_script('sara.connection.open = () => {}; sara.connection.drop()')
    page.click('#stop')
    assert 'main switch' in text(page, '#notice')


def test_the_stop_is_released_after_a_question(page):
    page.load('why')
    page.click('#stop')
    page.until('!document.getElementById("reset").hidden')
    assert text(page, '#sentence') == 'The chair stands still because the emergency stop was pressed.'
    page.click('#reset')
    assert asked(page) == 'Release the stop?'
    assert page.chair.frames('reset') == []
    page.click('[data-answer=reset]')
    page.chair.wait_for('reset')
    page.until('document.getElementById("reset").hidden')


def test_a_place_is_tapped_confirmed_and_reached(page):
    page.load('go')
    page.click('[data-place=kitchen]')
    assert asked(page) == 'Go to Kitchen?'
    assert page.chair.frames('go') == []
    page.click('[data-answer=go]')
    assert page.chair.wait_for('go') == [{'op': 'go', 'place': 'kitchen'}]
    page.until('document.querySelector(".journey h2")?.textContent === "The chair is on its way to Kitchen."')
    page.chair.state['goal']['left'] = 2.0
    page.until('document.querySelector("progress").value === 75')
    assert text(page, '.journey .left') == '2.0 m to go'
    page.click('[data-do=pause]')
    page.chair.wait_for('pause')
    page.until('!!document.querySelector("[data-do=resume]")')
    page.click('[data-do=resume]')
    page.chair.wait_for('resume')
    page.until('!!document.querySelector("[data-do=pause]")')
    page.click('[data-do=cancel]')
    page.chair.wait_for('cancel')
    page.until('document.querySelector(".journey").hidden')
    page.until('document.getElementById("notice").textContent === "The way to Kitchen was cancelled."')


def test_the_question_can_be_left(page):
    page.load('go')
    page.click('[data-place=kitchen]')
    asked(page)
    page.click('.answers button:last-child')
    page.until('document.getElementById("question").hidden')
    assert page.chair.frames('go') == [] and page.js('document.activeElement.dataset.place') == 'kitchen'


def test_places_are_filtered(page):
    page.load('go')
    assert page.js('document.querySelectorAll(".tile").length') == 9
    page.chair.state['pose'] = [7.5, 5.0, 0.0]
    page.until('sara.chair.state.pose[0] === 7.5')
    page.click('[data-filter=near]')
    near = page.js('[...document.querySelectorAll(".tile")].map((n) => n.dataset.place)')
    assert near == ['garden', 'kitchen', 'library', 'living_room']


def test_without_a_connection_a_command_is_dropped_and_said(page):
    page.load('go')
    page.click('[data-place=kitchen]')
    asked(page)
    page.driver.execute_script('sara.connection.open = () => {}; sara.connection.drop()')
    page.click('[data-answer=go]')
    assert 'not sent' in text(page, '#notice')
    assert text(page, '#sentence') == 'No connection to the chair.'
    page.driver.execute_script('delete sara.connection.open; sara.connection.open()')
    page.chair.wait_for('hello', count=2)
    page.round_trip()
    assert page.chair.frames('go') == []


def test_an_error_of_the_server_is_shown_in_words(page):
    page.load('go', language='es')
    page.chair.send({'op': 'error', 'key': 'error.no_place', 'values': {'place': 'patio'}, 'of': 'go'})
    page.until('document.getElementById("notice").textContent === "No hay ningún lugar llamado Patio."')


def test_the_end_of_a_goal_is_told_with_its_reason(page):
    page.load('why')
    ended = {'op': 'ended', 'key': 'goal.aborted', 'values': {'place': '', 'reason': 'why.blocked'}}
    page.chair.send(ended)
    page.until(
        'document.getElementById("notice").textContent'
        ' === "The chair gave up the way to the marked point because the way stayed blocked."'
    )


def test_a_goal_is_marked_by_a_tap_turned_and_confirmed(page):
    page.load('map')
    page.until_painted()
    x, y = page.middle('#map')
    page.mouse('Pressed', x, y, held=True)
    page.mouse('Released', x, y)
    page.until('!!document.querySelector("[data-use=go_here]")')
    assert page.chair.frames('go') == []
    for move in ('left', 'left', 'east', 'north'):
        page.click(f'[data-move={move}]')
    page.click('[data-use=go_here]')
    pose = page.chair.wait_for('go')[0]['pose']
    # the middle of the map of 12 x 8 m, moved by 0.25 m each way; the chair's yaw and twice 15 degrees
    assert pose == pytest.approx([6.25, 4.25, 0.5 + 0.5236], abs=0.1)


def test_the_chair_s_pose_is_given_by_keyboard_alone(page):
    page.load('map')
    page.driver.execute_script('document.querySelector("[data-mark=chair]").focus()')
    page.key('Enter')
    page.driver.execute_script('document.querySelector("[data-move=right]").focus()')
    page.key('Enter')
    page.driver.execute_script('document.querySelector("[data-use=am_here]").focus()')
    page.key('Enter')
    assert page.chair.wait_for('pose')[0]['pose'] == pytest.approx([2.0, 3.0, 0.5 - 0.2618], abs=1e-3)
    page.until('document.getElementById("notice").textContent === "The chair was told that it is where the mark was."')


def test_the_map_is_zoomed_and_moved_by_buttons(page):
    page.load('map')
    page.until_painted()
    page.click('[data-mark=middle]')
    page.click('[data-use=unmark]')
    page.click('[data-look=closer]')
    page.click('[data-look=chair]')
    page.click('[data-mark=middle]')
    page.click('[data-use=am_here]')
    assert page.chair.wait_for('pose')[0]['pose'][:2] == pytest.approx([2.0, 3.0], abs=1e-6)


def test_the_map_shows_walls_chair_plan_and_ranges(page):
    page.load('map')
    page.until_painted()
    page.until(
        '(() => { const c = document.getElementById("map");'
        ' const d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;'
        ' const seen = new Set(); for (let k = 0; k < d.length; k += 4) seen.add(`${d[k]},${d[k + 1]},${d[k + 2]}`);'
        ' return seen.size > 20 && arguments[0].every((colour) => seen.has(colour)); })()',
        ['0,0,0', '254,254,254', '11,79,138', '11,122,59', '194,65,12'],
    )


def test_places_are_added_renamed_and_deleted(page):
    page.load('map')
    page.click('[data-place-do=add]')
    asked(page)
    assert page.js('document.activeElement.id') == 'name'
    page.driver.execute_script('document.getElementById("name").value = "Ana\'s  desk 2"')
    page.click('[data-answer=save]')
    assert page.chair.wait_for('place') == [{'op': 'place', 'name': 'Anas_desk_2'}]
    page.until('!!document.querySelector("[data-name=Anas_desk_2]")')
    page.click('[data-name=Anas_desk_2] [data-place-do=rename]')
    asked(page)
    page.driver.execute_script('document.getElementById("name").value = "Escritorio"')
    page.key('Enter')
    assert page.chair.wait_for('rename') == [{'op': 'rename', 'name': 'Anas_desk_2', 'to': 'Escritorio'}]
    page.until('!!document.querySelector("[data-name=Escritorio]")')
    page.click('[data-name=Escritorio] [data-place-do=delete]')
    assert asked(page) == 'Delete Escritorio from the list?'
    page.click('[data-answer=delete]')
    assert page.chair.wait_for('delete') == [{'op': 'delete', 'name': 'Escritorio'}]
    page.until('!document.querySelector("[data-name=Escritorio]")')


def test_a_map_that_is_being_made_is_saved_by_one_tap(page):
    page.load('map')
    assert not page.js('!!document.querySelector("[data-save-map]")')
    page.chair.state['maps'] = True
    page.until('!!document.querySelector("[data-save-map]")')
    page.click('[data-save-map]')
    assert page.chair.wait_for('save_map') == [{'op': 'save_map'}]
    page.until('document.getElementById("notice").textContent === "The map is saved."')
    page.chair.state['maps'] = False
    page.until('!document.querySelector("[data-save-map]")')


def test_why_says_what_happens_what_helps_and_what_was(page):
    page.load('why')
    page.chair.state['gate'] = {'state': 'HELD', 'reasons': ['LOCALIZATION']}
    page.until(
        'document.querySelector(".big").textContent'
        ' === "The chair stands still because the chair does not know where it is."'
    )
    assert 'The chair is here' in text(page, '.help')
    assert text(page, '.history li span') == 'The chair stands still because the chair was hit by something.'
    silent = page.js('[...document.querySelectorAll("[data-alive=false]")].map((n) => n.textContent)')
    assert len(silent) == 1 and 'silent' in silent[0]


OFFLINE = 'No connection to the chair.'


def test_what_a_chair_said_that_says_nothing_any_more_is_not_shown_as_the_present(page):
    page.load('why')
    page.chair.state |= {'gate': {'state': 'DRIVING', 'reasons': []}, 'v': 0.5}
    page.until('document.querySelector(".big").textContent === "The chair follows its commands."')
    assert text(page, '.help') == 'Nothing is in the way.'
    page.chair.is_silent = True
    page.limits(silent_ms=300)
    page.until(f'document.getElementById("sentence").textContent === "{OFFLINE}"')
    assert page.js('document.getElementById("sentence").dataset.kind') == 'grave'
    assert (text(page, '.big'), text(page, '.help')) == (OFFLINE, '')
    assert 'Battery' not in text(page, '#facts')
    page.driver.execute_script('location.hash = "drive"')
    page.until('document.querySelector(".speed")?.textContent === "– km/h"')
    page.chair.is_silent = False
    page.until('document.getElementById("sentence").textContent === "The chair follows its commands."')
    assert page.chair.connections == 1


def test_a_connection_that_stays_silent_is_opened_anew(page):
    page.load('go')
    page.chair.is_silent = True
    page.limits(silent_ms=300, lost_ms=600)
    page.until(f'document.getElementById("sentence").textContent === "{OFFLINE}"')
    page.chair.wait_for('hello', count=2)
    page.chair.is_silent = False
    page.until('document.getElementById("sentence").textContent === "The chair is ready."')


def test_that_the_safety_gate_has_gone_is_said(page):
    page.load('why')
    page.chair.state['gate'] = {'state': 'SILENT', 'reasons': []}
    page.until('document.getElementById("sentence").dataset.kind === "grave"')
    said = 'The part of the chair that guards its safety does not answer.'
    assert (text(page, '#sentence'), text(page, '.big'), text(page, '.help')) == (said, said, '')


LOST = 'The chair is not sure where it is.'


@pytest.mark.parametrize('screen', ['go', 'map', 'why'])
def test_a_lost_chair_is_told_where_it_is_by_one_tap(page, screen):
    page.load(screen)
    page.chair.state['lost'] = True
    page.until(f'document.getElementById("sentence").textContent === "{LOST}"')
    assert text(page, '.where p') == LOST and 'drive it a little' in text(page, '.where .help')
    page.click('[data-here=kitchen]')
    assert page.chair.wait_for('pose') == [{'op': 'pose', 'place': 'kitchen'}]
    assert text(page, '#notice') == 'The chair was told that it is here: Kitchen.'
    page.chair.state['lost'] = False
    page.until('document.getElementById("sentence").textContent === "The chair is ready."')
    assert page.js('document.querySelector(".where").hidden') is (screen != 'map')


def test_a_chair_that_has_no_place_on_its_map_is_lost(page):
    page.load('map')
    page.until('sara.chair.image')
    page.chair.state['pose'] = None
    page.until(f'document.getElementById("sentence").textContent === "{LOST}"')
    assert text(page, '.where p') == LOST
    for button in ('[data-mark=chair]', '[data-look=chair]'):
        page.driver.execute_script('sara.notice(null)')
        page.click(button)
        assert text(page, '#notice').startswith('The chair does not know where it is')
    page.round_trip()
    assert page.js('document.querySelector(".marker")') is None


def test_the_map_says_whether_the_chair_is_sure(page):
    page.load('map')
    page.until('document.querySelector(".where p").textContent === "The chair is sure where it is."')
    page.chair.state['lost'] = None
    page.until('document.querySelector(".where p").textContent.includes("does not say how sure")')


def test_a_way_waits_while_the_chair_is_lost(page):
    page.load('go')
    page.chair.state['goal'] = {'state': 'going', 'place': 'kitchen', 'pose': [0, 0, 0], 'left': 8.0}
    page.until('sara.chair.isGoing')
    page.chair.state['lost'] = True
    page.until(f'document.getElementById("sentence").textContent === "{LOST} The way to Kitchen waits."')
    page.chair.state['gate'] = {'state': 'HELD', 'reasons': ['IMPACT']}
    page.until('document.getElementById("sentence").textContent.includes("hit by something")')


def test_who_may_only_look_cannot_say_where_the_chair_is(page):
    page.load('go', role='look')
    page.chair.state['lost'] = True
    page.until(f'document.querySelector(".where p")?.textContent === "{LOST}"')
    assert page.js('document.querySelectorAll("[data-here]").length') == 0


def test_where_the_chair_is_that_is_refused_is_said(page):
    page.load('map')
    page.click('[data-here=kitchen]')
    page.chair.wait_for('pose')
    page.chair.send({'op': 'error', 'key': 'error.no_place', 'values': {'place': 'kitchen'}, 'of': 'pose'})
    page.until('document.getElementById("notice").textContent === "There is no place called Kitchen."')


def test_settings_are_kept_and_the_language_changes_at_once(page):
    page.load('settings')
    page.click('[data-set=language][data-value=es]')
    page.until('document.querySelector("h1").textContent === "Ajustes" && document.documentElement.lang === "es"')
    page.until('document.getElementById("sentence").textContent === "La silla está lista."')
    page.click('[data-set=hands][data-value=left]')
    page.click('[data-set=contrast][data-value=high]')
    page.click('[data-set=dwell_time][data-value=less]')
    kept = page.js('JSON.parse(localStorage.getItem("sara.settings"))')
    assert (kept['language'], kept['hands'], kept['contrast'], kept['dwell_time']) == ('es', 'left', 'high', 1.1)
    stop, tabs = page.middle('#stop')[0], page.middle('#tabs')[0]
    assert stop < tabs


def test_a_language_whose_words_do_not_come_is_not_taken(page):
    page.load('settings')
    page.chair.missing = ('es.json',)
    page.click('[data-value=es]')
    page.until('document.getElementById("notice").textContent.startsWith("That was not sent")')
    assert page.js('sara.settings.get("language")') == 'en'
    assert page.js('document.querySelector("[data-value=en]").getAttribute("aria-pressed")') == 'true'
    page.chair.missing = ()
    page.click('[data-value=es]')
    page.until('document.documentElement.lang === "es"')
    page.driver.get_log('browser')  # says that the words were missing


def test_a_page_whose_words_do_not_come_at_once_asks_again(page):
    page.load('go')
    page.chair.missing = ('en.json',)
    page.driver.execute_script('location.reload()')
    page.chair.wait(lambda: page.chair.requests.count('/words/en.json') > 2)
    page.chair.missing = ()
    page.until('window.sara && document.getElementById("sentence").textContent === "The chair is ready."')
    page.driver.get_log('browser')


@pytest.mark.parametrize('name, least, most', [('dwell_time', 0.3, 3.0), ('scan_period', 0.5, 5.0)])
def test_times_have_their_limits(page, name, least, most):
    page.load('settings')
    for value, limit in (('less', least), ('more', most)):
        page.driver.execute_script(
            'const [name, value] = arguments;'
            'for (let k = 0; k < 60; k++) document.querySelector(`[data-set=${name}][data-value=${value}]`).click()',
            name,
            value,
        )
        assert page.js(f'sara.settings.get("{name}")') == limit


def test_a_page_that_is_not_paired_asks_for_the_code(page):
    page.load('go', role='none')
    page.until('!!document.getElementById("code")')
    page.driver.execute_script('document.getElementById("code").value = "wrong-code"')
    page.click('.screen-pair .primary')
    page.until('document.getElementById("notice").textContent === "That code is not right."')
    page.driver.execute_script('document.getElementById("code").value = "abcd-2345"')
    page.click('.screen-pair .primary')
    page.chair.wait(lambda: page.chair.frames('hello')[-1].get('token') == 'a-token')
    page.until('document.querySelectorAll(".tile").length === 9')


def test_an_invitation_shows_its_code_and_picture(page):
    page.load('settings')
    page.click('[data-invite=carer]')
    assert asked(page) == 'Code for a carer'
    assert text(page, '.code') == 'ABCD-2345'
    page.until('document.querySelector(".qr").naturalWidth > 0')


def test_who_may_only_look_may_stop(page):
    page.load('go', role='look')
    assert page.js('[...document.querySelectorAll(".tile")].every((n) => n.disabled)')
    page.click('#stop')
    page.chair.wait_for('stop')


def test_the_chair_s_own_voice_says_what_happens(page):
    page.load('go', speech='chair')
    page.chair.state['gate'] = {'state': 'SLOWED', 'reasons': ['PEOPLE']}
    wanted = {'op': 'say', 'key': 'state.SLOWED', 'values': {'reason': 'reason.PEOPLE'}, 'language': 'en'}
    page.chair.wait(lambda: wanted in page.chair.frames('say'))


def test_the_chair_s_own_voice_follows_the_language_and_answers_why_though_it_speaks(page):
    page.load('settings', speech='chair')
    page.click('[data-set=language][data-value=es]')
    page.until('document.documentElement.lang === "es"')
    page.driver.execute_script('location.hash = "why"')
    page.chair.state['gate'] = {'state': 'HELD', 'reasons': ['LOCALIZATION']}
    page.until('document.querySelector(".help")?.textContent.startsWith("Abra el mapa")')  # or what is below moves
    page.click('[data-do=say]')
    page.chair.wait(lambda: sum(frame.get('asked', False) for frame in page.chair.frames('say')) == 2)
    assert {frame['language'] for frame in page.chair.frames('say') if frame.get('asked')} == {'es'}
