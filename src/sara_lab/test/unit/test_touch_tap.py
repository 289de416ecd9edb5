"""What a page says is read from the bytes of its connection, however they are cut."""

import json

import pytest

from sara_lab.fuzz.touch.tap import Tap, commands, page_clock

HEAD = b'GET /style.css HTTP/1.1\r\nHost: a\r\n\r\nGET /ws HTTP/1.1\r\nUpgrade: websocket\r\n\r\n'
KEY = bytes([7, 31, 200, 5])
LIMITS = {'max_forward': 0.8, 'max_reverse': 0.4}


def framed(text, opcode=1):
    """As a browser sends it."""
    data = text.encode()
    size = bytes([0x80 | len(data)]) if len(data) < 126 else bytes([0x80 | 126]) + len(data).to_bytes(2, 'big')
    return bytes([0x80 | opcode]) + size + KEY + bytes(byte ^ KEY[k % 4] for k, byte in enumerate(data))


FRAMES = [{'op': 'hello', 'version': 1}, {'op': 'drive', 't': 40.0, 'v': 0.5}, {'op': 'say', 'key': 'k' * 300}]


@pytest.mark.parametrize('size', [1, 2, 3, 7, 100, 10000])
def test_frames_are_read_however_the_bytes_are_cut(size):
    data = HEAD + framed('', opcode=9) + b''.join(framed(json.dumps(frame)) for frame in FRAMES)
    tap = Tap()
    for start in range(0, len(data), size):
        tap.feed(start, data[start : start + size])
    assert [one.frame for one in tap.said] == FRAMES
    assert [one.t for one in tap.said] == sorted(one.t for one in tap.said)


def test_a_frame_that_is_too_long_is_said():
    tap = Tap()
    with pytest.raises(ValueError, match='64 kB'):
        tap.feed(0.0, HEAD + bytes([0x81, 0xFF]) + bytes(20))


def said(*entries):
    """Commands of (when they passed s, the page's clock ms, v)."""
    tap = Tap()
    tap.feed(0.0, HEAD)
    for t, clock, v in entries:
        tap.feed(t, framed(json.dumps({'op': 'drive', 't': clock, 'v': v})))
    return tap.said


def test_a_command_that_waited_in_the_browser_is_as_old_as_the_page_says():
    held = said((10.001, 1000.0, 0.5), (10.05, 1050.0, 0.6), (12.0, 1100.0, -0.5))
    assert page_clock(held) == pytest.approx(9.0)
    made = commands(held, LIMITS)
    assert list(made) == [0.4, 0.48, -0.2]
    assert list(made.values()) == pytest.approx([10.0, 10.05, 10.1])
