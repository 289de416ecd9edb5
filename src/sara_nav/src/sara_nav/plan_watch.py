"""Whether a plan that is being driven has been crossed by something new since it was made."""
import numpy as np

AHEAD = 1.0
"""The robot is looked for on the next so many metres of its plan."""


class PlanWatch:
    """Remembers how much the robot's footprint touches at each pose of a plan; where it touches more later, the plan is blocked.

    What it touched from the beginning is the planner's business: one that plans for the robot's centre may lead a corner of the
    footprint through something, and would do so again.
    """

    def __init__(self):
        self.forget()

    def forget(self):
        """There is no plan any more."""
        self._plan = None

    def take(self, plan, world):
        """Watch a new plan (n, 3), made on a LocalWorld of the global costmap."""
        self._plan = np.ascontiguousarray(plan, dtype=np.float64)
        self._along = np.concatenate([[0.0], np.hypot(*np.diff(self._plan[:, :2], axis=0).T).cumsum()])
        self._touched, self._at = world.touched(self._plan), 0

    def follow(self, pose):
        """The robot is at a Pose2D, some way further along the plan."""
        if self._plan is not None:
            end = np.searchsorted(self._along, self._along[self._at] + AHEAD, 'right')
            near = self._plan[self._at:end]
            self._at += int(((near[:, 0] - pose.x) ** 2 + (near[:, 1] - pose.y) ** 2).argmin())

    def blocked(self, world):
        """Return how far (m) along the plan from the robot it is blocked now, or None when it is not."""
        if self._plan is None:
            return None
        worse = np.flatnonzero(world.touched(self._plan[self._at:]) > self._touched[self._at:])
        return float(self._along[self._at + worse[0]] - self._along[self._at]) if len(worse) else None
