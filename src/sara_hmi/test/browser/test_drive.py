"""Driving by stick, arrows and keys: what leaves the page while something is held, and that nothing does afterwards."""

import pytest

UP = 70  # px above the middle of the stick


def take_stick(page):
    """Press the stick, push it forward and wait until it drives; returns where the pointer is."""
    x, y = page.middle('#stick')
    page.mouse('Pressed', x, y, held=True)
    page.mouse('Moved', x, y - UP, held=True)
    page.chair.wait_for('drive', count=3)
    return x, y - UP


def assert_at_rest(page):
    """The newest of what drives or halts is a halt, and stays it."""
    page.chair.wait_for('halt')
    page.round_trip()
    assert [frame['op'] for frame in page.chair.frames('drive', 'halt')][-1] == 'halt'
    assert page.js('sara.pump.isHeld') is False


def test_the_stick_drives_with_the_newest_beat(page):
    page.load('drive')
    x, y = take_stick(page)
    drives = page.chair.wait_for('drive', count=8)
    page.chair.wait(lambda: page.chair.frames('drive')[-1]['n'] > drives[0]['n'])
    page.mouse('Released', x, y)
    assert_at_rest(page)
    frames = page.chair.frames('drive', 'halt')
    assert [frame['seq'] for frame in frames] == list(range(1, len(frames) + 1))
    drives = [received for received in page.chair.received if received.frame['op'] == 'drive']
    assert all(0 < received.frame['n'] <= received.beat for received in drives)
    assert drives[-1].frame['n'] > drives[0].frame['n']
    first, last = drives[2].frame, drives[-1].frame
    assert (first['v'], first['w']) == (last['v'], last['w']) and 0.5 < first['v'] <= 1.0 and abs(first['w']) < 0.02
    assert page.chair.frames('take') and page.chair.frames('halt') == [{'op': 'halt', 'seq': frames[-1]['seq']}]


def press_by_finger(page):
    """Put a finger on the stick, push it forward and wait until it drives; returns where it is."""
    x, y = page.middle('#stick')
    page.touch('Start', (x, y))
    page.touch('Move', (x, y - UP))
    page.chair.wait_for('drive', count=3)
    return x, y - UP


@pytest.mark.parametrize('end', ['End', 'Cancel'])
def test_a_finger_drives_until_it_is_lifted(page, end):
    page.load('drive')
    x, y = press_by_finger(page)
    page.touch('Move', (x + 10.0, y))
    page.chair.wait(lambda: page.chair.frames('drive')[-1]['w'] < -0.05)
    page.touch(end)
    assert_at_rest(page)
    assert len(page.chair.frames('halt')) == 1 and all(frame['v'] > 0.3 for frame in page.chair.frames('drive'))


def test_a_finger_that_slides_off_the_stick_goes_on_driving(page):
    page.load('drive')
    x, _ = press_by_finger(page)
    page.touch('Move', (x, 5.0))
    page.chair.wait(lambda: page.chair.frames('drive')[-1]['v'] == 1.0)
    page.touch('End')
    assert_at_rest(page)


HIDDEN = (
    'Object.defineProperty(document, "visibilityState", {value: "hidden", configurable: true});'
    'document.dispatchEvent(new Event("visibilitychange")); delete document.visibilityState'
)
POINTER = 'document.getElementById("stick").dispatchEvent(new PointerEvent("{}", {{pointerId: 1, bubbles: true}}))'
LEAVING = {
    'pointerup': POINTER.format('pointerup'),
    'pointercancel': POINTER.format('pointercancel'),
    'lostpointercapture': POINTER.format('lostpointercapture'),
    'blur': 'window.dispatchEvent(new Event("blur"))',
    'visibilitychange': HIDDEN,
    'pagehide': 'window.dispatchEvent(new PageTransitionEvent("pagehide"))',
    'freeze': 'document.dispatchEvent(new Event("freeze"))',
    'resize': 'window.dispatchEvent(new Event("resize"))',
    'another screen': 'location.hash = "why"',
    'the controls are asked for': 'sara.connection.emit("asked", {session: 9, name: "Ana"})',
    'a command was refused': 'sara.connection.emit("ack", {ok: false, why: "error.drive_not_driver"})',
}


@pytest.mark.parametrize('way', LEAVING)
def test_whatever_ends_the_hold_halts_at_once(page, way):
    page.load('drive')
    x, y = take_stick(page)
    page.driver.execute_script(LEAVING[way])
    assert_at_rest(page)
    page.mouse('Moved', x, y + 20, held=True)  # the button is still down: nothing drives until it is pressed anew
    page.mouse('Moved', x, y + 30, held=True)
    assert_at_rest(page)
    assert len(page.chair.frames('halt')) == 1


def test_after_a_rest_the_stick_has_to_be_taken_again(page):
    page.load('drive')
    x, y = take_stick(page)
    page.driver.execute_script(LEAVING['blur'])
    assert_at_rest(page)
    page.mouse('Released', x, y)
    count = len(page.chair.frames('drive'))
    take_stick(page)
    page.chair.wait_for('drive', count=count + 3)
    page.let_go()


def test_offline_halts_and_a_new_connection_begins_at_rest(page):
    page.load('drive')
    x, y = take_stick(page)
    page.cdp('Network.enable')
    page.cdp('Network.emulateNetworkConditions', offline=True, latency=0, downloadThroughput=-1, uploadThroughput=-1)
    page.until('!sara.pump.isHeld')
    page.cdp('Network.emulateNetworkConditions', offline=False, latency=0, downloadThroughput=-1, uploadThroughput=-1)
    page.until('sara.connection.isOpen && sara.chair.welcome')
    page.mouse('Moved', x, y + 20, held=True)
    page.round_trip()
    after = max(k for k, received in enumerate(page.chair.received) if received.frame['op'] == 'hello')
    assert [r.frame for r in page.chair.received[after:] if r.frame['op'] in ('drive', 'take')] == []


def test_a_cut_connection_begins_at_rest(page):
    page.load('drive')
    x, y = take_stick(page)
    page.chair.cut()
    page.until('!sara.pump.isHeld')
    page.chair.wait_for('hello', count=2)
    page.until('sara.connection.isOpen && sara.chair.welcome')
    page.mouse('Moved', x, y + 20, held=True)
    page.round_trip()
    after = max(k for k, received in enumerate(page.chair.received) if received.frame['op'] == 'hello')
    assert [r.frame for r in page.chair.received[after:] if r.frame['op'] in ('drive', 'take')] == []
    assert page.js('sara.connection.beat') is None


def test_frames_that_were_held_on_their_way_carry_old_beats(page):
    page.load('drive')
    take_stick(page)
    page.chair.hold()
    page.until('sara.connection.seq > arguments[0] + 2', page.js('sara.connection.seq'))  # commands are on their way
    page.limits()
    page.until('!sara.pump.isHeld')  # no echo and no answer: the page itself gives up
    page.until('performance.now() - sara.connection.beatAt < 40')  # beats still come
    held_until = page.chair.wait(lambda: page.chair.beat > newest_sent(page) + 8 and page.chair.beat)
    page.chair.let_through()
    page.chair.wait_for('halt')
    burst = [r for r in page.chair.received if r.frame['op'] == 'drive' and r.beat >= held_until]
    assert burst
    for received in burst:
        assert received.t - page.chair.beat_sent[received.frame['n']] > 0.2
    assert_at_rest(page)


def newest_sent(page):
    """The beat of the newest command that the page may have sent: none after it rested."""
    return page.js('sara.restedAt ??= sara.connection.beat')


def test_without_beats_nothing_drives(page):
    page.load('drive')
    x, y = take_stick(page)
    page.limits()
    page.chair.state['driver'] = None  # no beat any more, and another state
    assert_at_rest(page)
    page.mouse('Released', x, y)


def test_a_page_that_stood_still_begins_at_rest(page):
    page.load('drive')
    take_stick(page)
    page.limits(frozen_ms=300, stale_beat_ms=20_000, slow_ms=20_000)
    page.driver.execute_script('const end = performance.now() + 500; while (performance.now() < end);')
    assert_at_rest(page)
    assert 'left' in page.js('document.getElementById("notice").textContent')


def test_a_slow_connection_is_said_and_does_not_drive(page):
    page.load('drive')
    page.limits()
    page.chair.answers_echo = False
    page.until('document.querySelector(".banner").textContent.startsWith("The connection is too slow")')
    page.until('performance.now() - (sara.connection.askedAt ?? Infinity) > 500')  # no answer is on its way any more
    x, y = page.middle('#stick')
    page.mouse('Pressed', x, y, held=True)
    page.mouse('Moved', x, y - UP, held=True)
    page.chair.answers_echo = True
    page.driver.execute_script('sara.connection.askedAt = performance.now() - 999')
    page.mouse('Released', x, y - UP)
    assert page.chair.frames('drive') == []


@pytest.mark.parametrize('why, said', [
    ('error.drive_late', 'too slow'), ('error.drive_lift', 'too slow'), ('error.drive_stopped', 'emergency stop'),
    ('error.drive_unheard', 'takes commands'),
])  # fmt: skip
def test_a_refused_command_ends_the_hold_and_is_said(page, why, said):
    page.load('drive')
    page.chair.refuses = why
    x, y = page.middle('#stick')
    page.mouse('Pressed', x, y, held=True)
    page.mouse('Moved', x, y - UP, held=True)
    assert_at_rest(page)
    assert said in page.js('document.getElementById("notice").textContent')


@pytest.mark.parametrize('way, v, w', [('up', 0.7, 0.0), ('down', -0.7, 0.0), ('left', 0.0, 0.7), ('right', 0.0, -0.7)])
def test_a_held_arrow_drives_until_it_is_let_go(page, way, v, w):
    page.load('drive')
    x, y = page.middle(f'.arrow-{way}')
    page.mouse('Pressed', x, y, held=True)
    drives = page.chair.wait_for('drive', count=3)
    page.mouse('Moved', x + 400, y, held=True)
    page.mouse('Released', x + 400, y)
    assert_at_rest(page)
    assert {(frame['v'], frame['w']) for frame in drives} == {(v, w)}


def test_a_tapped_arrow_drives_one_step(page):
    page.load('drive', arrows='step', step=0.5)
    page.controls()
    page.click('.arrow-up')
    assert_at_rest(page)
    assert {(frame['v'], frame['w']) for frame in page.chair.frames('drive')} == {(0.7, 0.0)}
    first = page.chair.frames('drive')[0]['t']
    assert page.chair.frames('drive')[-1]['t'] - first < 3000.0


def test_arrow_keys_drive_while_they_are_held_and_add_up(page):
    page.load('drive')
    page.key('ArrowUp', 'Down')
    page.chair.wait_for('drive', count=2)
    page.key('ArrowLeft', 'Down')
    page.chair.wait(lambda: page.chair.frames('drive')[-1]['w'] == 0.7)
    page.key('ArrowUp', 'Down', repeat=True)
    page.key('ArrowUp', 'Up')
    page.chair.wait(lambda: page.chair.frames('drive')[-1]['v'] == 0.0)
    page.key('ArrowLeft', 'Up')
    assert_at_rest(page)


def drives_anew(page):
    """Whoever held before has halted, and another one drives."""
    page.chair.wait_for('halt')
    page.chair.wait_for('drive', count=len(page.chair.frames('drive')) + 3)


def stick_then_key(page):
    x, y = take_stick(page)
    page.key('ArrowUp', 'Down')
    drives_anew(page)
    page.key('ArrowUp', 'Up')
    page.mouse('Released', x, y)


def key_then_stick(page):
    page.key('ArrowUp', 'Down')
    page.chair.wait_for('drive', count=3)
    take_stick(page)
    page.let_go()
    page.key('ArrowUp', 'Up')


def arrow_then_stick_by_two_fingers(page):
    arrow, (x, y) = page.middle('[data-way=up]'), page.middle('#stick')
    page.touch('Start', arrow)
    page.chair.wait_for('drive', count=3)
    page.touch('Start', arrow, (x, y - UP))
    drives_anew(page)
    page.touch('End')


@pytest.mark.parametrize('use', [stick_then_key, key_then_stick, arrow_then_stick_by_two_fingers])
def test_with_two_things_held_one_after_the_other_nothing_drives_once_both_are_let_go(page, use):
    page.load('drive')
    use(page)
    assert_at_rest(page)
    count = len(page.chair.frames('drive'))
    page.round_trip()
    assert len(page.chair.frames('drive')) == count
    page.key('ArrowUp', 'Down')  # and it can be driven again
    page.chair.wait_for('drive', count=count + 3)
    page.key('ArrowUp', 'Up')
    assert_at_rest(page)


def test_keys_that_repeat_after_the_focus_was_lost_drive_nothing(page):
    page.load('drive')
    page.key('ArrowUp', 'Down')
    page.chair.wait_for('drive', count=2)
    page.driver.execute_script(LEAVING['blur'])
    page.key('ArrowUp', 'Down', repeat=True)
    page.key('ArrowUp', 'Down', repeat=True)
    assert_at_rest(page)
    page.key('ArrowUp', 'Up')


def test_arrow_buttons_by_keyboard_drive_while_enter_is_held(page):
    page.load('drive')
    page.driver.execute_script('document.querySelector(".arrow-left").focus()')
    page.key('Enter', 'Down')
    page.chair.wait_for('drive', count=2)
    page.key('Enter', 'Up')
    assert_at_rest(page)


META = {'key': 'Meta', 'code': 'MetaLeft', 'windowsVirtualKeyCode': 91}
ENTER = {'key': 'Enter', 'code': 'Enter', 'windowsVirtualKeyCode': 13, 'text': '\r'}


def test_meta_ends_what_is_held_for_macos_tells_of_no_key_let_go_meanwhile(page):
    page.load('drive')
    page.key('ArrowUp', 'Down')
    page.chair.wait_for('drive', count=3)
    page.cdp('Input.dispatchKeyEvent', type='rawKeyDown', modifiers=4, **META)
    assert_at_rest(page)
    page.cdp('Input.dispatchKeyEvent', type='keyUp', **META)
    page.key('ArrowUp', 'Up')


def test_enter_with_meta_on_an_arrow_is_a_step(page):
    page.load('drive', step=0.5)
    page.controls()
    page.driver.execute_script('document.querySelector(".arrow-up").focus()')
    page.cdp('Input.dispatchKeyEvent', type='rawKeyDown', modifiers=4, **META)
    page.cdp('Input.dispatchKeyEvent', type='keyDown', modifiers=4, **ENTER)
    page.cdp('Input.dispatchKeyEvent', type='keyUp', **META)
    page.chair.wait_for('drive', count=2)
    assert_at_rest(page)
    page.key('Enter', 'Up')


def test_an_arrow_that_was_held_before_does_not_end_the_next_one(page):
    page.load('drive')
    for way in ('up', 'left'):
        x, y = page.middle(f'.arrow-{way}')
        page.mouse('Pressed', x, y, held=True)
        page.chair.wait(lambda: len(page.chair.frames('drive')) > 2)
        if way == 'left':
            page.chair.wait(lambda: sum(frame['w'] == 0.7 for frame in page.chair.frames('drive')) > 3)
        page.mouse('Released', x, y)
        assert_at_rest(page)


def test_who_asked_for_the_controls_and_leaves_asks_no_more(page):
    page.load('drive')
    page.chair.state['driver'] = 9
    page.chair.send({'op': 'driver', 'session': 9, 'name': 'ui.other_drives'})  # a name, though it is a key, too
    page.until('!!document.querySelector("[data-offer=take]")')
    page.driver.execute_script('location.hash = "go"')
    page.chair.wait_for('release')


def test_a_hold_while_another_drives_does_not_wait_for_the_controls(page):
    page.load('drive')
    page.chair.state['driver'] = 3
    page.until('sara.chair.driver === 3')
    x, y = page.middle('#stick')
    page.mouse('Pressed', x, y, held=True)
    page.mouse('Moved', x, y - UP, held=True)
    assert not page.js('sara.pump.isHeld')
    page.chair.state['driver'] = None
    page.until('sara.chair.driver === null')
    page.mouse('Moved', x, y - UP + 5, held=True)
    page.round_trip()
    assert page.chair.frames('take', 'drive') == []
    page.mouse('Released', x, y)
    take_stick(page)


def test_who_drives_is_asked_for_the_controls_and_may_keep_them(page):
    page.load('drive')
    page.chair.state['driver'] = 3
    page.until('!!document.querySelector("[data-offer=take]")')
    x, y = page.middle('#stick')
    page.mouse('Pressed', x, y, held=True)
    page.mouse('Moved', x, y - UP, held=True)
    page.mouse('Released', x, y - UP)
    assert page.chair.frames('take', 'drive') == []
    page.click('[data-offer=take]')
    page.chair.wait_for('take')
    page.chair.send({'op': 'asked', 'session': 9, 'name': 'Ana', 'seconds': 15})
    page.until('!document.getElementById("question").hidden')
    assert (
        page.js('document.getElementById("question-title").textContent')
        == 'Ana wants to drive. Hand over the controls?'
    )
    page.click('[data-answer=refuse]')
    assert page.chair.wait_for('refuse') == [{'op': 'refuse', 'session': 9}]


@pytest.mark.parametrize('end', ['passed on', 'its time is over', 'cut'])
def test_a_question_for_the_controls_goes_when_there_is_nothing_to_answer_any_more(page, end):
    page.load('drive')
    take_stick(page)
    page.driver.execute_script(
        'const question = document.getElementById("question");'
        'sara.connection.addEventListener("asked", () => { window.shown = !question.hidden; })'
    )
    page.chair.send({'op': 'asked', 'session': 9, 'name': 'Ana', 'seconds': 1.0 if end == 'its time is over' else 99})
    page.until('window.shown')
    if end == 'passed on':
        page.chair.state['driver'] = 9
    elif end == 'cut':
        page.chair.cut()
    page.until('document.getElementById("question").hidden && !document.getElementById("screen").inert')
    page.round_trip() if end != 'cut' else None
    assert page.chair.frames('grant', 'refuse') == []


def test_the_profile_is_chosen_and_shown(page):
    page.load('drive')
    page.click('[data-profile=gentle]')
    assert page.chair.wait_for('profile') == [{'op': 'profile', 'name': 'gentle'}]
    page.until('document.querySelector("[data-profile=gentle]").getAttribute("aria-pressed") === "true"')


def test_where_the_chair_does_otherwise_an_arrow_and_a_sentence_say_so(page):
    page.load('drive')
    page.chair.state |= {'asked': {'v': 0.8, 'w': 0.0}, 'v': 0.1, 'gate': {'state': 'SLOWED', 'reasons': ['FRONT']}}
    page.until('!document.getElementById("deviation").hidden')
    assert page.js('document.getElementById("deviation").textContent') == (
        'You ask for forward; the chair goes that way, but more slowly.'
    )
    assert page.js('document.querySelectorAll("#deviation .asked, #deviation .driven").length') == 2
    assert page.js('document.getElementById("sentence").textContent') == (
        'The chair goes slowly because something is close in front.'
    )
    page.chair.state |= {'v': 0.0, 'gate': {'state': 'BLOCKED', 'reasons': ['FRONT']}}
    page.until('document.getElementById("deviation").textContent === "You ask for forward; the chair stands."')
    page.chair.state |= {'asked': None}
    page.until('document.getElementById("deviation").hidden')


OVERRIDE = 'document.querySelector("[data-do=override]")'
PROFILES = ['much', 'little', 'switches', 'gate_only']
HELPS = {'does': '', 'command': None, 'left': 0, 'lasts': 20, 'profile': 'much', 'profiles': PROFILES}


def drawn(page, name):
    """The arrow of that name, as its path and its angle."""
    return page.js(
        f'["d", "transform"].map((n) => document.querySelector("#deviation .{name}").getAttribute(n)).join()'
    )


def test_what_shared_control_does_otherwise_is_said_and_drawn(page):
    page.load('drive', language='es', speech='chair')
    page.chair.state |= {
        'asked': {'v': 0.4, 'w': 0.0},
        'v': 0.4,
        'gate': {'state': 'DRIVING', 'reasons': []},
        'assist': HELPS | {'does': 'LEFT', 'command': {'v': 0.4, 'w': 0.3}},
    }
    page.until('!document.getElementById("deviation").hidden')
    left = 'La silla gira a la izquierda para no tocar nada.'
    assert page.js('document.getElementById("deviation").textContent') == left
    assert drawn(page, 'asked').endswith('rotate(0)') and 'rotate(-' in drawn(page, 'driven')
    left = {'op': 'say', 'key': 'assist.LEFT', 'values': {}, 'language': 'es'}
    page.chair.wait(lambda: left in page.chair.frames('say'))
    page.chair.state['assist'] = HELPS | {'does': 'SLOWER', 'command': {'v': 0.3, 'w': 0.0}}
    slower = 'La silla va más despacio porque hay poco sitio.'
    page.until(f'document.getElementById("deviation").textContent === "{slower}"')
    before = drawn(page, 'driven')
    page.chair.state['assist'] = HELPS | {'does': 'SLOWER', 'command': {'v': 0.1, 'w': 0.0}}
    page.until(f'document.querySelector("#deviation .driven").getAttribute("d") !== {before.split(",")[0]!r}')
    page.chair.state |= {'v': 0.0, 'gate': {'state': 'HELD', 'reasons': ['IMPACT']}}  # the gate has the last word
    page.until('document.getElementById("deviation").textContent === "Usted pide ir adelante; la silla está parada."')
    page.chair.state |= {'v': 0.4, 'gate': {'state': 'DRIVING', 'reasons': []}, 'assist': HELPS}
    page.until('document.getElementById("deviation").hidden')
    assert sum(frame['key'] == 'assist.SLOWER' for frame in page.chair.frames('say')) == 1


def test_a_command_of_shared_control_that_is_no_number_draws_nothing_odd(page):
    page.load('drive')
    page.chair.state |= {
        'asked': {'v': 0.4, 'w': 0.0},
        'v': 0.4,
        'assist': HELPS | {'does': 'STOPS', 'command': {'v': None, 'w': None}},
    }
    page.until('!document.getElementById("deviation").hidden')
    assert 'NaN' not in page.js('document.getElementById("deviation").innerHTML')


@pytest.mark.parametrize('by', ['touch', 'keyboard', 'switch'])
def test_the_rider_drives_without_help_for_a_while(page, by):
    page.load('drive', **({'scan': 'step'} if by == 'switch' else {}))
    assert not page.js(OVERRIDE)
    page.chair.state['assist'] = dict(HELPS)
    page.until(f'{OVERRIDE}?.textContent === "Without help for 20\u00a0s"')
    size = page.js(f'(({{width, height}}) => [width, height])({OVERRIDE}.getBoundingClientRect())')
    assert min(size) >= 60

    def press():
        if by == 'touch':
            page.touch('Start', page.middle('[data-do=override]'))
            page.touch('End')
        elif by == 'keyboard':
            page.driver.execute_script(f'{OVERRIDE}.focus()')
            page.key('Enter')
        else:
            lit = 'document.querySelector(".scanned")'
            for _ in range(20):
                if page.js(f'{lit}?.contains({OVERRIDE}) && {lit}.querySelectorAll("button").length < 2'):
                    break
                page.debounced()
                page.key(' ')
            page.debounced()
            page.key('Enter')

    press()
    assert page.chair.wait_for('override') == [{'op': 'override', 'on': True}]
    page.until(f'{OVERRIDE}.textContent === "Help again (20\u00a0s)"')
    page.until('document.querySelector(".banner").textContent === "The chair does not help: you go alone."')
    page.chair.state['assist'] |= {'left': 7}
    page.until(f'{OVERRIDE}.textContent === "Help again (7\u00a0s)"')
    press()
    assert page.chair.wait_for('override', count=2)[-1] == {'op': 'override', 'on': False}
    page.until(f'{OVERRIDE}.textContent === "Without help for 20\u00a0s"')
    page.chair.state['assist'] = None
    page.until(f'!{OVERRIDE}')


def test_only_who_has_the_controls_may_go_without_help(page):
    page.load('drive')
    page.chair.state |= {'assist': dict(HELPS), 'driver': 3}
    page.until(f'{OVERRIDE}?.disabled === true')
    page.chair.state['driver'] = None
    page.until(f'{OVERRIDE}.disabled === false')
    page.load('drive', role='look')
    page.chair.state['assist'] = dict(HELPS)
    page.until(f'{OVERRIDE}?.disabled === true')


def test_that_the_chair_does_not_help_is_said_on_every_screen(page):
    page.load('why', speech='chair')
    page.chair.state['assist'] = HELPS | {'does': 'UNKNOWN'}
    unknown = {'op': 'say', 'key': 'assist.UNKNOWN', 'values': {}, 'language': 'en'}
    page.chair.wait(lambda: unknown in page.chair.frames('say'))
    sentence = 'The chair does not help: it does not know what is around it.'
    page.until(f'document.querySelector(".doing").textContent === "{sentence}"')


def test_a_low_battery_is_shown_and_spoken_of_once_and_again_where_it_is_nearly_empty(page):
    def spoken():
        return [frame['values']['percent'] for frame in page.chair.frames('say') if frame['key'] == 'ui.battery_low']

    page.load('drive', speech='chair')
    page.until('document.getElementById("facts").textContent === "Battery 82 %"')
    for share, told in (
        (0.2, ['20']),
        (0.19, ['20']),
        (0.1, ['20', '10']),
        (0.21, ['20', '10']),
        (0.09, ['20', '10', '9']),
    ):
        page.chair.state['battery'] = {'share': share, 'volts': 23.0}
        low = ': charge it soon' if share <= 0.2 else ''
        page.until(f'document.getElementById("facts").textContent === "Battery {100 * share:.0f} %{low}"')
        page.chair.wait(lambda told=told: spoken() == told)
    page.driver.execute_script('location.hash = "why"')
    page.until('document.getElementById("screen").textContent.includes("Battery 9 %: charge it soon")')


def pressed(page):
    """The profile that is shown as the one in use."""
    return page.js('document.querySelector("[data-help][aria-pressed=true]")?.dataset.help ?? null')


@pytest.mark.parametrize('language, names', [('en', 'Much Little Switches None'), ('es', 'Mucha Poca Botones Ninguna')])
def test_how_much_the_chair_helps_is_chosen_in_the_settings(page, language, names):
    page.load('settings', language=language)
    assert page.js('document.querySelectorAll("[data-help]").length') == 0
    page.chair.state['assist'] = dict(HELPS)
    page.until('document.querySelectorAll("[data-help]").length === 4')
    assert page.js('[...document.querySelectorAll("[data-help]")].map((n) => n.textContent).join(" ")') == names
    sizes = page.js('[...document.querySelectorAll("[data-help]")].map((n) => n.getBoundingClientRect().height)')
    assert min(sizes) >= 60 and pressed(page) == 'much'
    page.click('[data-help=gate_only]')
    assert page.chair.wait_for('help') == [{'op': 'help', 'name': 'gate_only'}]
    page.chair.wait(lambda: pressed(page) == 'gate_only')
    assert page.js('document.activeElement.dataset.help') == 'gate_only'
    page.chair.state['driver'] = 3  # another's
    page.until('document.querySelector("[data-help=much]").disabled')
    page.chair.state['assist'] = dict(HELPS) | {'profiles': ['much']}
    page.until('document.querySelectorAll("[data-help]").length === 0')


def test_without_help_there_is_no_button_to_go_without_it(page):
    page.load('drive')
    page.chair.state['assist'] = HELPS | {'does': 'OFF', 'profile': 'gate_only'}
    page.until('document.querySelector(".banner").textContent === "The chair does not help: its help is switched off."')
    assert not page.js(OVERRIDE)
    page.chair.state['assist'] = dict(HELPS)
    page.until(OVERRIDE)
