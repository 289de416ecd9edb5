"""`experiment square`: a mission in lockstep, without ROS; JSON on stdout, figures in a folder, speed on stderr."""
import argparse
import json
import sys
import time
from pathlib import Path

from sara_bringup.drive import Drive
from sara_bringup.lockstep import Lockstep, drive
from sara_bringup.mission import load_mission
from sara_bringup.paths import config_file, share
from sara_bringup.report import figures, table, verdict

EXPERIMENTS = {"square": "square.yaml"}


def run(name, seed, ekf="default", progress=None):
    """Drive the experiment `name` on the chair `seed`; return its Drive and the Lockstep it ran on."""
    mission = load_mission(config_file(EXPERIMENTS[name]))
    lockstep = Lockstep(share() / "maps" / "room.yaml", mission.start, seed, ekf)
    return drive(lockstep, mission, Drive(name, seed, mission.start, ekf), progress), lockstep


def _process_age_s():
    """Seconds since this process was started (Linux: /proc/self/stat, field 22), interpreter and imports included."""
    import os
    ticks = int(Path("/proc/self/stat").read_text().rsplit(")", 1)[1].split()[19])
    return time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK")


def main():
    """Exit status 0 if the drive meets the square's acceptance; with ekf:=thesis, which is there for comparison, if it ran."""
    parser = argparse.ArgumentParser(prog="experiment", description=__doc__)
    parser.add_argument("name", choices=sorted(EXPERIMENTS))
    parser.add_argument("--seed", type=int, default=0, help="which chair is drawn")
    parser.add_argument("--ekf", choices=("default", "thesis"), default="default")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout instead of the table")
    parser.add_argument("--out", type=Path, help="folder for figures and the whole drive as JSON")
    arguments = parser.parse_args()
    result, lockstep = run(arguments.name, arguments.seed, arguments.ekf, lambda text: print(text, file=sys.stderr, flush=True))
    age = _process_age_s()
    print(f"{lockstep.time:.1f} s of the chair's time in {age:.2f} s, start of the process included: {lockstep.time / age:.1f} times real time",
          file=sys.stderr)
    print(json.dumps(result.to_json()) if arguments.json else table(result), flush=True)
    if arguments.out:
        arguments.out.mkdir(parents=True, exist_ok=True)
        world = lockstep.chair.drive.world
        figures(result, arguments.out, (world.occupied, world.resolution, world.origin))
        (arguments.out / f"square_{arguments.ekf}.json").write_text(json.dumps(result.to_file_data()))
    faults = verdict(result, len(load_mission(config_file(EXPERIMENTS[arguments.name])).goals))
    for fault in faults:
        print(f"NOT MET: {fault}", file=sys.stderr)
    sys.exit(1 if faults and arguments.ekf == "default" else 0)
