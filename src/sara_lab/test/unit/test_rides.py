"""Rides: the circuits are hard but fair, a ride tells what happened, and steering is counted as it was published."""

import json
import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from sara_bringup.lockstep.assisted import Assisted
from sara_bringup.lockstep.lockstep import Lockstep, world_of
from sara_common.platforms import chosen
from sara_control.assist.shared_control import Correction, SharedControl
from sara_lab.campaign import assisted as part
from sara_lab.campaign import campaign, ride_table
from sara_lab.judge import gaps
from sara_lab.judge.body_space import BodySpace
from sara_lab.rides import dock_rides, draw_rides, wall_rides
from sara_lab.rides import ride as rides
from sara_lab.rides.circuits import circuits
from sara_lab.rides.door_rides import APPROACHES, WIDEST, approach, passed
from sara_lab.rides.steering import reversal_rate, reversals, sign_changes
from sara_nav.maps import map_io

BODY = chosen().size
DT = 0.05


def along(points):
    """Poses (x, y, yaw) on a line through points (n, 2), 5 cm apart or less."""
    points = np.array(points, float)
    for a, b in zip(points, points[1:]):
        yaw = math.atan2(*(b - a)[::-1])
        for share in np.linspace(0.0, 1.0, max(2, math.ceil(math.dist(a, b) / 0.05))):
            yield *(a + share * (b - a)), yaw


def least_gap(circuit, points):
    """m between body and walls on a line, the heading along it."""
    world = world_of(circuit.grid)
    return min(gaps.at(world, pose, BODY) for pose in along(points))


@pytest.mark.parametrize('name', circuits())
def test_somebody_who_sees_the_way_passes_and_somebody_who_does_not_collides(name):
    circuit = circuits()[name]
    assert least_gap(circuit, circuit.task.way) > 0.08
    assert least_gap(circuit, (circuit.start[:2], *circuit.task.goals)) == 0.0
    assert all(min(math.dist(place, point) for point in circuit.task.way) < 0.5 for place in circuit.checkpoints)
    geometry = circuit.grid.geometry
    space = BodySpace(
        circuit.grid.data != map_io.FREE, geometry.resolution, (geometry.origin_x, geometry.origin_y), BODY, 0.05
    )
    assert space.connected(circuit.start, list(along(circuit.task.way))[-1])


def test_shared_control_leads_along_a_wall_that_the_rider_steers_into():
    made = wall_rides.along(13)
    assert not made.contacts and 0.25 < made.gap.min() < made.gap.max() < 0.35
    walls = part.assisted_wall(1, None)
    (line,), figures = walls.summary([{'gap': made.gap.tolist()}])
    assert f'{np.median(made.gap):.2f} (median)' in line
    assert not walls.verdict(figures)
    assert walls.verdict(figures | {'gap_p5_m': 0.24}) and walls.verdict(figures | {'gap_p95_m': 0.36})
    assert not walls.verdict(figures | {'gap_p5_m': 0.26, 'gap_p95_m': 0.34})


@pytest.mark.parametrize('number', (4, 5))
def test_it_comes_to_rest_before_a_table_and_a_bed_and_backs_out_again(number):
    made = dock_rides.dock(number)
    assert 0.05 < made.gap < 0.15 and made.aside < 0.1 and made.out and not made.contacts
    docks = part.assisted_dock(1, None)
    (line,), figures = docks.summary([{'gap': made.gap, 'docked': True}, {'gap': 0.3, 'docked': False}])
    assert line.startswith('1 of 2 ') and f'median {made.gap:.2f} m' in line
    assert not docks.verdict(figures) and docks.verdict(figures | {'gap_max_m': 0.2})
    assert docks.verdict(docks.summary([{'gap': 0.3, 'docked': False}])[1])


def test_each_rider_chooses_a_profile():
    assert rides.assist_config('four_directions').veer_time == 3.0
    assert rides.assist_config('tremor') == rides.assist_config() and rides.assist_config().veer_time == 0.0


def test_a_ride_is_the_same_again_and_tells_what_happened():
    one, other = (rides.ride('office', 'expert', 'free', 3) for _ in range(2))
    assert one == other and json.loads(json.dumps(one.to_json()))['seconds'] == one.seconds
    assert one.completed and one.passed == 5 and one.contacts == () and one.corrections == {} and one.changed == 0.0
    assert 35.0 < one.seconds < 65.0 and 10.0 < one.length < 18.0 and one.gap > 0.05 and one.stops == 0


def test_the_blind_collide_alone_and_are_led_past_by_shared_control():
    alone, helped = (rides.ride('office', 'blind', way, 0) for way in ('free', 'assisted'))
    assert alone.contacts and not alone.completed
    assert helped.contacts == () and helped.gap > 0.0 and helped.changed > 0.01
    assert set(helped.corrections) <= set(Correction.__members__) and helped.corrections
    assert helped.passed > alone.passed


def test_another_way_to_drive_is_refused():
    with pytest.raises(ValueError, match='allowed are free, gate, assisted'):
        rides.ride('office', 'expert', 'fly', 0)


def test_who_gives_up_is_not_taken_for_done(monkeypatch):
    monkeypatch.setattr(rides, 'GIVES_UP_S', 5.0)
    made = rides.ride('office', 'blind', 'gate', 0)
    assert not made.completed and made.passed < 5 and made.seconds < 60.0 and made.to_json()['completed'] is False


def test_other_sources_than_the_rider_s_pass_unchanged():
    circuit = circuits()['slalom']
    lockstep = Lockstep(circuit.grid, circuit.start, 0, localization='fake')
    helper = Assisted(lockstep, SharedControl(replace(rides.assist_config(), sources=('joystick',))))
    lockstep.start_up()
    lockstep.wheels.on_command('navigation', 0.2, 0.1, lockstep.time)
    command = lockstep.wheels.guard._command
    assert helper.command is None and (command.v, command.w) == (0.2, 0.1)
    lockstep.wheels.on_command('joystick', 0.2, 0.0, lockstep.time)
    assert helper.command is not None and helper.command.correction is not Correction.UNKNOWN


def test_the_grid_is_handed_over_as_often_as_the_costmap_is_updated():
    circuit, given = circuits()['slalom'], []

    class Noting(SharedControl):
        def on_grid(self, grid, stamp):
            given.append((stamp, grid))
            super().on_grid(grid, stamp)

    lockstep = Lockstep(circuit.grid, circuit.start, 0, localization='fake')
    Assisted(lockstep, Noting(rides.assist_config()))
    lockstep.start_up()
    begin = lockstep.time
    while lockstep.time < begin + 2.0:
        lockstep.wheels.on_command('joystick', 0.1, 0.0, lockstep.time)
        lockstep.step()
    assert np.diff([stamp for stamp, _ in given]) == pytest.approx(0.2, abs=0.051)
    grid = given[-1][1]
    row, column = (int((at - low) / grid.resolution) for at, low in ((1.5, grid.origin_y), (3.1, grid.origin_x)))
    assert grid.blocked[row, column] and not grid.blocked[row, column - 20]


def test_stops_are_counted_between_motions():
    speeds = np.zeros((1000, 2))
    speeds[100:300, 0] = speeds[360:500, 1] = speeds[520:700, 0] = 0.3
    assert rides._stops(speeds) == 1  # at rest before and after do not count, nor a pause of 0.2 s


def test_sign_changes_leave_the_dead_band_out():
    assert sign_changes(np.array([0.5, 0.02, -0.02, 0.3, -0.4, 0.01, -0.2, 0.6])) == 2


def test_slow_steering_is_counted_and_tremor_is_not():
    t = np.arange(0.0, 60.0, DT)
    slow = 0.3 * np.sin(2.0 * np.pi * 0.2 * t)
    assert reversals(slow, DT) == pytest.approx(2 * 0.2 * 60.0, abs=2)
    assert reversals(slow + 0.3 * np.sin(2.0 * np.pi * 4.5 * t), DT) == pytest.approx(reversals(slow, DT), abs=1)
    assert reversals(0.04 * np.sin(2.0 * np.pi * 0.2 * t), DT) == 0
    assert reversal_rate(slow, DT) == pytest.approx(24.0, abs=2.0)
    assert reversals(np.zeros(3), DT) == 0


def test_approaches_to_the_door_are_spread_evenly():
    starts = [approach(number).start for number in range(APPROACHES)]
    aside = [math.atan2(start[1] - 4.0, abs(start[0] - 6.05)) for start in starts]
    assert aside[0] == pytest.approx(-WIDEST) and aside[-1] == pytest.approx(WIDEST)
    assert np.diff(aside) == pytest.approx(2.0 * WIDEST / (APPROACHES - 1))


def _ride(**changes):
    values = dict(
        circuit='door', rider='late', way='gate', seed=0, completed=True, passed=5, seconds=100.0, length=10.0,
        reversals_per_m=1.0, reversals_per_min=10.0, changed=0.0, stops=0, gap=0.1, corrections={}, contacts=(),
    )  # fmt: skip
    return rides.Ride(**{**values, **changes})


def test_a_door_is_passed_only_without_a_stop_and_without_a_contact():
    assert passed(_ride())
    assert not any(passed(_ride(**change)) for change in ({'stops': 1}, {'completed': False}, {'contacts': ({},)}))


def test_the_campaign_s_verdict_names_what_help_does_not_do():
    rows = [
        _ride(way='free', contacts=({},)), _ride(), _ride(way='assisted', seconds=90.0, reversals_per_min=6.0),
        _ride(rider='blind', way='free'), _ride(rider='blind'),
        _ride(rider='blind', way='assisted', completed=False),
        _ride(rider='expert', way='free'), _ride(rider='expert'),
        _ride(rider='expert', way='assisted', seconds=106.0, changed=0.06),
    ]  # fmt: skip
    lines, figures = part._summary([row.to_json() for row in rows])
    assert len(lines) == 10 and figures['door_blind']['assisted']['seconds'] == rides.LIMIT_S
    assert part._verdict(figures) == [
        'door_late: 90 s, with the gate alone 100: at most 0.8 of it',
        'door_late: 6.0 reversals/min, with the gate alone 10.0: at most 0.5 of it',
        'door_blind: 300 s, with the gate alone 100: at most 0.8 of it',
        'door_blind: 0 of 1 completed, at least 98%',
        'door_blind: 10.0 reversals/min, with the gate alone 10.0: at most 0.5 of it',
        'door_blind: nobody collides without help: the circuit is too easy',
        'door_expert: 1.06 of the time without help, at most 1.05',
        'door_expert: 6.0% of the wish is changed, at most 5%',
    ]


def test_the_campaign_drives_the_riders_and_circuits_that_are_named(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(part, 'ride', lambda *names: asked.append(names) or _ride(way=names[2], contacts=({},)))
    words = ['campaign', 'assisted', '--seeds', '1', '--riders', 'late', '--circuits', 'door', '--workers', '1']
    monkeypatch.setattr(sys, 'argv', [*words, '--out', str(tmp_path)])
    with pytest.raises(SystemExit) as ended:
        campaign.main()
    assert asked == [('door', 'late', way, 0) for way in rides.WAYS] and ended.value.code == 1
    faults = {path.name: json.loads(path.read_text())['faults'] for path in tmp_path.glob('*/*.json')}
    assert faults['assisted_door_late_assisted_0.json'] == ['1 contacts']
    assert faults['assisted_door_late_gate_0.json'] == []


@pytest.mark.parametrize('words', [['doors', '--riders', 'late'], ['assisted', '--circuits', 'nowhere']])
def test_what_cannot_be_chosen_is_refused(words, monkeypatch, capsys):
    monkeypatch.setattr(sys, 'argv', ['campaign', *words])
    with pytest.raises(SystemExit) as ended:
        campaign.main()
    assert ended.value.code == 2 and words[1] in capsys.readouterr().err


def test_a_door_counts_as_passed_in_the_table_only_without_a_stop():
    rows = [
        {**_ride(rider=rider, way=way, stops=stops).to_json(), 'without_stopping': not stops}
        for rider in part.DOOR_RIDERS
        for way in part.DOOR_WAYS
        for stops in (0, int(rider == 'late'))
    ]
    _, figures = part._doors_summary(rows)
    assert figures['late_assisted'] == {
        'approaches': 2, 'passed': 2, 'without_stopping': 1, 'contacts': 0, 'seconds': 100.0
    }  # fmt: skip
    assert part._doors_verdict(figures) == ['late_assisted: 1 of 2 passed without stopping, at least 95%']


def test_without_a_gate_the_profile_alone_limits_a_chair_that_meets_a_wall():
    circuit = circuits()['door']
    lockstep = Lockstep(circuit.grid, (4.0, 0.6, 0.0), 0, localization='fake')
    rides.prepare(lockstep, 'free')
    lockstep.start_up()
    seen, begin = [], lockstep.time
    while lockstep.time < begin + 8.0:
        if lockstep.time < begin + 4.0:
            lockstep.wheels.on_command('joystick', 5.0, 0.0, lockstep.time)
        lockstep.step()
        seen.append((lockstep.time - begin, lockstep.wheels.decision.v))
    assert lockstep.chair.contacts
    speeds = {round(t, 2): v for t, v in seen}
    assert speeds[3.9] == pytest.approx(lockstep.wheels.guard.rider.max_forward)  # the wall changes nothing
    assert max(np.diff([v for _, v in seen])) <= lockstep.wheels.guard.rider.acceleration * 0.02 + 1e-9
    assert seen[-1][1] == 0.0


def test_the_table_sets_the_ways_beside_each_other(tmp_path, capsys):
    rows = [
        _ride(way=way, seconds=seconds, changed=0.05).to_json()
        for way, seconds in (('free', 60.0), ('gate', 80.0), ('assisted', 70.0))
    ]
    file = tmp_path / 'figures.json'
    file.write_text(json.dumps({'assisted': {'seeds': 1, **part._summary(rows)[1]}}))
    ride_table.main([str(file), '--circuits'])
    cells = [cell.strip() for cell in capsys.readouterr().out.splitlines()[-1].split('|')[1:-1]]
    assert cells[:5] == ['door', 'late', '1 / 1 / 1', '0 / 0 / 0', '60 / 80 / 70'] and cells[-1] == '5.0%'
    doors = {
        f'{rider}_{way}': {'passed': 20, 'without_stopping': stops, 'contacts': 0, 'seconds': 9.0}
        for rider in part.DOOR_RIDERS
        for way, stops in (('gate', 3), ('assisted', 19))
    }
    assert ride_table.doors_table(doors)[2] == '| tremor | 20/20 | 3/19 | 0/0 | 9/9 |'


def test_the_table_of_riders_adds_their_circuits_up(tmp_path, capsys):
    rows = [
        _ride(circuit=circuit, way=way, seconds=seconds, stops=stops, gap=gap, changed=changed).to_json()
        for way, slower in (('free', 0.0), ('gate', 20.0), ('assisted', 10.0))
        for circuit, seconds, stops, gap, changed in (
            ('door', 60.0 + slower, 1, 0.3, 0.02),
            ('office', 30.0 + slower, 0, 0.1, 0.04),
        )
    ]
    file = tmp_path / 'figures.json'
    file.write_text(json.dumps({'assisted': {'seeds': 1, **part._summary(rows)[1]}}))
    ride_table.main([str(file)])
    cells = [cell.strip() for cell in capsys.readouterr().out.splitlines()[-1].split('|')[1:-1]]
    assert cells[:4] == ['late', '2/2/2', '0/0/0', '90/130/110']
    assert cells[5:] == ['0.5/0.5/0.5', '0.10/0.10/0.10', '3.0%']


def test_a_table_of_nothing_is_refused(tmp_path):
    (tmp_path / 'figures.json').write_text('{"doors": {}}')
    with pytest.raises(SystemExit):
        ride_table.main([str(tmp_path / 'figures.json')])


def test_a_picture_is_drawn_of_a_ride(tmp_path, monkeypatch):
    monkeypatch.setattr(rides, 'LIMIT_S', 4.0)
    draw_rides.main(['office', '--riders', 'late', '--ways', 'free', '--out', str(tmp_path)])
    with Image.open(tmp_path / 'ride_office.png') as picture:
        width, height = picture.size
        assert width > 1000 and 0.5 < height / width < 0.8
        assert len(picture.getcolors()) > 10
