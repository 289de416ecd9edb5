"""A planner drives a task, in lockstep: the true pose, a map of the world, and no sensors between planner and wall.

PLANNERS are compared on equal terms, as journeys.py has the classic ones: the safety gate limits speeds and
accelerations for all, but neither its distance zones nor the range layer act, so that a contact is the planner's own.
`delivered` is the default with both, as the chair has it. Success is that of BARN and of P. Anderson et al., "On
Evaluation of Embodied Navigation Agents", 2018 (arXiv:1807.06757): the goal is reached and nothing was touched.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from sara_bringup.lockstep.lockstep import Lockstep, LockstepError
from sara_common.planar import wrap
from sara_common.platforms import chosen
from sara_lab.journeys.journeys import PLANNERS as JOURNEY_PLANNERS
from sara_lab.journeys.journeys import Planner
from sara_lab.journeys.judged import Judged
from sara_lab.journeys.travel import PACE, PATIENCE_S, Recorder, reach
from sara_lab.journeys.worlds.pure_pursuit import PurePursuit
from sara_lab.journeys.worlds.task import Task
from sara_lab.judge.clearance import Clearance, clearance
from sara_lab.judge.judge import judge

PLANNERS = {
    'default': Planner('RotateThenPursue', ''),
    'TrajectoryPlannerROS': JOURNEY_PLANNERS['TrajectoryPlannerROS'],
    'DWAPlannerROS': JOURNEY_PLANNERS['DWAPlannerROS'],
    'textbook': Planner(
        'PurePursuit',
        '',
        over={'base_global_planner': 'sara_nav/GridPlanner', 'base_local_planner': PurePursuit.plugin_name},
    ),
    'delivered': Planner('RotateThenPursue', '', sonars=True),
}
OURS, DELIVERED = 'default', 'delivered'
POSITION_M, YAW_DEG = 0.15, 6.0  # farther off than that, a goal is not reached, whatever move_base says


@dataclass(frozen=True)
class Outcome(Judged):
    """What came of a task. `reached`: by move_base's word and by the true pose; `text`: that word. `clearance`:
    Clearance, None where the chair did not come up, as `judgement`.
    """

    kind: str
    name: str
    planner: str
    scale: float
    reached: bool
    late: bool
    text: str
    position_error: float
    yaw_error_deg: float
    recoveries: int
    contacts: tuple
    judgement: object
    clearance: Clearance | None

    @property
    def success(self) -> bool:
        """Reached, and nothing touched."""
        return self.reached and not self.contacts

    @property
    def spl(self) -> float:
        """Success weighted by path length: the shortest way over the one driven, 0 without success."""
        if not self.success:
            return 0.0
        return self.judgement.shortest / max(self.judgement.shortest, self.judgement.length)

    @property
    def faults(self) -> list[str]:
        """What must not be: SARA's default touches nothing. What the others touch are figures."""
        mine = self.planner in (OURS, DELIVERED)
        return self.contact_faults if mine else []

    def to_json(self) -> dict:
        """All as plain data."""
        kept = self.clearance and self.clearance._asdict()
        return {**super().to_json(), 'success': self.success, 'spl': self.spl, 'clearance': kept}


def drive(task: Task, planner: str, watch: Callable[[Lockstep], None] | None = None) -> Outcome:
    """Drive a Task with one of the PLANNERS; the chair is drawn by the task's number. `watch`: called with the Lockstep
    after each step.
    """
    how = PLANNERS[planner]
    lockstep = Lockstep(task.grid, task.start, task.number, localization='fake', navigation=how.navigation)
    how.prepare(lockstep)
    which = task.kind, task.name, planner, task.scale
    recorder = Recorder(lockstep, watch)
    try:
        lockstep.start_up()
    except LockstepError as error:
        return Outcome(*which, False, False, str(error), math.nan, math.nan, 0, (), None, None)
    goal, late = reach(recorder, task.goal, PATIENCE_S + task.way / PACE)
    track = recorder.track([replace(goal, shortest=task.way, ideal=task.ideal)])
    last, world = lockstep.chair.pose, lockstep.chair.world
    off, turned = math.dist(last[:2], task.goal[:2]), math.degrees(wrap(last[2] - task.goal[2]))
    return Outcome(
        *which,
        goal.reached and off <= POSITION_M and abs(turned) <= YAW_DEG,
        late,
        goal.text,
        off,
        turned,
        recorder.recoveries,
        tuple(recorder.touched.contacts),
        judge(track, world),
        clearance(track, world, chosen().size),
    )
