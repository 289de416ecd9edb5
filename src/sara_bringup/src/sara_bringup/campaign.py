"""`make campaign`: everything that is judged over many chairs, in lockstep; resumable, with a table for each part and a JSON of all figures.

A part is a set of cases, each with a file of its own in the folder; a case that has its file is not run again.
"""
import argparse
import json
import math
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tqdm import tqdm

from sara_bringup import hazards, journeys, odometry_trial, sensor_report
from sara_bringup.experiment import EXPERIMENTS, run
from sara_bringup.mission import load_mission
from sara_bringup.paths import config_file
from sara_bringup.report import verdict
from sara_bringup.sensor_experiments import full_turns
from sara_localization import consistency, fuzz

FUZZ_MESSAGES, FUZZ_CASES = 1_000_000, 20


@dataclass(frozen=True)
class Part:
    """`cases`: {name: function without arguments that gives a dict with `faults`}. `summary`: (results) -> (lines, figures)."""

    cases: dict
    summary: object


def square(seeds):
    """The thesis's square, on chairs whose gyro's gain has been found by full turns, as E6 does."""
    goals = len(load_mission(config_file(EXPERIMENTS["square"])).goals)

    def case(seed):
        gain = full_turns(seed).gain.gain
        drive, _ = run("square", seed, gain=gain)
        return {**drive.to_json(), "gain": gain, "faults": verdict(drive, goals)}
    return Part({f"square_{seed}": lambda seed=seed: case(seed) for seed in range(seeds)}, _square_summary)


def _square_summary(results):
    corners = [corner for result in results for corner in result["corners"]]
    position = [math.dist(corner["true"][:2], corner["asked"][:2]) for corner in corners]
    yaw = [abs(math.remainder(corner["true"][2] - corner["asked"][2], 360.0)) for corner in corners]
    fused, wheels = [[math.dist(result["corners"][-1][source][:2], result["corners"][-1]["true"][:2]) for result in results]
                     for source in ("estimated", "odometry")]
    figures = {"corner_position_m": _spread(position), "corner_yaw_deg": _spread(yaw),
               "fused_yaw_deg": _spread([result["yaw_error_max_deg"] for result in results]),
               "odometry_heading_error": _spread([result["odometry_heading_error"] for result in results]),
               "final_fused_position_error_m": _spread(fused), "final_odometry_position_error_m": _spread(wheels),
               "fused_times_better_median": float(np.median(wheels) / np.median(fused)),
               "contacts": sum(result["contacts"] for result in results)}
    return _lines(figures), figures


def hazard_times(seeds):
    """Every hazard, on the way to a goal and at 0.8 m/s."""
    def case(name, seed, cruise):
        outcome = hazards.happen(name, seed, cruise)
        return {**vars(outcome), "allowed": outcome.allowed, "faults": outcome.faults}
    return Part({f"hazard_{name}{'_cruise' * cruise}_{seed}": lambda name=name, seed=seed, cruise=cruise: case(name, seed, cruise)
                 for name in hazards.HAZARDS for cruise in (False, True) for seed in range(seeds)}, _hazard_summary)


def _hazard_summary(results):
    lines = [f"{'hazard':24} {'cases':>5} {'worst s':>8} {'of allowed':>11} {'worst way m':>12} {'moved after m':>14}"]
    figures = {}
    for name in hazards.HAZARDS:
        of = [result for result in results if result["hazard"] == name]
        worst = max(of, key=lambda result: result["stopped_after"] / result["allowed"])
        figures[name] = {"cases": len(of), "worst_s": max(result["stopped_after"] for result in of), "worst_share_of_allowed": worst["stopped_after"] / worst["allowed"],
                         "worst_way_m": max(result["way"] for result in of), "moved_after_m": max(result["drifted"] for result in of)}
        lines.append("{:24} {cases:5} {worst_s:8.2f} {worst_share_of_allowed:10.0%} {worst_way_m:13.2f} {moved_after_m:14.3f}".format(name, **figures[name]))
    return lines, figures


def obstacle(seeds):
    """What the map does not know appears 1.5 m ahead at 0.8 m/s."""
    def case(seed):
        speed, stopped, gap, contacts = hazards.obstacle_ahead(seed)
        faults = ([f"{contacts} contacts"] if contacts else []) + ([] if stopped < hazards.WATCHED_S else ["did not stop"])
        return {"seed": seed, "speed": speed, "stopped_after": stopped, "gap": gap, "faults": faults}
    return Part({f"obstacle_{seed}": lambda seed=seed: case(seed) for seed in range(seeds)}, _obstacle_summary)


def _obstacle_summary(results):
    figures = {"gap_m": _spread([result["gap"] for result in results]), "smallest_gap_m": min(result["gap"] for result in results),
               "stopped_after_s": _spread([result["stopped_after"] for result in results])}
    return _lines(figures), figures


def odometry(seeds):
    """calibrate_odometry on chairs with a wrong track and unequal wheels."""
    return Part({f"odometry_{seed}": lambda seed=seed: odometry_trial.trial(seed) for seed in range(seeds)}, _odometry_summary)


def _odometry_summary(results):
    before, after = [[max(result[key]) for result in results] for key in ("before", "after")]
    figures = {**{f"{name}_error_percent": _spread([100 * abs(result[name]) for result in results]) for name in ("separation", "left", "right")},
               "return_error_before_m": _spread(before), "return_error_after_m": _spread(after),
               "times_better_median": float(np.median(before) / np.median(after))}
    return _lines(figures), figures


def sensors(seeds):
    """E1, E2, E3 and E6, chair by chair; what is judged over all chairs, `experiment sensors` judges."""
    def case(seed):
        chairs = sensor_report.run([seed])
        return {**sensor_report.to_json(chairs)[0], "faults": sensor_report.chair_faults(chairs[0])}
    return Part({f"sensors_{seed}": lambda seed=seed: case(seed) for seed in range(seeds)}, _sensors_summary)


def _sensors_summary(results):
    after = [max(abs(mean - ideal) for mean, ideal in zip(result["accel_after"]["mean"], (0.0, 0.0, sensor_report.GRAVITY))) for result in results]
    figures = {"accelerometer_after_m_s2": _spread(after), "gyro_after_node_deg_s": _spread([max(map(abs, result["gyro_after"]["mean"])) for result in results]),
               "left_on_pc_deg_s_mean": float(np.mean([abs(rate) for result in results for rate in result["yaw_rate_error_pc"]])),
               "full_turn_after_gain_deg": _spread([abs(measured - true) for result in results for true, measured in result["check"]])}
    return _lines(figures), figures


def all_journeys(_seeds):
    """Each local planner from ten starts to ten goals on each map, whatever the number of chairs."""
    return Part({f"journey_{name}_{planner}_{number}": lambda name=name, planner=planner, number=number: journeys.drive(name, planner, number).to_json()
                 for name in journeys.MAPS for planner in journeys.PLANNERS for number in range(journeys.PAIRS)}, _journeys_summary)


def _journeys_summary(results):
    lines = [f"{'map':8} {'planner':22} {'reached':>7} {'contacts':>8} {'worst m off':>11} {'deg':>5} {'m/s':>5} {'longer by':>9} {'turned rad/m':>12}"]
    figures = {}
    for name in journeys.MAPS:
        for planner in journeys.PLANNERS:
            of = [result for result in results if (result["map"], result["planner"]) == (name, planner)]
            there = [result for result in of if result["reached"]] or of
            row = {"cases": len(of), "reached": sum(result["reached"] for result in of), "contacts": sum(result["contacts"] for result in of),
                   "worst_position_m": max(result["position_error"] for result in there), "worst_yaw_deg": max(abs(math.degrees(result["yaw_error"])) for result in there),
                   "mean_speed": float(np.mean([result["driven"] / max(result["seconds"], 1.0) for result in there])),
                   "longer_than_planned": float(np.mean([result["driven"] / result["way"] for result in there])) - 1.0,
                   "turned_per_m": float(np.mean([result["turned"] / result["way"] for result in there]))}
            figures[f"{name}_{planner}"] = row
            lines.append("{:8} {:22} {reached:4}/{cases:<2} {contacts:8} {worst_position_m:11.3f} {worst_yaw_deg:5.1f} {mean_speed:5.2f} {longer_than_planned:9.1%} "
                         "{turned_per_m:12.2f}".format(name, planner, **row))
    return lines, figures


def filter_fuzz(_seeds):
    """A million random messages through EKF and UKF, whatever the number of chairs."""
    def case(seed):
        report = fuzz.fuzz(FUZZ_MESSAGES // FUZZ_CASES, seed)
        return {"messages": report.messages, "faults": [str(fault) for fault in report.faults]}
    return Part({f"filter_fuzz_{seed}": lambda seed=seed: case(seed) for seed in range(FUZZ_CASES)}, _fuzz_summary)


def _fuzz_summary(results):
    figures = {"messages": sum(result["messages"] for result in results)}
    return _lines(figures), figures


def nees(seeds):
    """Whether the filters are as sure as they may be: NEES of (x, y, yaw), the truth drawn from their own model; twice as many seeds as chairs."""
    def case(kind):
        mean, low, high = consistency.nees_campaign(range(2 * seeds), kind)
        return {"filter": kind, "mean": mean, "low": low, "high": high, "faults": [] if low <= mean <= high else [f"mean NEES {mean:.2f}, allowed are {low:.2f} to {high:.2f}"]}
    return Part({f"nees_{kind}_{2 * seeds}": lambda kind=kind: case(kind) for kind in ("ekf", "ukf")}, _nees_summary)


def _nees_summary(results):
    figures = {result["filter"]: {key: result[key] for key in ("mean", "low", "high")} for result in results}
    return _lines(figures), figures


def _spread(values):
    return {"median": float(np.median(values)), "p95": float(np.percentile(values, 95)), "worst": float(np.max(values))}


def _lines(figures):
    return [f"{name:26} " + (", ".join(f"{key} {number:.3f}" for key, number in value.items()) if isinstance(value, dict) else f"{value:g}")
            for name, value in figures.items()]


PARTS = {"square": square, "hazards": hazard_times, "obstacle": obstacle, "odometry": odometry, "sensors": sensors,
         "journeys": all_journeys, "nees": nees, "filter_fuzz": filter_fuzz}


def main():
    """Exit status 0 if every case meets its acceptance."""
    parser = argparse.ArgumentParser(prog="campaign", description=__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; all without it")
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--out", type=Path, default=Path("out/campaign"), help="resumed if it holds results of an earlier call")
    parser.add_argument("--json", type=Path, help="where the figures go, each part with its commit; parts that are not run keep theirs")
    arguments = parser.parse_args()
    unknown = [name for name in arguments.parts if name not in PARTS]
    if unknown:
        parser.error(f"there is no part {', '.join(unknown)}; there are {', '.join(PARTS)}")
    if arguments.seeds < 1:
        parser.error(f"--seeds is {arguments.seeds}, allowed are whole numbers of 1 or more")
    arguments.out.mkdir(parents=True, exist_ok=True)
    commit, figures_of, failed = _commit(), {}, []
    for name in arguments.parts or PARTS:
        part = PARTS[name](arguments.seeds)
        results = [_result(arguments.out / f"{case}.json", work) for case, work in tqdm(part.cases.items(), unit="case", desc=name)]
        lines, figures = part.summary(results)
        bad = [(case, result["faults"]) for case, result in zip(part.cases, results) if result["faults"]]
        print(f"\n{name}: {len(results) - len(bad)} of {len(results)} passed")
        print("\n".join(lines + [f"NOT MET: {case}: {'; '.join(faults)}" for case, faults in bad]), flush=True)
        figures_of[name] = {"commit": commit, "seeds": arguments.seeds, "cases": len(results), "failed": [case for case, _ in bad], **figures}
        failed += bad
    if arguments.json:
        before = json.loads(arguments.json.read_text()) if arguments.json.exists() else {}
        arguments.json.write_text(json.dumps({name: figures_of.get(name, before.get(name)) for name in PARTS if name in figures_of or name in before}, indent=1) + "\n")
    sys.exit(1 if failed else 0)


def _result(path, work):
    if not path.exists():
        path.write_text(json.dumps(work()))
    return json.loads(path.read_text())


def _commit():
    found = subprocess.run(["git", "-C", str(Path(__file__).resolve().parent), "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False)
    return found.stdout.strip() or "unknown"
