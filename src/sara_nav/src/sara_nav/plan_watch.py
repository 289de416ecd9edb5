"""Whether a plan that is being driven has been crossed by something new since it was made."""
import numpy as np


class PlanWatch:
    """Remembers how much the robot's footprint touches at each pose of a plan; where it touches more later, the plan is blocked.

    What it touched from the beginning is the planner's business: one that plans for the robot's centre may lead a corner of the
    footprint through something, and would do so again.
    """

    def __init__(self):
        self.forget()

    def forget(self):
        """There is no plan any more."""
        self._plan, self._touched, self._at = None, None, 0

    def take(self, plan, world):
        """Watch a new plan (n, 3), made on a LocalWorld of the global costmap."""
        self._plan = np.ascontiguousarray(plan, dtype=np.float64)
        self._touched, self._at = world.touched(self._plan), 0

    def blocked(self, pose, world):
        """Return how far (m) along the plan from the robot (Pose2D) it is blocked now, or None when it is not."""
        if self._plan is None:
            return None
        left = self._plan[self._at:]
        steps = np.concatenate([[0.0], np.hypot(*np.diff(left[:, :2], axis=0).T).cumsum()])
        near = steps <= self.AHEAD
        self._at += int(np.hypot(left[near, 0] - pose.x, left[near, 1] - pose.y).argmin())
        worse = np.flatnonzero(world.touched(self._plan[self._at:]) > self._touched[self._at:])
        if not len(worse):
            return None
        return float(np.hypot(*np.diff(self._plan[self._at:self._at + worse[0] + 1, :2], axis=0).T).sum())

    AHEAD = 2.0
    """The robot is looked for on the next so many metres of its plan."""
