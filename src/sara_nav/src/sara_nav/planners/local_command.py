"""What every local planner answers with, and the register that finds one by its name.

A local planner is a class with ``config_class`` (a frozen dataclass with ``faults()``), ``__init__(config)``,
``start(plan)``, ``replan(plan)``, ``stop()``, ``phase`` and ``update(t, dt, pose, velocity, pose_age, world)``, which
returns a LocalCommand. Plans (n, 3) and poses are in the global frame.
"""

from typing import NamedTuple

from sara_nav.config.registry import Registry

LOCAL_PLANNERS = Registry(
    'base_local_planner',
    {
        'sara_nav/RotateThenPursue': 'sara_nav.pursuit.rotate_then_pursue',
        'dwa_local_planner/DWAPlannerROS': 'sara_nav.sampled.dwa_planner',
        'base_local_planner/TrajectoryPlannerROS': 'sara_nav.sampled.trajectory_planner',
    },
)

DRIVING, REACHED, BLOCKED, OFF_PATH, FAILED = 'driving', 'reached', 'blocked', 'off_path', 'failed'
"""States of a LocalCommand. BLOCKED: no command is safe now. OFF_PATH: the plan cannot be followed from here, a new one
is wanted. FAILED: the goal cannot be reached by this planner at all."""


class LocalCommand(NamedTuple):
    """What to drive (v m/s, w rad/s), how it stands, and why when it is not just driving."""

    v: float
    w: float
    state: str = DRIVING
    text: str = ''
