"""The whole stack drives on what was compiled at build time: every kernel for the types it is called with, and numba is
not even imported.

Where there is no such build, numba compiles a kernel when it is first called; so none is called for the first time on
the move.
"""

import json
import subprocess
import sys

import pytest

DRIVE = """
import json, sys
import ahead_of_time
from ahead_of_time import misses
made, called = ahead_of_time.kernel, set()
def watched(function=None, **options):
    if function is None:
        return lambda function: watched(function, **options)
    name, compiled = function.__module__ + "." + function.__name__, made(function, **options)
    def call(*arguments):
        called.add(name)
        return compiled(*arguments)
    return call
ahead_of_time.kernel = watched
from sara_bringup.missions.drive import Drive
from sara_lab.journeys.journeys import PLANNERS, Planner
from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.missions.mission import load_mission
from sara_bringup.paths import config_file, share
from sara_nav.move_base import warming
from sara_common.planar import Pose2D
how = PLANNERS["%(planner)s"] if "%(planner)s" in PLANNERS else Planner("TrajectoryPlannerROS", "%(planner)s")
mission = load_mission(config_file("square.yaml"))
warming.warm()
room = share() / "maps" / "room.yaml"
lockstep = Lockstep(room, mission.start, 0, localization="%(localization)s", navigation=how.navigation)
how.prepare(lockstep)
at_start = set(called)
lockstep.start_up()
lockstep.move_base.set_goal(Pose2D(*mission.goals[0]), lockstep.time)
end, begin = lockstep.time + 15.0, lockstep.chair.pose
while lockstep.time < end:
    lockstep.step()
moved = abs(lockstep.chair.pose[0] - begin[0])
print(json.dumps([moved, misses(), "numba" in sys.modules, len(called), sorted(called - at_start)]))
"""


def driven(localization, planner):
    script = DRIVE % {'localization': localization, 'planner': planner}
    done = subprocess.run([sys.executable, '-c', script], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


@pytest.mark.parametrize(
    'localization, planner',
    [
        ('ekf', 'default'),
        ('ukf', 'default'),
        ('fake', 'TrajectoryPlannerROS'),
        ('fake', 'DWAPlannerROS'),
        ('ekf', 'thesis_planner.yaml'),
    ],
)
def test_a_drive_needs_no_numba(localization, planner):
    moved, missed, numba, kernels, late = driven(localization, planner)
    assert moved > 1.0
    assert missed == {}, 'warm() of their modules does not call them with these types'
    assert not numba, 'something is not compiled at build time'
    assert kernels > 30 and not late, (
        'called on the move first: whoever calls them has them ready when it is made, or '
        'sara_nav.move_base.warming does'
    )
