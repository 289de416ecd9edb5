"""One driver at a time, hand-over by consent, and nobody is locked out by who is away."""

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from sara_hmi.config.config import CARER, LOOK, RIDER, ROLES, SessionsConfig
from sara_hmi.sessions.sessions import (
    MAY_NOT,
    NOT_ASKED,
    NOT_DRIVER,
    TAKE_PENDING,
    TAKE_REFUSED,
    Asked,
    DriverChanged,
    Refused,
    Session,
    Sessions,
)

CONFIG = SessionsConfig(ask_s=15.0)


@pytest.fixture(name='people')
def gathered():
    """1 a rider, who drives; 2 a carer; 3 a rider; 4 looks on."""
    people = Sessions(CONFIG)
    for number, role in ((1, RIDER), (2, CARER), (3, RIDER), (4, LOOK)):
        assert people.join(Session(number, role)) == []
    assert people.take(0.0, 1) == [DriverChanged(None, 1)]
    return people


def test_the_first_who_wants_to_drives(people):
    assert people.driver == 1
    assert people.take(0.0, 1) == []
    assert people.driver == 1 and people.asking is None


def test_who_looks_on_does_not_drive(people):
    assert people.take(0.0, 4) == [Refused(4, MAY_NOT)]
    people.release(1)
    assert people.take(0.0, 4) == [Refused(4, MAY_NOT)]
    assert people.driver is None


def test_release_lets_the_next_drive(people):
    assert people.release(2) == []
    assert people.release(1) == [DriverChanged(1, None)]
    assert people.driver is None
    assert people.take(1.0, 2) == [DriverChanged(None, 2)]


def test_the_driver_is_asked_and_grants(people):
    assert people.take(1.0, 2) == [Asked(1, 2, 15.0)]
    assert people.driver == 1 and people.asking == 2
    assert people.take(2.0, 2) == []  # asked already
    assert people.take(2.0, 3) == [Refused(3, TAKE_PENDING)]
    assert people.grant(1, 2) == [DriverChanged(1, 2)]
    assert people.driver == 2 and people.asking is None


def test_numbers_are_compared_by_value_and_order_does_not_matter():
    people = Sessions(CONFIG)
    for number in (1001, 1002, 1003):
        people.join(Session(number, RIDER))
    people.take(0.0, 1001)
    assert people.take(0.0, int('1001')) == [] and people.asking is None
    people.take(0.0, int('1003'))
    assert people.take(0.0, int('1003')) == [] and people.take(0.0, 1002) == [Refused(1002, TAKE_PENDING)]
    assert people.refuse(int('1001'), int('1003')) == [Refused(1003, TAKE_REFUSED)]
    people.take(0.0, int('1003'))
    assert people.release(int('1003')) == [] and people.asking is None
    people.take(0.0, int('1003'))
    assert people.leave(int('1003')) == [] and people.asking is None
    people.take(0.0, 1002)
    assert people.release(int('1001')) == [DriverChanged(1001, 1002)]
    assert people.leave(int('1002')) == [DriverChanged(1002, None)]


def test_a_question_that_is_looked_at_late_is_over(people):
    people.take(1.0, 2)
    assert people.step(99.0) == [DriverChanged(1, 2)]
    with pytest.raises(AttributeError):
        people.members[1].role = LOOK


def test_the_driver_refuses(people):
    people.take(1.0, 2)
    assert people.refuse(1, 2) == [Refused(2, TAKE_REFUSED)]
    assert people.driver == 1 and people.asking is None
    assert people.step(100.0) == []
    assert people.take(101.0, 3) == [Asked(1, 3, 15.0)]


@pytest.mark.parametrize('answer', ['grant', 'refuse'])
def test_only_the_driver_answers_and_only_who_asked(people, answer):
    assert getattr(people, answer)(1, 2) == [Refused(1, NOT_ASKED)]
    people.take(1.0, 2)
    assert getattr(people, answer)(3, 2) == [Refused(3, NOT_DRIVER)]
    assert getattr(people, answer)(2, 2) == [Refused(2, NOT_DRIVER)]
    assert getattr(people, answer)(1, 3) == [Refused(1, NOT_ASKED)]
    assert people.driver == 1 and people.asking == 2


def test_a_driver_who_is_away_is_followed(people):
    people.drove()  # before the question
    people.take(1.0, 2)
    assert people.step(15.999) == []
    assert people.step(16.0) == [DriverChanged(1, 2)]
    assert people.asking is None


def test_a_driver_who_drives_on_has_not_consented(people):
    people.take(1.0, 2)
    people.drove()
    assert people.step(15.999) == []
    assert people.step(16.0) == [Refused(2, TAKE_REFUSED)]
    assert people.driver == 1 and people.asking is None
    people.take(20.0, 2)  # what was driven before this question does not count
    assert people.step(35.0) == [DriverChanged(1, 2)]


def test_what_the_last_driver_drove_does_not_count(people):
    people.drove()
    people.take(0.0, 2)
    people.drove()
    people.grant(1, 2)
    people.take(1.0, 3)
    assert people.step(16.0) == [DriverChanged(2, 3)]


def test_who_asked_drives_when_the_driver_goes(people):
    people.take(1.0, 2)
    assert people.leave(1) == [DriverChanged(1, 2)]
    assert 1 not in people.members
    assert people.asking is None
    assert people.leave(2) == [DriverChanged(2, None)]
    assert people.leave(2) == []


def test_who_asked_drives_when_the_driver_releases(people):
    people.take(1.0, 3)
    assert people.release(1) == [DriverChanged(1, 3)]


def test_who_asked_and_went_is_not_waited_for(people):
    people.take(1.0, 2)
    assert people.leave(2) == []
    assert people.asking is None and people.driver == 1
    assert people.step(100.0) == []
    people.take(100.0, 3)
    assert people.release(3) == []
    assert people.asking is None and people.step(200.0) == []


def test_who_did_not_ask_goes_and_the_question_stays(people):
    people.take(1.0, 2)
    assert people.leave(3) == [] and people.release(4) == []
    assert people.asking == 2


def test_a_driver_whose_role_is_taken_away_drives_no_longer(people):
    assert people.join(Session(1, LOOK)) == [DriverChanged(1, None)]
    assert people.members[1].role == LOOK
    assert people.take(1.0, 1) == [Refused(1, MAY_NOT)]


def test_a_driver_who_becomes_a_carer_drives_on(people):
    assert people.join(Session(1, CARER, 'ann')) == []
    assert people.driver == 1 and people.members[1].name == 'ann'


class Machine(RuleBasedStateMachine):
    """Anything in any order: whoever drives is there and may, each change follows from the one before, and each asker
    hears once.
    """

    NUMBERS = st.integers(1, 5)

    @initialize()
    def begin(self):
        self.people, self.t, self.driver, self.asker = Sessions(CONFIG), 0.0, None, None

    def heed(self, events):
        for event in events:
            if isinstance(event, DriverChanged):
                assert event.old == self.driver and event.new != self.driver
                self.driver = event.new
                self.asker = None
            elif isinstance(event, Asked):
                assert event.driver == self.driver and self.asker is None
                self.asker = event.by
            elif event.key == TAKE_REFUSED:
                assert event.session == self.asker
                self.asker = None

    @rule(number=NUMBERS, role=st.sampled_from(ROLES))
    def join(self, number, role):
        before = self.people.asking
        self.heed(self.people.join(Session(number, role)))
        if before == number and role == LOOK:
            self.asker = None

    @rule(number=NUMBERS)
    def leave(self, number):
        self.heed(self.people.leave(number))
        self.asker = None if self.asker == number else self.asker
        assert number not in self.people.members

    @rule(number=NUMBERS)
    def take(self, number):
        if number in self.people.members:
            self.heed(self.people.take(self.t, number))

    @rule(number=NUMBERS)
    def release(self, number):
        self.heed(self.people.release(number))
        self.asker = None if self.asker == number else self.asker

    @rule(number=NUMBERS, to=NUMBERS, granted=st.booleans())
    def answer(self, number, to, granted):
        self.heed(self.people.grant(number, to) if granted else self.people.refuse(number, to))

    @rule(pause=st.floats(0.0, 20.0), drove=st.booleans())
    def step(self, pause, drove):
        self.t += pause
        if drove:
            self.people.drove()
        self.heed(self.people.step(self.t))

    @invariant()
    def holds(self):
        people = self.people
        assert people.driver == self.driver and people.asking == self.asker
        for number in {people.driver, people.asking} - {None}:
            assert people.members[number].role in (CARER, RIDER)
        assert people.asking is None or (people.driver is not None and people.asking != people.driver)


TestMachine = Machine.TestCase
TestMachine.settings = settings(max_examples=60, stateful_step_count=40)
