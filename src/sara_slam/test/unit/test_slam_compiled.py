"""slam_gmapping runs on what was compiled at build time, every kernel for its types, and without numba."""

import json
import subprocess
import sys
from pathlib import Path

DRIVE = """
import json, sys
sys.path.append(%r)
import numpy as np
from ahead_of_time import misses
from slam_world import drifting, ranges, round_trip, scan, world
from sara_slam.mapping.slam import Slam
from sara_slam.mapping.slam_config import SlamConfig
map_, path, slam = world(), round_trip(12.0), Slam(SlamConfig(local_scans=8, loop_reach=8.0))
for k, (pose, odometry) in enumerate(zip(path, drifting(path))):
    slam.on_scan(scan(ranges(map_, pose), odometry, 1.0 + k))
slam.map()
print(json.dumps([slam.counts["used"], slam.loops.counts["tried"], misses(), "numba" in sys.modules]))
"""


def test_a_drive_needs_no_numba():
    script = DRIVE % str(Path(__file__).resolve().parent)
    done = subprocess.run([sys.executable, '-c', script], capture_output=True, text=True, check=True)
    used, tried, missed, numba = json.loads(done.stdout)
    assert used == 40 and tried > 3
    assert missed == {}, 'warm() of their modules does not call them with these types'
    assert not numba, 'something is not compiled at build time'
