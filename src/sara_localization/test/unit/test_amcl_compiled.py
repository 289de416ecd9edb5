"""amcl runs on what was compiled at build time: every kernel for the types it is called with, and numba is not even
imported, which would cost a hundred megabytes.
"""

import json
import subprocess
import sys
from pathlib import Path

DRIVE = """
import json, sys
sys.path.append(%r)
import numpy as np
from ahead_of_time import misses
from amcl_world import drifting, loop, scan, world
from sara_localization.particles.amcl import Amcl
from sara_localization.particles.amcl_config import SCAN_MODELS, AmclConfig
map_, path, used = world(), loop(20), []
for model in SCAN_MODELS:
    amcl = Amcl(AmclConfig(max_particles=500, laser_model_type=model, do_beamskip=True))
    amcl.set_map(map_)
    amcl.set_pose(path[0], np.diag([0.01, 0.01, 0.01]))
    for anywhere in (False, True):
        if anywhere:
            amcl.start_anywhere()
        for pose, odometry in zip(path, drifting(path, np.random.default_rng(0))):
            amcl.on_scan(scan(map_, pose, odometry))
    used.append(amcl.counts["updates"])
print(json.dumps([used, misses(), "numba" in sys.modules]))
"""


def test_a_drive_needs_no_numba():
    script = DRIVE % str(Path(__file__).resolve().parent)
    done = subprocess.run([sys.executable, '-c', script], capture_output=True, text=True, check=True)
    used, missed, numba = json.loads(done.stdout)
    assert min(used) > 10
    assert missed == {}, 'warm() of their modules does not call them with these types'
    assert not numba, 'something is not compiled at build time'
