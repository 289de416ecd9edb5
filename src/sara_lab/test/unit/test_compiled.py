"""The whole stack drives on what was compiled at build time: every kernel for the types it is called with, and numba is
not even imported.

Where there is no such build, numba compiles a kernel when it is first called; so none is called for the first time on
the move.
"""

import json
import subprocess
import sys

import pytest
from steady import whole

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


TIGHT = """
import json, math, random, sys
import numpy as np
from ahead_of_time import misses
from sara_bringup.paths import share
from sara_common.planar import Pose2D
from sara_common.platforms import chosen
from sara_lab.fuzz.navigation.fuzz import fuzz_move_base
from sara_nav.costmaps.costmap import InflationConfig, build
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.footprint import pad_footprint, radii
from sara_nav.lattice.planner import LatticePlanner, LatticePlannerConfig
from sara_nav.maps.map_io import load_map
from sara_nav.move_base import warming
from sara_nav.planners.planning import PlanError
warming.warm()
bare, padded, wide = (pad_footprint(np.array(chosen().footprint), by) for by in (0.0, 0.01, 0.04))
costmap = build(load_map(share() / "maps" / "flat.yaml"), radii(padded)[0], inflation=InflationConfig())
planner = LatticePlanner(LatticePlannerConfig(default_tolerance=0.2))
planner.set_footprint(padded)
fits, roomy, g, chance = LocalWorld(costmap, bare), LocalWorld(costmap, wide), costmap.geometry, random.Random(0)
tight = []
while len(tight) < 24:
    x, y = g.origin_x + chance.uniform(0.0, g.size[0]), g.origin_y + chance.uniform(0.0, g.size[1])
    pose = Pose2D(x, y, chance.uniform(-math.pi, math.pi))
    if roomy.collides(pose) and not fits.collides(pose):
        tight.append(pose)
plans = 0
for start, goal in zip(tight[::2], tight[1::2]):
    try:
        plans += len(planner.plan(costmap, start, goal)) > 0
    except PlanError:
        pass
tally = fuzz_move_base(%(inputs)d, 1)
print(json.dumps([plans, sum(tally.values()), misses(), "numba" in sys.modules]))
"""


def test_tight_places_and_random_inputs_need_no_numba():
    """Starts and goals nearer to something than the planner's margin, then every kind of planner, layer and recovery
    with random goals, maps and sensor messages: whatever is called was compiled for the types it is called with.
    """
    count = whole(6000, 2000)
    script = TIGHT % {'inputs': count}
    done = subprocess.run([sys.executable, '-c', script], capture_output=True, text=True, check=True)
    plans, inputs, missed, numba = json.loads(done.stdout)
    assert plans >= 3 and inputs > count
    assert missed == {}, 'warm() of their modules does not call them with these types'
    assert not numba, 'something is not compiled at build time'
