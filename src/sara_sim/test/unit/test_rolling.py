"""The compiled step of the wheels: the same to the last digit as the step that reckons with everything."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_sim.config import ChairConfig, DrawnChair
from sara_sim.motion.drive import Drive
from sara_sim.world.world import World

speeds = st.floats(-9.0, 9.0)
STATE = (
    'x',
    'y',
    'yaw',
    'right',
    'left',
    'right_speed',
    'left_speed',
    'speed',
    'yaw_rate',
    'acceleration',
    'yaw_acceleration',
    'contacts',
    'touching',
)


def room():
    occupied = np.zeros((80, 80), bool)
    occupied[[0, -1]] = occupied[:, [0, -1]] = True
    return World(occupied, 0.05, (-2.0, -2.0))


def state(drive):
    return [getattr(drive, name) for name in STATE]


@settings(max_examples=60)
@given(
    st.integers(0, 1000),
    st.lists(st.tuples(speeds, speeds, st.integers(1, 60)), min_size=1, max_size=6),
    st.tuples(st.floats(0.5, 1.0), st.floats(0.5, 1.0)),
    st.floats(-3.0, 3.0),
)
def test_it_is_the_step_with_all_that_may_happen_where_nothing_does(seed, parts, grip, yaw):
    config = ChairConfig.of()
    quick, whole = (
        Drive(room(), config, DrawnChair.draw(config, np.random.default_rng(seed)), (0.0, 0.0, yaw), 0.01)
        for _ in range(2)
    )
    whole._rolled = lambda *_: False
    quick.grip = whole.grip = grip
    for right, left, steps in parts:
        for _ in range(steps):
            quick.step(right, left)
            whole.step(right, left)
            assert state(quick) == state(whole)
