"""The chair as a gymnasium environment."""

import math
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from sara_common.platforms import chosen
from sara_lab.ideal.ideal import Ideal
from sara_lab.journeys.worlds import chair_env
from sara_lab.journeys.worlds import task as task_module


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Ideal times, which take seconds, are not asked for."""
    monkeypatch.setattr(task_module, 'ideal', lambda *_: Ideal(9.0, np.empty((0, 2))))


def test_the_environment_passes_gymnasium_s_checker():
    env = gymnasium.make('sara_lab.journeys.worlds.chair_env:Wheelchair-v0', kinds=['obstacles_15'])
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        check_env(env.unwrapped, skip_render_check=True)


def test_driving_ahead_is_progress_and_the_same_every_time():
    def driven():
        env = chair_env.ChairEnv()
        env.reset(seed=4, options={'kind': 'obstacles_15', 'number': 2})
        return [env.step(np.float32([0.375, 0.1])) for _ in range(15)], env

    (steps, env), (again, _) = driven(), driven()
    assert all(np.array_equal(a[0][key], b[0][key]) for a, b in zip(steps, again) for key in a[0])
    assert steps[-1][0]['velocity'][0] == pytest.approx(0.3, abs=0.05)
    assert len(steps[0][0]['ranges']) == len(chosen().sonars) and steps[-1][0]['ranges'].min() < chair_env.NO_ECHO
    nearer = math.dist(env.task.start[:2], env.task.goal[:2]) - math.dist(
        env.lockstep.chair.pose[:2], env.task.goal[:2]
    )
    assert sum(step[1] for step in steps) == pytest.approx(nearer, abs=0.02)


def test_a_contact_and_the_goal_end_an_episode():
    env = chair_env.ChairEnv(gated=False)
    env.reset(seed=0, options={'kind': 'obstacles_15', 'number': 2})
    for _ in range(400):
        _, reward, terminated, truncated, info = env.step(np.float32([1.0, 0.0]))
        if terminated:
            break
    assert terminated and not truncated and info['contacts'] and reward < chair_env.TOUCHED + 1.0
    env.reset(seed=0, options={'kind': 'obstacles_15', 'number': 2})
    env.task = chair_env.Task(*(*env.task.__dict__.values(),)[:5], env.lockstep.chair.pose, 1.0, 1.0)
    _, reward, terminated, _, _ = env.step(np.float32([0.0, 0.0]))
    assert terminated and reward == pytest.approx(chair_env.REACHED, abs=0.01)


def test_options_and_kinds_that_are_none_are_told_in_words():
    with pytest.raises(ValueError, match='kinds are'):
        chair_env.ChairEnv(kinds=['castle'])
    with pytest.raises(ValueError, match='options are'):
        chair_env.ChairEnv().reset(options={'world': 3})
    with pytest.raises(ValueError, match='there is no kind'):
        chair_env.ChairEnv().reset(options={'kind': 'castle'})
