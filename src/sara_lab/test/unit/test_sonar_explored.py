"""The chair explores in lockstep by ultrasonic sensors alone."""

from pathlib import Path

from sara_lab.campaign.sonar_exploring import ended_wrong, sonar_explore
from sara_lab.studies import explored as of_explored
from sara_lab.studies.sonar_drives import MAPS
from sara_lab.studies.sonar_explored import LIMIT_S, explored
from sara_nav.maps.map_io import FREE
from sara_slam.exploring.limits import SPARE_S
from sara_slam.exploring.orders import State


def test_the_chair_begins_to_explore_a_room_by_its_sonars(monkeypatch):
    monkeypatch.setattr(of_explored, 'LONGEST_S', 12.0)
    found = explored('room', 0)
    assert found.state is State.EXPLORING and found.said[0].startswith('Exploring begins at')
    assert found.said[1].startswith('To a frontier of') and found.contacts == 0
    assert len(found.drive.ranges) > 300 and 0.1 < found.drive.way < 5.0
    assert (found.made.grid.data == FREE).sum() > 1000  # it has turned about
    assert ended_wrong(found) == [f'it was not back after {LIMIT_S:.0f} s']


def test_it_goes_home_when_its_time_is_over(monkeypatch):
    monkeypatch.setattr(of_explored, 'LONGEST_S', 60.0)
    found = explored('room', 0, SPARE_S + 10.0)
    assert found.state is State.DONE and 5.0 <= found.seconds < 60.0 and found.off_home <= 0.3
    assert any('return_by' in sentence for sentence in found.said)
    assert ended_wrong(found) == []
    assert ended_wrong(found._replace(off_home=0.5, contacts=2)) == [
        'it ended 0.50 m from where it began',
        '2 contacts',
    ]
    assert ended_wrong(found._replace(seconds=LIMIT_S + 1.0)) == [f'it was not back after {LIMIT_S:.0f} s']


def test_every_map_is_explored_as_often():
    assert len(sonar_explore(3, Path('nowhere')).cases) == 3 * len(MAPS)
