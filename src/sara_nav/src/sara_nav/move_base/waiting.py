"""Cycles in which move_base has a goal and stands: without a pose, without a sensor, or because it may be lost."""

from __future__ import annotations

from sara_nav.goals.goal import Goal
from sara_nav.goals.move_base_config import ABORTED, StepResult
from sara_nav.move_base.control_step import End, Means, standing


def without_pose(goal: Goal, t: float, means: Means) -> StepResult | End:
    """There is no pose at t (s)."""
    text = f'no pose of the robot newer than {means.config.transform_tolerance:.2f} s (transform_tolerance)'
    if goal.lost(t, means.config):
        return End(ABORTED, f'Goal aborted: there is {text}.')
    return standing(goal, means, text)


def out_of_date(goal: Goal, t: float, stale: str, means: Means) -> StepResult | End:
    """A sensor is silent; stale: the sentence that says which."""
    patience = means.config.controller_patience
    text = f"Sensor data is out of date, we're not going to allow commanding of the base for safety: {stale}"
    if goal.stale_for(t) >= patience:
        return End(ABORTED, f'Goal aborted: {text} for controller_patience ({patience:.1f} s).')
    return standing(goal, means, text, stale=stale)


def in_doubt(goal: Goal, t: float, doubt: str, help_wanted: str, means: Means) -> StepResult | End:
    """The robot may be lost; doubt: why, help_wanted: what a person is asked for."""
    patience = means.config.lost_patience
    if goal.doubted_for(t) >= patience - 1e-6:
        return End(ABORTED, f'Goal aborted: {doubt}, for lost_patience ({patience:.1f} s).')
    return standing(goal, means, doubt)._replace(help=help_wanted)
