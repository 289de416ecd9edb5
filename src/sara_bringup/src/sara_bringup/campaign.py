"""`make campaign`: the square in lockstep over many chairs; a line per seed and a table of all in out/campaign."""
import argparse
import json
import math
import sys
from pathlib import Path

from tqdm import tqdm

from sara_bringup.experiment import EXPERIMENTS, run
from sara_bringup.mission import load_mission
from sara_bringup.paths import config_file
from sara_bringup.report import verdict


def main():
    """Exit status 0 if every seed meets the square's acceptance. Seeds that have their file already are not driven again."""
    parser = argparse.ArgumentParser(prog="campaign", description=__doc__)
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--ekf", choices=("default", "thesis"), default="default")
    parser.add_argument("--out", type=Path, default=Path("out/campaign"), help="resumed if it holds results of an earlier call")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    results, goals = [], len(load_mission(config_file(EXPERIMENTS["square"])).goals)
    for seed in tqdm(range(arguments.seeds), unit="chair"):
        path = arguments.out / f"square_{arguments.ekf}_{seed}.json"
        if not path.exists():
            drive, _ = run("square", seed, arguments.ekf)
            path.write_text(json.dumps({**drive.to_json(), "faults": verdict(drive, goals)}))
        results.append(json.loads(path.read_text()))
    print(f"{'seed':>4} {'worst corner m':>15} {'deg':>6} {'fused yaw deg':>14} {'odometry':>9} {'contacts':>9}  faults")
    for result in results:
        errors = [(math.dist(c["true"][:2], c["asked"][:2]), abs(math.remainder(c["true"][2] - c["asked"][2], 360.0))) for c in result["corners"]]
        print(f"{result['seed']:4} {max(e[0] for e in errors):15.3f} {max(e[1] for e in errors):6.2f} {result['yaw_error_max_deg']:14.2f} "
              f"{100 * result['odometry_heading_error']:8.1f}% {result['contacts']:9}  {'; '.join(result['faults'])}")
    failed = [result["seed"] for result in results if result["faults"]]
    print(f"{len(results) - len(failed)} passed, {len(failed)} failed")
    sys.exit(1 if failed else 0)
