"""The gap between body and world: exact for walls, discs and boxes; the same from all sides; none beyond reach."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.platforms import chosen
from sara_lab.judge import gaps
from sara_lab.judge.judge import judge
from sara_lab.judge.judgement import Track
from sara_sim.world.obstacles import Obstacle
from sara_sim.world.world import World

angle = st.floats(-math.pi, math.pi)


BODY = chosen().size
FRONT, SIDE = 0.5 * BODY[0], 0.5 * BODY[1]


def wall():
    """A wall at x >= 2 m of a 4 x 4 m map."""
    occupied = np.zeros((80, 80), bool)
    occupied[:, 40:] = True
    return World(occupied)


@given(st.floats(1.0, 1.9), angle)
@settings(max_examples=60)
def test_a_wall_is_as_far_as_the_rectangle_reaches_short_of_it(x, yaw):
    expected = 2.0 - x - abs(math.cos(yaw)) * FRONT - abs(math.sin(yaw)) * SIDE
    assert gaps.at(wall(), (x, 2.0, yaw), BODY) == pytest.approx(max(expected, 0.0), abs=1e-9)


@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), angle, st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), angle)
@settings(max_examples=100)
def test_two_boxes_are_as_far_apart_as_their_sampled_outlines(x, y, yaw, bx, by, box_yaw):
    world = World.empty()
    world.obstacles.add(Obstacle('box', size=(0.6, 0.4), at=(bx, by), yaw=box_yaw))

    def outline(x, y, yaw, length, width):
        u = np.linspace(-0.5, 0.5, 400)
        points = np.vstack(
            [np.column_stack([length * u, np.full_like(u, side * width / 2)]) for side in (-1, 1)]
            + [np.column_stack([np.full_like(u, side * length / 2), width * u]) for side in (-1, 1)]
        )
        c, s = math.cos(yaw), math.sin(yaw)
        return points @ np.array([[c, s], [-s, c]]) + (x, y)

    a, b = outline(x, y, yaw, *BODY), outline(bx, by, box_yaw, 0.6, 0.4)
    sampled = min(np.hypot(*(b - point).T).min() for point in a[::4])
    found = gaps.at(world, (x, y, yaw), BODY)
    assert found == 0.0 or found == pytest.approx(min(sampled, gaps.REACH), abs=0.01)
    met = world.meets(x, y, yaw, *BODY).any()
    assert (found == 0.0) == met or found < 1e-9


@given(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), angle)
@settings(max_examples=60)
def test_a_disc_is_its_radius_nearer_than_its_centre(x, y, yaw):
    world = World.empty()
    world.obstacles.add(Obstacle('person', radius=0.25, at=(x, y)))
    dx, dy = abs(math.cos(yaw) * x + math.sin(yaw) * y), abs(math.cos(yaw) * y - math.sin(yaw) * x)
    expected = max(math.hypot(max(dx - FRONT, 0.0), max(dy - SIDE, 0.0)) - 0.25, 0.0)
    assert gaps.at(world, (0.0, 0.0, yaw), BODY) == pytest.approx(min(expected, gaps.REACH))
    assert gaps.at(world, (0.0, 0.0, yaw), BODY, obstacles=False) == gaps.REACH


def test_the_gap_and_an_overlap_agree_with_the_simulator():
    world, random = wall(), np.random.default_rng(5)
    for x, y, yaw in np.column_stack(
        [random.uniform(0.8, 2.2, 300), random.uniform(0.5, 3.5, 300), random.uniform(-math.pi, math.pi, 300)]
    ):
        assert (gaps.at(world, (x, y, yaw), BODY) == 0.0) == world.overlaps(x, y, yaw, *BODY)


def test_along_a_drive_obstacles_are_where_they_were():
    """Somebody walks past at 1 m/s while the chair stands: nearest after 2 s, when 0.6 m of air are left."""
    world = World.empty()
    beside = SIDE + 0.25 + 0.6
    world.obstacles.add(Obstacle('person', radius=0.25, path=((-2.0, beside), (2.0, beside)), speed=1.0))
    t = np.arange(0.0, 4.0, 0.01)
    found = judge(Track(t, np.zeros((len(t), 3))), world)
    assert found.gap_min == pytest.approx(0.6, abs=1e-6) and found.gap_p5 >= found.gap_min
    assert world.obstacles.time == 0.0


@given(
    st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=2, max_size=6), st.floats(-3, 3), st.floats(-3, 3)
)
@settings(max_examples=60)
def test_the_distance_from_a_line_is_that_of_its_nearest_sample(corners, x, y):
    line = np.array(corners, float)
    u = np.linspace(0.0, 1.0, 400)[:, None]
    samples = np.vstack([a + u * (b - a) for a, b in zip(line, line[1:])])
    assert gaps.from_line(np.array([[x, y]]), line)[0] == pytest.approx(np.hypot(*(samples - (x, y)).T).min(), abs=0.02)
