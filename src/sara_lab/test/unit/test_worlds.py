"""Worlds made by a seed and others' worlds as tasks, the textbook's planner, and the campaign's figures of them."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from PIL import Image

from sara_bringup.lockstep.lockstep import world_of
from sara_bringup.paths import share
from sara_common.planar import Pose2D
from sara_common.platforms import chosen
from sara_lab.campaign import campaign
from sara_lab.campaign.worlds import _summary, _verdict, world_row
from sara_lab.ideal.ideal import Ideal
from sara_lab.journeys.worlds import draw_worlds, foreign, made, trial, world_map
from sara_lab.journeys.worlds import task as task_module
from sara_lab.journeys.worlds.pure_pursuit import PurePursuit, PurePursuitConfig
from sara_lab.journeys.worlds.task import task_of
from sara_lab.judge import clearance, gaps
from sara_lab.judge.judgement import Track
from sara_lab.judge.runs import runs
from sara_nav.costmaps.costmap import static_costs
from sara_nav.grids.grid import LETHAL, GridGeometry
from sara_nav.maps import map_io
from sara_nav.maps.map_io import GridMap
from sara_nav.planners.local_command import DRIVING, OFF_PATH, REACHED
from sara_sim.world.obstacles import Obstacle
from sara_sim.world.sdf import Scene
from sara_sim.world.world import World

PILLAR = (
    '<sdf version="1.6"><world name="w"><model name="p"><pose>2 0.6 0.5 0 0 0</pose><link name="l">'
    '<collision name="c"><geometry><cylinder><radius>0.2</radius><length>1</length></cylinder></geometry></collision>'
    '</link></model></world></sdf>'
)


def room(columns, rows, occupied=()):
    """A free map of 0.05 m cells with some occupied (rows, columns) slices."""
    data = np.zeros((rows, columns), np.int8)
    for where in occupied:
        data[where] = map_io.OCCUPIED
    return GridMap(data, GridGeometry(columns, rows, 0.05, 0.0, 0.0))


# -- worlds by a seed


def test_a_made_world_s_ends_are_roomy_and_its_ideal_time_is_the_body_s():
    task = made.made('obstacles_15', 1)
    geometry = task.grid.geometry
    world = World(task.grid.data == map_io.OCCUPIED, geometry.resolution, (geometry.origin_x, geometry.origin_y))
    assert all(gaps.at(world, pose, chosen().size) >= 0.2 for pose in (task.start, task.goal))
    assert task.way >= math.dist(task.start[:2], task.goal[:2]) - 0.1
    assert task.ideal >= task.way / 0.8  # at the profile's highest speed


@pytest.mark.parametrize('kind', ['obstacles_25', 'maze_140', 'office_95'])
def test_a_made_world_is_the_same_every_time(kind, monkeypatch):
    monkeypatch.setattr(task_module, 'ideal', lambda *_: Ideal(9.0, np.empty((0, 2))))  # which takes seconds
    task, again, other = (made.made.__wrapped__(kind, number) for number in (1, 1, 2))
    assert np.array_equal(task.grid.data, again.grid.data) and (task.start, task.goal) == (again.start, again.goal)
    assert task.grid.data.shape != other.grid.data.shape or not np.array_equal(task.grid.data, other.grid.data)


@pytest.mark.parametrize('kind', made.DOORS)
def test_an_office_s_doors_are_as_wide_as_their_kind_says(kind):
    shapes, size = made._office(made.DOORS[kind], np.random.default_rng(3))
    grid = made._grid([shape for shape in shapes if shape.name == 'wall'], size)
    row = int((made.OFFICE[1] + 1.5 * made.WALL) / made.CELL)  # in the wall between the lower rooms and the corridor
    widths = [(last - first) * made.CELL for first, last in runs(grid.data[row] == map_io.FREE)]
    assert widths == pytest.approx([made.DOORS[kind]] * made.OFFICE[0])


def test_denser_worlds_have_more_obstacles_and_a_maze_joins_all_its_cells():
    counts = [len(made._shapes(kind, np.random.default_rng(1))[0]) for kind in made.DENSITIES]
    assert counts == [12, 20, 28, 36]
    ways = made._passages(np.random.default_rng(1))
    joined = {(0, 0)}
    for _ in range(made.MAZE[0] * made.MAZE[1]):
        joined |= {cell for way in ways for cell in way if joined & set(way)}
    assert len(joined) == made.MAZE[0] * made.MAZE[1]


def test_another_kind_is_refused_in_words():
    with pytest.raises(ValueError, match='there is no kind'):
        made.made('castle', 0)


def test_a_task_is_none_where_the_body_does_not_pass():
    ends = (1.0, 1.0, 0.0), (4.0, 1.0, 0.0)
    assert task_of('k', 'n', 0, room(100, 40), ends).way == pytest.approx(3.0, abs=0.05)
    gap = room(100, 40, [(slice(0, 15), slice(50, 52)), (slice(25, 40), slice(50, 52))])  # of 0.5 m
    assert task_of('k', 'n', 0, gap, ends) is None
    unknown = room(100, 40)
    unknown.data[:, 50:52] = map_io.UNKNOWN
    assert task_of('k', 'n', 0, unknown, ends) is None


# -- others' worlds


def listed(folder, rows):
    """The folder, with such a list."""
    (folder / foreign.LIST).write_text(json.dumps({'worlds': rows}))
    return folder


def saved(folder, name, grid, mode='trinary'):
    """A map's files."""
    values = {'trinary': np.where(grid.data > 0, 0, 254), 'raw': grid.data, 'scale': np.where(grid.data > 0, 0, 255)}
    Image.fromarray(values[mode][::-1].astype(np.uint8)).save(folder / f'{name}.pgm')
    (folder / f'{name}.yaml').write_text(
        f'image: {name}.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\n'
        f'free_thresh: 0.196\nmode: {mode}\n'
    )


@pytest.mark.parametrize('mode', ['trinary', 'raw', 'scale'])
def test_a_map_of_any_mode_is_a_task_and_is_made_larger_only_as_far_as_the_body_needs(tmp_path, mode):
    door = room(100, 40, [(slice(0, 15), slice(50, 52)), (slice(25, 40), slice(50, 52))])  # of 0.5 m
    saved(tmp_path, 'door', door, mode)
    row = {'world': 'door.yaml', 'start': [1.0, 1.0, 0], 'goal': [4.0, 1.0, 90]}
    task = foreign.foreign(foreign.entries(listed(tmp_path, [row]))[0], 3)
    width = chosen().body.width
    assert width <= 0.5 * task.scale < width + 0.2 and task.number == 3 and task.name == 'door'
    assert task.goal == pytest.approx((4.0 * task.scale, 1.0 * task.scale, math.pi / 2))
    with pytest.raises(foreign.ForeignError, match='no way for the body .* at scale 1'):
        foreign.foreign(foreign.entries(listed(tmp_path, [{**row, 'scale': 1.0}]))[0], 3)


@pytest.mark.parametrize('mode', map_io.MODES)
@pytest.mark.parametrize('negate', [0, 1])
def test_simulator_and_lockstep_read_the_same_walls_of_a_map_of_any_mode(tmp_path, mode, negate):
    pixels = np.random.default_rng(5).integers(0, 256, (20, 30), np.uint8)
    Image.fromarray(pixels).save(tmp_path / 'a.pgm')
    (tmp_path / 'a.yaml').write_text(
        f'image: a.pgm\nresolution: 0.05\norigin: [1, 2, 0]\nnegate: {negate}\noccupied_thresh: 0.65\n'
        f'free_thresh: 0.196\nmode: {mode}\n'
    )
    occupied = World.from_yaml(tmp_path / 'a.yaml').occupied
    assert np.array_equal(occupied, world_of(map_io.load_map(str(tmp_path / 'a.yaml'))).occupied)
    costs = static_costs(map_io.load_map(str(tmp_path / 'a.yaml')).data)
    assert np.array_equal(occupied, costs == LETHAL)


def test_a_gazebo_world_is_drawn_where_its_shapes_are(tmp_path):
    (tmp_path / 'one.world').write_text(PILLAR)
    row = {'world': '*.world', 'start': [0.0, 0.0, 0], 'goal': [4.0, 0.0, 0], 'scale': 2}
    task = foreign.foreign(foreign.entries(listed(tmp_path, [row]))[0], 0)
    geometry = task.grid.geometry
    rows, columns = np.nonzero(task.grid.data == map_io.OCCUPIED)
    x, y = geometry.to_world(columns, rows)
    assert (x.mean(), y.mean()) == pytest.approx((4.0, 1.2), abs=0.02)
    assert len(rows) * 0.05**2 == pytest.approx(math.pi * 0.4**2, rel=0.05) and task.goal[0] == 8.0


def test_a_larger_map_has_its_cells_where_they_were_times_the_scale():
    grid = room(40, 20, [(slice(5, 10), slice(10, 20))])
    grid = GridMap(grid.data, GridGeometry(40, 20, 0.05, -1.0, 0.5))
    larger = foreign.scaled(grid, 1.7)
    rows, columns = np.nonzero(larger.data == map_io.OCCUPIED)
    x, y = larger.geometry.to_world(columns, rows)
    assert (x.min(), x.max()) == pytest.approx((1.7 * -0.5 + 0.025, 1.7 * 0.0 - 0.025), abs=0.03)
    assert (y.min(), y.max()) == pytest.approx((1.7 * 0.75 + 0.025, 1.7 * 1.0 - 0.025), abs=0.03)
    assert np.array_equal(foreign.scaled(grid, 1.0).data, grid.data)


def test_shapes_of_a_scene_are_made_larger_about_the_frame_s_origin():
    scene = Scene((Obstacle(size=(1.0, 0.2), at=(1.0, 1.0), yaw=0.5), Obstacle(radius=0.3, at=(-1.0, 0.0))), ())
    small, large = foreign.drawn_map(scene, 1.0), foreign.drawn_map(scene, 3.0)
    areas = [np.count_nonzero(grid.data) * 0.05**2 for grid in (small, large)]
    assert areas == pytest.approx([0.2 + math.pi * 0.09, 9 * (0.2 + math.pi * 0.09)], rel=0.05)


ROW = {'world': 'a.yaml', 'start': [0, 0, 0], 'goal': [1, 0, 0]}


@pytest.mark.parametrize(
    ('rows', 'words'),
    [
        ([], 'must hold a list `worlds`'),
        (['a.yaml'], 'world 1 is'),
        ([{**ROW, 'scael': 2}], "there is no 'scael'"),
        ([{**ROW, 'world': 3}], 'world is 3'),
        ([{**ROW, 'world': '/maps/a.yaml'}], "world is '/maps/a.yaml', allowed are files in the folder of the list"),
        ([{**ROW, 'start': [0, 0]}], r'start is \[0, 0\], allowed is \[x m, y m, yaw deg\]'),
        ([{**ROW, 'goal': [0, 'x', 0]}], 'goal is'),
        ([{**ROW, 'scale': 0}], 'scale is 0'),
        ([{**ROW, 'scale': 99}], 'scale is 99'),
        ([{**ROW, 'models': 'm'}], "models is 'm'"),
        ([ROW], 'a.yaml: there is no such file'),
    ],
)
def test_what_is_wrong_with_a_list_is_told_in_words(tmp_path, rows, words):
    with pytest.raises(foreign.ForeignError, match=words):
        foreign.entries(listed(tmp_path, rows))


def test_a_list_that_is_not_there_and_two_worlds_of_one_name_are_told_in_words(tmp_path):
    with pytest.raises(foreign.ForeignError, match='cannot be read'):
        foreign.entries(tmp_path)
    (tmp_path / 'a.world').write_text(PILLAR)
    row = {**ROW, 'world': 'a.world'}
    with pytest.raises(foreign.ForeignError, match='two worlds are called a'):
        foreign.entries(listed(tmp_path, [row, row]))


@pytest.mark.parametrize(
    ('name', 'text', 'words'),
    [
        ('a.world', '<sdf><world/></sdf>', 'nothing stands in it'),
        ('a.world', 'no xml', 'cannot be read'),
        ('a.yaml', 'image: a.pgm', 'resolution is missing'),
    ],
)
def test_worlds_that_cannot_be_used_are_told_in_words(tmp_path, name, text, words):
    (tmp_path / name).write_text(text)
    entry = foreign.entries(listed(tmp_path, [{**ROW, 'world': name}]))[0]
    with pytest.raises(foreign.ForeignError, match=words):
        foreign.foreign(entry, 0)


def test_ends_off_the_map_in_walls_and_turned_maps_are_told_in_words(tmp_path):
    saved(tmp_path, 'a', room(60, 40, [(slice(0, 40), slice(30, 31))]))
    for goal, words in (([9, 0, 0], 'off the map'), ([2.5, 1.0, 0], 'not joined by free cells')):
        entry = foreign.entries(listed(tmp_path, [{**ROW, 'start': [0.5, 1, 0], 'goal': goal}]))[0]
        with pytest.raises(foreign.ForeignError, match=words):
            foreign.foreign(entry, 0)
    path = tmp_path / 'a.yaml'
    path.write_text(path.read_text().replace('[0, 0, 0]', '[0, 0, 0.3]'))
    with pytest.raises(foreign.ForeignError, match='turned by 0.3 rad'):
        foreign.foreign(entry, 0)


def test_the_list_of_the_ten_worlds_is_in_order_but_for_their_files(tmp_path):
    rows = yaml.safe_load((share('sara_lab') / 'data' / 'foreign_worlds.yaml').read_text())['worlds']
    for name in (row['world'].replace('*', '7') for row in rows):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    assert len(foreign.entries(listed(tmp_path, rows))) == 6


def test_the_digest_of_a_folder_changes_with_what_it_holds(tmp_path):
    (tmp_path / 'a').write_text('1')
    before = foreign.digest(tmp_path)
    assert foreign.digest(tmp_path) == before
    (tmp_path / 'a').write_text('2')
    assert foreign.digest(tmp_path) != before


# -- the textbook's planner


def followed(plan, pose, seconds=60.0, config=PurePursuitConfig()):
    """(states, poses) of a robot that does as it is told, from a Pose2D."""
    planner, poses, states = PurePursuit(config), [pose], []
    planner.start(np.asarray(plan, float))
    for k in range(round(seconds / 0.1)):
        command = planner.update(0.1 * k, 0.1, pose, (0.0, 0.0), 0.0, None)
        states.append(command.state)
        if command.state != DRIVING:
            break
        pose = pose.advance(command.v, command.w, 0.1)
        poses.append(pose)
    return states, poses


def test_pure_pursuit_drives_the_arc_of_coulter_s_curvature():
    planner = PurePursuit(PurePursuitConfig(lookahead=1.0, max_vel_theta=4.0))
    angles = np.linspace(0.0, math.pi / 2, 200)  # a circle of 2 m to the left
    planner.start(np.column_stack([2.0 * np.sin(angles), 2.0 - 2.0 * np.cos(angles), angles]))
    command = planner.update(0.0, 0.1, Pose2D(0.0, 0.0, 0.0), (0.4, 0.0), 0.0, None)
    assert command.w / command.v == pytest.approx(0.5, rel=0.01)


def test_pure_pursuit_turns_stops_and_ends_on_the_goal_s_heading():
    plan = [(0.05 * k, 0.0, 0.0) for k in range(60)] + [(3.0, 0.0, 2.0)]
    states, poses = followed(plan, Pose2D(0.0, 0.0, 2.5))
    assert states[-1] == REACHED and abs(poses[-1].yaw - 2.0) <= 0.05
    assert math.dist(poses[-1][:2], (3.0, 0.0)) <= 0.10
    turned = next(k for k, pose in enumerate(poses) if pose.x != 0.0)
    assert abs(poses[turned - 1].yaw) < 0.3  # before it set out


def test_pure_pursuit_far_from_its_path_wants_another():
    states, _ = followed([(0.0, 0.0, 0.0), (3.0, 0.0, 0.0)], Pose2D(1.0, 2.0, 0.0))
    assert states == [OFF_PATH]


def test_bad_parameters_of_pure_pursuit_are_told():
    assert PurePursuitConfig().faults() == []
    assert 'lookahead' in PurePursuitConfig(lookahead=0.0).faults()[0]


# -- the judge


def straight(v, w=0.0, seconds=4.0, start=(0.0, 0.0, 0.0)):
    """A Track with constant speed and turn rate."""
    t = np.arange(0.0, seconds, 0.02)
    if w:
        yaw = start[2] + w * t
        x, y = start[0] + v / w * (np.sin(yaw) - math.sin(start[2])), start[1] - v / w * (np.cos(yaw) - 1.0)
    else:
        x, y, yaw = start[0] + v * t, start[1] + 0.0 * t, start[2] + 0.0 * t
    return Track(t, np.column_stack([x, y, yaw]))


def test_time_to_collision_is_the_way_left_over_the_speed():
    world = World.empty()
    world.obstacles.add(Obstacle(size=(0.2, 4.0), at=(4.1, 0.0)))  # its face is 4 m away
    found = clearance.times_to_collision(straight(0.5, seconds=4.0), world, (1.0, 0.6))
    expected = np.minimum((3.5 - 0.5 * 0.2 * np.arange(len(found))) / 0.5, clearance.HORIZON)
    assert np.abs(found - expected).max() <= clearance.STEP + 1e-6
    assert clearance.clearance(straight(0.5), World.empty(), (1.0, 0.6)) == (clearance.HORIZON, 0, 0.0)


def test_a_turn_in_place_beside_a_wall_has_a_time_to_collision_too():
    world = World.empty()
    world.obstacles.add(Obstacle(size=(9.0, 0.2), at=(0.0, 0.55)))  # 0.45 m beside the middle
    found = clearance.times_to_collision(straight(0.0, 0.1, seconds=0.5), world, (1.0, 0.6))
    angle = math.asin(0.45 / math.hypot(0.5, 0.3)) - math.atan2(0.3, 0.5)  # until a corner reaches it
    assert found[0] == pytest.approx(angle / 0.1, abs=clearance.STEP + 1e-6)


def test_intrusions_are_counted_and_timed():
    world = World.empty()
    for x in (1.5, 3.0):
        world.obstacles.add(Obstacle(radius=0.1, at=(x, 0.44)))  # 0.04 m beside the body for 1 m of way
    found = clearance.clearance(straight(0.5, seconds=8.0), world, (1.0, 0.6))
    way = 1.0 + 2.0 * math.sqrt(0.15**2 - 0.14**2)  # within ZONE of the disc
    assert found.intrusions == 2 and found.intruded == pytest.approx(2 * way / 0.5, rel=0.03)


# -- the campaign's figures


def result(planner, success, contacts=0, kind='maze_110'):
    """A drive as plain data."""
    judgement = {'time_ratio': 2.0, 'gap_min': 0.1, 'jerk_tangential_rms': 0.3, 'jerk_normal_rms': 0.4}
    return {
        'kind': kind,
        'name': 'w',
        'planner': planner,
        'success': success,
        'reached': success,
        'contacts': [{}] * contacts,
        'spl': 0.5 * success,
        'text': 'why',
        'judgement': judgement,
        'clearance': {'ttc_min': 1.0, 'intrusions': 2, 'intruded': 3.0},
    }


def test_figures_count_success_and_drives_with_a_contact():
    row = world_row([result('default', True), result('default', False, 2), result('default', False)])
    assert (row['cases'], row['success'], row['contacts'], row['spl']) == (3, 1, 1, pytest.approx(0.5 / 3))
    assert row['jerk'] == pytest.approx(0.5) and row['intruded_s'] == 3.0


def test_the_verdict_names_where_the_default_is_not_first():
    fine = [result('default', True), result('TrajectoryPlannerROS', True), result('textbook', False, 1)]
    lines, figures = _summary(fine)
    assert _verdict(figures) == [] and any('no success: w textbook: why Contacts: 1.' in line for line in lines)
    found = _verdict(_summary([result('default', False, 1), result('DWAPlannerROS', True)])[1])
    assert found == ['mazes: DWAPlannerROS 1 of 1, ours 0', 'mazes: contacts of DWAPlannerROS 0, ours 1']


# -- drives and commands


def test_the_textbook_s_planner_reaches_a_goal_in_lockstep_and_is_judged():
    task = task_of('k', 'n', 1, room(100, 60), ((1.5, 1.5, 0.3), (3.0, 1.5, 0.0)))
    outcome = trial.drive(task, 'textbook')
    assert outcome.success and outcome.faults == [] and 0.9 < outcome.spl <= 1.0
    plain = json.loads(json.dumps(outcome.to_json()))
    assert plain['success'] and plain['judgement']['time_ratio'] > 1.0 and plain['clearance']['intrusions'] == 0


def test_what_the_textbook_s_planner_touches_is_its_contact_and_no_success():
    beside = room(100, 60, [(slice(0, 15), slice(30, 70))])  # a wall up to y 0.75 m, too near to turn there
    task = task_of('k', 'n', 1, beside, ((2.5, 1.1, 0.0), (2.5, 2.4, math.pi / 2)))
    outcome = trial.drive(task, 'textbook')
    assert outcome.contacts and not outcome.success and outcome.spl == 0.0 and outcome.clearance.intrusions >= 1
    assert outcome.faults == []  # a figure of the textbook's, not a fault of SARA's
    assert replace(outcome, planner='default').faults[0].startswith('contact: the map')


def test_a_gazebo_world_becomes_a_map_that_the_simulator_reads(tmp_path, capsys):
    (tmp_path / 'a.world').write_text(PILLAR.replace('</world>', '<actor name="walker"/></world>'))
    world_map.main([str(tmp_path / 'a.world'), str(tmp_path / 'b'), '--scale', '2'])
    said = capsys.readouterr()
    assert 'left out: actor walker: not read' in said.err and str(tmp_path / 'b.yaml') in said.out
    world = World.from_yaml(tmp_path / 'b.yaml')
    assert world.overlaps(4.0, 1.2, 0.0, 0.1, 0.1) and not world.overlaps(4.0, 1.7, 0.0, 0.1, 0.1)
    world_map.main([str(tmp_path / 'b.yaml'), str(tmp_path / 'c'), '--scale', '0.5'])
    assert World.from_yaml(tmp_path / 'c.yaml').overlaps(2.0, 0.6, 0.0, 0.1, 0.1)


@pytest.mark.parametrize(
    ('words', 'why'),
    [
        (['none.world', 'm'], 'cannot be read'),
        (['none.yaml', 'm'], 'does not exist'),
        (['a.world', 'no/such/folder/m'], 'cannot be written'),
    ],
)
def test_what_world_map_cannot_do_is_told_in_words(tmp_path, monkeypatch, words, why):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'a.world').write_text(PILLAR)
    with pytest.raises(SystemExit, match=why):
        world_map.main(words)


def test_a_campaign_s_list_that_is_wrong_is_told_in_words(tmp_path, monkeypatch):
    monkeypatch.setattr('sys.argv', ['campaign', 'worlds', '--maps', str(tmp_path), '--out', str(tmp_path / 'out')])
    with pytest.raises(SystemExit, match='worlds.yaml cannot be read'):
        campaign.main()


@pytest.mark.parametrize('which', [0, 7])
def test_a_sheet_is_drawn_of_any_number_of_worlds(tmp_path, monkeypatch, which):
    task = task_of('k', 'n', 1, room(100, 60), ((1.5, 1.5, 0.3), (3.0, 1.5, 0.0)))
    points, cross = np.array([[1.5, 1.5], [3.0, 1.5]]), np.array([[2.0, 1.5]])
    fake = SimpleNamespace(success=bool(which))
    monkeypatch.setattr(draw_worlds, 'driven', lambda *_: (fake, points, cross))
    draw_worlds.sheet([lambda: task] * (which + 1), [], tmp_path / 'sheet.png')
    with Image.open(tmp_path / 'sheet.png') as image:
        assert image.size[0] > 250 * min(which + 1, draw_worlds.ACROSS)


def test_a_turned_map_that_is_made_larger_stays_turned():
    assert foreign.scaled(replace(room(40, 20), origin_yaw=0.3), 1.7).origin_yaw == 0.3
