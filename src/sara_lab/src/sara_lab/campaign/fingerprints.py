"""`fingerprints`: the hash of every step of 32 drives in lockstep (squares, travel, hazards, classic planners): whether
a change of the code changes how the chair drives, to the last bit.

    rosrun sara_lab fingerprints --out before.json        # before the change
    rosrun sara_lab fingerprints --compare before.json    # after it; exit status 1 where a drive differs

Only fingerprints of one machine are comparable: another processor may round a sine differently.
"""

import argparse
import hashlib
import json
import math
import struct
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from tqdm import tqdm

from sara_bringup.lockstep.lockstep import Lockstep
from sara_lab.campaign import hazards
from sara_lab.experiments.sensor_experiments import full_turns
from sara_lab.journeys import journeys, squares, travel

DIGITS = 16  # of a hash that are kept


@dataclass(frozen=True)
class Drive:
    """`kind` of KINDS, and what its function is called with."""

    kind: str
    arguments: tuple[str | int, ...]

    @property
    def name(self) -> str:
        """For the file, the command line and the reader."""
        return ' '.join(map(str, (self.kind, *self.arguments)))


@dataclass(frozen=True)
class Fingerprint:
    """`hash` of the true pose and velocity after every step; how many `steps` there were; the `end`: x, y (m), yaw
    (rad), v (m/s), w (rad/s).
    """

    hash: str
    steps: int
    end: tuple[float, float, float, float, float]


def _square(direction, pose, seed):
    squares.square(direction, pose, seed, _gain(seed) if pose == 'fused' else None)


def _travel(name, mode, number):
    travel.drive(name, mode, number, _gain(number) if mode == 'fused' else None)


def _planner(planner):
    how = journeys.PLANNERS[planner]
    squares.square('left', 'true', 0, navigation=how.navigation, prepare=how.prepare)


def _gain(seed):
    return full_turns(seed).gain.gain


KINDS = {'square': _square, 'travel': _travel, 'hazard': hazards.happen, 'planner': _planner}
HAZARDS = (
    'adapter_unplugged',
    'encoders_frozen',
    'imu_silent',
    'left_encoder_frozen',
    'navigation_killed',
    'ranges_silent',
)
DRIVES = (
    *(
        Drive('square', (way, pose, seed))
        for way in ('left', 'right')
        for pose in ('true', 'fused')
        for seed in range(3)
    ),
    *(
        Drive('travel', (name, mode, number))
        for name in ('flat', 'school', 'hall')
        for number, mode in enumerate(('true', 'fused', 'boxes', 'people'), 1)
    ),
    *(Drive('hazard', (name, 1)) for name in HAZARDS),
    *(Drive('planner', (name,)) for name in ('TrajectoryPlannerROS', 'DWAPlannerROS')),
)


def fingerprint(drive: Callable[[], object]) -> Fingerprint:
    """The Fingerprint of what `drive` does in lockstep. Raises ValueError where it makes no step."""
    found, steps, end = hashlib.sha1(), 0, None

    def on_step(lockstep):
        nonlocal steps, end
        end = (*lockstep.chair.pose, *lockstep.chair.velocity[:2])
        found.update(struct.pack('<5d', *end))
        steps += 1

    with watched(on_step):
        drive()
    if end is None:
        raise ValueError('the drive made no step in lockstep')
    return Fingerprint(found.hexdigest()[:DIGITS], steps, tuple(map(float, end)))


@contextmanager
def watched(on_step: Callable[[Lockstep], None]) -> Iterator[None]:
    """Call `on_step` after each step of every Lockstep: the drives make their own, so the class is what is watched."""
    step = Lockstep.step

    def watched(self):
        step(self)
        on_step(self)

    Lockstep.step = watched
    try:
        yield
    finally:
        Lockstep.step = step


def fingerprint_of(drive: Drive) -> Fingerprint:
    """The Fingerprint of one of DRIVES."""
    return fingerprint(lambda: KINDS[drive.kind](*drive.arguments))


def fingerprints(drives: Iterable[Drive], processes: int = 1) -> dict[str, Fingerprint]:
    """{name: Fingerprint} of Drives, in their order, with progress on stderr."""
    drives = list(drives)
    with ProcessPoolExecutor(processes) as pool:
        found = tqdm(pool.map(fingerprint_of, drives), total=len(drives), unit='drive', file=sys.stderr)
        return {drive.name: one for drive, one in zip(drives, found)}


def differences(before: dict[str, Fingerprint], after: dict[str, Fingerprint]) -> list[str]:
    """A sentence for each drive of `after` that is not the same as in `before`, with how far apart the two end."""
    found = []
    for name, new in after.items():
        old = before.get(name)
        if old is None:
            found.append(f'{name}: not among those that it is compared with')
        elif old != new:
            position = math.dist(old.end[:2], new.end[:2])
            yaw = math.degrees(abs(math.remainder(new.end[2] - old.end[2], 2.0 * math.pi)))
            steps = f', {old.steps} steps became {new.steps}' if old.steps != new.steps else ''
            found.append(f'{name}: ends {position:.3g} m and {yaw:.3g} deg from before{steps}')
    return found


def write(path: Path, found: dict[str, Fingerprint]) -> None:
    """As JSON; numbers keep all their digits."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({name: asdict(one) for name, one in found.items()}, indent=1) + '\n', encoding='utf-8')


def read(path: Path) -> dict[str, Fingerprint]:
    """What `write` has written. Raises OSError, or ValueError where it is no such file."""
    try:
        return {
            name: Fingerprint(one['hash'], one['steps'], tuple(one['end']))
            for name, one in json.loads(path.read_text(encoding='utf-8')).items()
        }
    except (AttributeError, KeyError, TypeError, json.JSONDecodeError) as error:
        raise ValueError(f'{path} holds no fingerprints: {error!r}') from None


def main(argv: list[str] | None = None) -> None:
    """Exit status 1 where a drive differs, 2 where there is nothing to drive or to compare with."""
    parser = argparse.ArgumentParser(
        prog='fingerprints', description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('words', nargs='*', metavar='WORD', help='only the drives with one of these in their names')
    parser.add_argument('--out', type=Path, metavar='F.json', help='write the fingerprints there')
    parser.add_argument('--compare', type=Path, metavar='F.json', help='fingerprints of before')
    parser.add_argument('--processes', type=int, default=2, help='at the same time (default: %(default)s)')
    arguments = parser.parse_args(argv)
    drives = [drive for drive in DRIVES if not arguments.words or any(word in drive.name for word in arguments.words)]
    if not drives:
        parser.error(f'no drive is called {" or ".join(arguments.words)}')
    if arguments.processes < 1:
        parser.error(f'--processes is {arguments.processes}, allowed are whole numbers of 1 or more')
    try:
        before = read(arguments.compare) if arguments.compare else None
    except (OSError, ValueError) as error:
        parser.error(str(error))
    found = fingerprints(drives, arguments.processes)
    if arguments.out:
        write(arguments.out, found)
    if before is None:
        for name, one in found.items():
            print(f'{name:32} {one.hash}  {one.steps} steps')
        return
    differ = differences(before, found)
    print(f'{len(found) - len(differ)} of {len(found)} drives are the same')
    for sentence in differ:
        print(f'DIFFERS: {sentence}')
    sys.exit(1 if differ else 0)
