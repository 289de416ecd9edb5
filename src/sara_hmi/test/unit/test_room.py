"""Strangers take no connection that somebody else needs."""

from dataclasses import replace

import pytest

from sara_hmi.config.config import NetworkConfig
from sara_hmi.web.room import Held, room

LIMITS = NetworkConfig(connections=6, connections_per_address=4, strangers=2)
TABLET, OTHER, HERE = '192.168.1.5', '192.168.1.6', '127.0.0.1'


def stranger(number, peer=OTHER, local=False):
    return Held(number, peer, local, False)


def known(number, peer=TABLET, local=False):
    return Held(number, peer, local, True)


def test_there_is_room_until_there_is_none():
    held = [known(1, 'a'), known(2, 'b'), known(3, 'c'), known(4, 'd'), known(5, 'e')]
    assert room(held, TABLET, False, LIMITS) == (True, None)
    assert room([*held, known(6, 'f')], TABLET, False, LIMITS) == (False, None)


def test_an_address_has_its_share():
    held = [known(number) for number in range(1, 5)]
    assert room(held, TABLET, False, LIMITS) == (False, None)
    assert room(held, OTHER, False, LIMITS) == (True, None)


def test_the_oldest_stranger_makes_room():
    held = [stranger(3), known(4), stranger(7)]
    assert room(held, TABLET, False, LIMITS) == (True, 3)
    assert room(held[:2], TABLET, False, LIMITS) == (True, None)
    full = [stranger(9), stranger(8), *(known(number, str(number)) for number in range(4))]
    assert room(full, TABLET, False, LIMITS) == (True, 8)


def test_nobody_is_ended_for_who_is_not_let_in():
    held = [stranger(1), stranger(2), *(known(number) for number in range(3, 7))]
    assert room(held, TABLET, False, LIMITS) == (False, None)


def test_a_flood_of_strangers_leaves_room_for_paired_devices_and_for_this_computer():
    held, newest = [known(1)], 2
    for _ in range(50):
        may, ended = room(held, f'10.0.0.{newest}', False, LIMITS)
        assert may
        held = [one for one in held if one.number != ended] + [stranger(newest, f'10.0.0.{newest}')]
        newest += 1
    assert known(1) in held and len(held) == 1 + LIMITS.strangers
    assert room(held, TABLET, False, LIMITS)[0] and room(held, HERE, True, LIMITS) == (True, None)


@pytest.mark.parametrize('many', [3, 6])
def test_this_computer_is_counted_apart_and_its_pages_are_never_ended(many):
    limits = replace(LIMITS, connections_per_address=10)
    held = [stranger(number, HERE, True) for number in range(many)]
    assert room(held, HERE, True, limits) == (many < limits.connections, None)
    assert room(held, TABLET, False, limits) == (True, None)
