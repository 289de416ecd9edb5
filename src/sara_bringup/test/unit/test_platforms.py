"""The robots there are, and what check_config says of a folder with a mistake in it."""

import re
import shutil

import pytest

from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.paths import share
from sara_bringup.platforms import check_config
from sara_common.platforms import folders, load

LINES = 'platform.yaml'


@pytest.mark.parametrize('name', folders())
def test_nothing_is_to_mend_in_what_is_shipped(name):
    assert list(check_config.findings(load(name))) == []


def broken(tmp_path, file, old, new):
    """The findings about a copy of a folder in which `old` became `new`."""
    folder = tmp_path / 'kate'
    shutil.copytree(folders()['kate'], folder)
    text = (folder / file).read_text()
    assert old in text, old
    (folder / file).write_text(text.replace(old, new, 1))
    return list(check_config.findings(load(str(folder))))


@pytest.mark.parametrize(
    'file, old, new, words',
    [
        (LINES, '[[0.40, 0.275], [0.40, -0.275], [-0.40, -0.275], [-0.40, 0.275]]',
         '[[0.8, 0.6], [0.8, 0.1], [0.1, 0.1]]',
         'base_link, its origin, lies outside'),
        (LINES, '[[0.40, 0.275]', '[[0.50, 0.275]', 'the gate and the planner know different bodies'),
        (LINES, 'length 0.80', 'length 0.90', 'robot.urdf has a body'),
        (LINES, '&inflation 0.62', '&inflation 0.30', 'does not see where the robot can turn in place'),
        (LINES, 'separation 0.46', 'separation 0.0', 'platform/wheels/separation is 0 m'),
        (LINES, 'radius 0.125', 'radius 0.0', 'platform/wheels/radius is 0 m'),
        (LINES, 'radius 0.125', 'radius 0.130', 'robot.urdf has wheels 0.46 m apart with a radius of 0.125 m'),
        (LINES, 'wheel_radius: *radius\n', 'wheel_radius: 0.155\n', 'diff_drive_controller has wheel_radius 0.155'),
        (LINES, 'x: 0.05,  y: 0.275, ', 'x: 0.05,  y: 0.475, ', 'ML sits at (0.05, 0.475), 0.20 m outside of the body'),
        (LINES, 'yaw_deg: 168.0', 'yaw_deg: 12.0', 'RL at (-0.4, 0.16) looks across the body'),
        (LINES, '      RR: *RR\n', '', 'safety_gate/zones/sensors leaves out RR'),
        (LINES, 'RL: *RL', 'RL: {x: -0.40, y: 0.10, yaw_deg: 168.0}', 'safety_gate has RL at'),
        (LINES, '&scan {x: 0.36', '&scan {x: 0.30', 'robot.urdf has scan at (0.36, 0)'),
        (LINES, 'FR: 0x72', 'FR: 0x71', 'the I2C bus has two chips at 0x71'),
        (LINES, 'imu_address: 0x69', 'imu_address: 0x71', 'sensor_node refuses it: sonar_addresses is'),
        (LINES, ', RR: 0x76}', '}', 'platform/sensor_node/sonar_addresses leaves out RR'),
        (LINES, '[FR, ML, RR]', '[FR, ML]', 'sensor_node refuses it: turns is'),
        (LINES, '/RL_range, /RR_range]', '/RL_range, /SDI_range]', 'has the topics of SDI'),
        (LINES, 'max_wheel_speed: &fastest 10.5', 'max_wheel_speed: &fastest 5.0', 'profile standard asks for'),
        (LINES, 'wheel_acceleration: 17.5', 'wheel_acceleration: 10.0', 'the motor node would refuse it'),
        (LINES, '&slip 1.08', '&slip 1.4', 'safety_gate/turn_slip is 1.4'),
        (LINES, '  wheel_radius: *radius\n  steps_per_turn', '  wheel_separation_multiplier: 1.08\n'
         '  wheel_radius: *radius\n  steps_per_turn', 'slip in turns counts twice'),
        (LINES, 'max_wheel_speed: 14.0           #', 'max_wheel_speed: 9.0            #',
         'true readings would be dropped'),
        (LINES, '    motor_lag: 0.08', '    motor_leg: 0.08',
         'the simulator refuses it: platform/simulated/motor_lag is missing'),
        (LINES, 'max_forward: 3.6, ', '', 'joystick_node refuses it: max_forward is 0.0'),
        (LINES, 'max_forward: 3.6, max_turn: 1.6', 'max_forward: 9.0, max_turn: 4.5',
         'joystick_node refuses it: max_forward and max_turn are 9 and 4.5 rad/s, allowed are 13.37 together'),
        (LINES, '  dbc: kate                       #',
         '  dbc: kiti                       #', "the bus: bus description is 'kiti'"),
        (LINES, '  dbc: kate\n', '  dbc: sara\n', 'diff_drive_controller/dbc is sara, read/dbc kate'),
        (LINES, 'smoother_jerk_theta: 2.6', 'smoother_jerk_theta: 4.0',
         'RotateThenPursue/smoother_jerk_theta is 4, the safety gate limits jerk to 2.59 (profile standard)'),
        ('kate.dbc', 'BO_ 562 RANGES_2', 'BO_ 561 RANGES_2', '0x231 is RANGES_1 and RANGES_2'),
        ('kate.dbc', 'BO_ 576 BATTERY', 'BO_ 576 BATTERIE', 'has no message BATTERY'),
        ('kate.dbc', ' SG_ ML : 16|16@1+ (0.01,0) [0|0] "m" PC\n', '', 'leaves out ML'),
        ('robot.urdf', '<child link="FL_frame"/>', '<child link="VL_frame"/>',
         'no fixed joint from base_link to FL_frame'),
        ('robot.urdf', '<origin xyz="0.4 0.16 0.4" rpy="0 0 0.209439510"/>', '',
         'robot.urdf has FL_frame at (0, 0), platform.yaml at (0.4, 0.16)'),
        ('robot.urdf', '"0.4 0.16 0.4" rpy="0 0 0.209439510"', '"0.4 0.16 0.4"',
         'robot.urdf has FL_frame at (0.4, 0.16), platform.yaml at (0.4, 0.16), or turned otherwise'),
        ('robot.urdf', 'xyz="0.4 0.16 0.4"', 'xyz="0.4 left 0.4"', 'robot.urdf has FL_frame nowhere'),
        ('robot.urdf', 'size="0.80 0.55 0.95"', 'size="0.80 wide 0.95"', 'robot.urdf has a body'),
        ('robot.urdf', '<child link="FL_frame"/>', '', 'no fixed joint from base_link to FL_frame'),
        ('robot.urdf', '</robot>', '', 'robot.urdf cannot be read'),
    ],
)  # fmt: skip
def test_a_mistake_is_said_in_words(tmp_path, file, old, new, words):
    found = broken(tmp_path, file, old, new)
    assert any(words in sentence for sentence in found), found


def test_an_origin_that_the_urdf_leaves_out_is_zero(tmp_path):
    folder = tmp_path / 'kate'
    shutil.copytree(folders()['kate'], folder)
    text, origin = (folder / 'robot.urdf').read_text(), '<origin xyz="0.05 0.1 0.3" rpy="0 0 0.000000000"/>'
    assert origin in text
    (folder / 'robot.urdf').write_text(text.replace(origin, '<origin xyz="0.05 0.1 0.3"/>'))
    assert list(check_config.findings(load(str(folder)))) == []


def test_the_command_says_which_robot_and_ends_with_1(tmp_path, capsys):
    broken(tmp_path, LINES, 'separation 0.46', 'separation 0.0')
    with pytest.raises(SystemExit) as ended:
        check_config.main(['sara', str(tmp_path / 'kate'), 'mary'])
    said = capsys.readouterr().out
    assert ended.value.code == 1 and 'sara: nothing to mend' in said and 'separation is 0 m' in said
    assert "mary: platform is 'mary', allowed are kate, sara" in said


@pytest.mark.parametrize(
    'old, new, words',
    [
        # As commanded 1.08 times the lateral acceleration: at 0.8 m/s 0.54 rad/s, (0.8 + 0.23 x 0.54) / 0.125.
        ('max_wheel_speed: &fastest 10.5', 'max_wheel_speed: &fastest 7.0', 'profile standard allows curves that ask '
         'for 7.4 rad/s of the outer wheel (0.8 m/s, commanded 0.54 rad/s), platform/motor_node/max_wheel_speed is 7:'),
        # Slow, but sharp: (0.45 + 0.23 x 8.64) / 0.125.
        ('max_turn: 0.8, max_lateral: 0.4,', 'max_turn: 8.0, max_lateral: 3.6,', '(0.45 m/s, commanded 8.6 rad/s)'),
        ('fastest 10.5', 'fastest 10.5', ''),
    ],
)  # fmt: skip
def test_curves_that_are_driven_slower_are_a_note_and_no_mistake(tmp_path, capsys, old, new, words):
    broken(tmp_path, LINES, old, new)
    with pytest.raises(SystemExit):
        check_config.main([str(tmp_path / 'kate')])
    said = capsys.readouterr().out.splitlines()
    notes = [line for line in said if ': note: ' in line and 'between the cones' not in line]
    assert any(words in note for note in notes) if words else not notes


def test_a_calibrated_separation_takes_the_place_of_the_slip(tmp_path):
    shutil.copytree(folders()['kate'], tmp_path / 'kate')
    path = tmp_path / 'kate' / LINES
    text = path.read_text().replace('&slip 1.08', '&slip 1.0')
    path.write_text(
        text.replace('  wheel_radius: *radius\n', '  wheel_separation_multiplier: 1.08\n  wheel_radius: *radius\n', 1)
    )
    assert not [sentence for sentence in check_config.findings(load(str(tmp_path / 'kate'))) if 'slip' in sentence]


def test_the_brisk_profile_of_sara_is_noted(capsys):
    with pytest.raises(SystemExit) as ended:
        check_config.main(['sara'])
    said = capsys.readouterr().out
    assert ended.value.code == 0 and 'sara: nothing to mend was found\nsara: note: profile brisk allows curves' in said
    assert 'ask for 8.1 rad/s' in said and said.count('note: ') == 1 + said.count('between the cones') == 3


@pytest.mark.parametrize(
    'yaw, gap',
    [
        ('12.0', 0.49),  # KATE's front cones, of 30 deg to each side, meet 0.16 / tan(30 - 12 deg) ahead
        ('0.0', 0.36),  # 0.32 / (tan(30 deg) + tan(18 deg))
    ],
)
def test_a_gap_between_the_cones_is_noted(tmp_path, capsys, yaw, gap):
    broken(
        tmp_path,
        LINES,
        'FL: &FL {x: 0.40,  y: 0.16,   yaw_deg: 12.0}',
        f'FL: &FL {{x: 0.40,  y: 0.16,   yaw_deg: {yaw}}}',
    )
    with pytest.raises(SystemExit):
        check_config.main([str(tmp_path / 'kate')])
    said = re.findall(r'note: (ahead|astern), up to (\S+) m off, is a gap', capsys.readouterr().out)
    assert {end: float(far) for end, far in said} == pytest.approx({'ahead': gap, 'astern': 0.49}, abs=0.02)


@pytest.mark.parametrize('name', folders())
def test_a_robot_of_any_folder_drives(name):
    lockstep = Lockstep(share() / 'maps' / 'room.yaml', (1.0, 1.0, 0.0), 1, platform=load(name))
    lockstep.start_up()
    lockstep.pilot = lambda now: (0.3, 0.0)
    begin = lockstep.time
    while lockstep.time < begin + 4.0:
        lockstep.step()
    x, y, _ = lockstep.chair.pose
    assert 1.6 < x < 2.2 and abs(y - 1.0) < 0.1 and lockstep.chair.contacts == 0
    assert abs(lockstep.fused[0] - x) < 0.1 and set(lockstep.chair.box.sonars) == set(load(name).sonars)
