"""Laws of the checks of configurations: what is refused, and the sentence about it."""

import math
from dataclasses import dataclass
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_common.config import ConfigError, fault, filled, is_number, is_whole, number_faults, range_faults

no_numbers = st.sampled_from([True, False, None, 'fast', '1', math.nan, math.inf, -math.inf, 10**400, (1.0,), [2]])


def holding(**values):
    return SimpleNamespace(**values)


@given(no_numbers)
def test_what_is_no_number_is_refused_by_every_check(value):
    assert not is_number(value)
    assert number_faults(holding(a=value), above_0=('a',)) and number_faults(holding(a=value), from_0=('a',))
    assert range_faults(holding(a=value), {'a': (-1e9, 1e9)})


@given(st.floats(allow_nan=False, allow_infinity=False) | st.integers())
def test_numbers_are_taken_by_their_sign(value):
    assert is_number(value)
    assert bool(number_faults(holding(a=value), above_0=('a',))) == (value <= 0)
    assert bool(number_faults(holding(a=value), from_0=('a',))) == (value < 0)


@given(st.floats(-2.0, 3.0))
def test_ranges_hold_their_ends_but_for_an_open_one(value):
    assert bool(range_faults(holding(a=value), {'a': (0.0, 1.0)})) == (not 0.0 <= value <= 1.0)
    assert bool(range_faults(holding(a=value), {'a': (0.0, 1.0, True)})) == (not 0.0 < value <= 1.0)


def test_the_ends_of_a_range():
    for value, closed, opened in ((0.0, True, False), (1.0, True, True)):
        assert (not range_faults(holding(a=value), {'a': (0.0, 1.0)})) == closed
        assert (not range_faults(holding(a=value), {'a': (0.0, 1.0, True)})) == opened


@pytest.mark.parametrize('value, taken', [(0, True), (3, True), (4, False), (-1, False), (1.0, False), (True, False)])
def test_whole_numbers(value, taken):
    assert is_whole(value, 0, 3) == taken


def test_every_fault_is_a_sentence_of_one_form():
    config = holding(speed=-1.0, wait='long', gain=7.0, name='')
    assert number_faults(config, above_0=('speed',), from_0=('wait',), prefix='joystick/') == [
        'joystick/speed is -1.0, allowed are numbers above 0',
        "joystick/wait is 'long', allowed are numbers of 0 or more",
    ]
    assert range_faults(config, {'gain': (0.0, 5.0, True)}) == ['gain is 7.0, allowed are numbers above 0 to 5']
    assert range_faults(config, {'gain': (0.5, 5.0)}) == ['gain is 7.0, allowed are numbers from 0.5 to 5']
    assert fault(config, 'name', 'is one name') == "name is '', allowed is one name"


def test_an_error_holds_every_fault():
    error = ConfigError(['a is 1, allowed are 2 and 3', 'b is missing'], warnings=['c has no effect'])
    assert error.faults == ('a is 1, allowed are 2 and 3', 'b is missing') and error.warnings == ('c has no effect',)
    assert str(error) == 'a is 1, allowed are 2 and 3; b is missing'
    assert ConfigError('d is missing').faults == ('d is missing',) and isinstance(error, ValueError)


NO_LEAST = 'least is 1, but there is no such parameter'


@dataclass(frozen=True)
class Speeds:
    most: float = 1.0
    names: tuple = ()

    def __post_init__(self):
        faults = number_faults(self, above_0=('most',))
        if faults:
            raise ConfigError(faults)


def test_a_dataclass_is_filled_from_a_mapping():
    assert filled(Speeds, {}) == Speeds() and filled(Speeds, {'most': 2.0, 'names': ['a', 'b']}) == Speeds(
        2.0, ('a', 'b')
    )


@pytest.mark.parametrize(
    'params, faults',
    [
        (
            {'most': 0, 'least': 1},
            ('least is 1, but there is no such parameter', 'most is 0, allowed are numbers above 0'),
        ),
        ({'least': 1}, ('least is 1, but there is no such parameter',)),
        ([1], ('[1] is given where a mapping of parameters is allowed',)),
    ],
)
def test_what_does_not_fill_it_is_told_all_at_once(params, faults):
    with pytest.raises(ConfigError) as error:
        filled(Speeds, params)
    assert error.value.faults == faults
