"""Put a recorded laser log through slam_gmapping and judge the poses by true relations, or by a reference.

    rosrun sara_slam bench_relations LOG RELATIONS [--json]
    rosrun sara_slam bench_relations LOG --reference CORRECTED_LOG [--json]

LOG: CARMEN's or gmapping's text or a JSON table, plain or gzip (sara_slam.logs.records). Prints mean and sigma of the
errors of translation and rotation (Kuemmerle et al. 2009), seconds of processor time, times real time, memory. --noise
adds noise to the odometry first. The odometry in the log of Freiburg 079 has no sign: drives backwards look like drives
forwards. There --corrected takes gmapping's poses, to which --noise is added.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import sys
import time

import numpy as np
from PIL import Image
from tqdm import tqdm

from sara_common.config import ConfigError
from sara_localization.config import parameters
from sara_nav.maps.map_saver import UNKNOWN_GREY, SaverConfig, grey_values, save_map
from sara_slam.logs.noise import OdometryNoise, noisy
from sara_slam.logs.records import LogError, read_log
from sara_slam.logs.relations import Relations, Track, read_relations, relations_of, score
from sara_slam.logs.replay import Replay
from sara_slam.mapping.slam import Slam
from sara_slam.mapping.slam_config import SlamConfig

RANGE_MAX = 80.0
"""m from which on a range of the logs' SICK scanners is no echo."""
MAX_USABLE = 30.0


def main(argv: list[str] | None = None) -> None:
    """The program; its status is 1 where something cannot be used."""
    arguments = _arguments(argv)
    try:
        print(_told(bench(arguments), arguments.json))
    except (LogError, ConfigError, OSError) as error:
        sys.exit(f'bench_relations: {error}')


def bench(arguments: argparse.Namespace) -> dict[str, float | int]:
    """The figures, by name: of `main`'s arguments. Raises LogError, ConfigError, OSError."""
    records = read_log(arguments.log, arguments.corrected)
    if arguments.noise is not None:
        records = noisy(records, OdometryNoise(), arguments.noise)
    params = parameters.load(arguments.params) if arguments.params else {}
    slam = Slam(SlamConfig.from_params({'maxUrange': MAX_USABLE, **params}), _say)
    relations = _relations(arguments)
    began = time.process_time()
    replay = Replay(slam, RANGE_MAX)
    track = replay.run(records, lambda steps: tqdm(steps, unit='line', file=sys.stderr, disable=arguments.quiet))
    grid_map = slam.map()
    seconds = time.process_time() - began
    if arguments.map:
        save_map(grid_map, SaverConfig(name=arguments.map))
    if arguments.picture:
        _draw(grid_map, arguments.picture)
    found = score(track, relations, arguments.offset)
    length = float(track.stamps[-1] - track.stamps[0])
    return {
        'translation_m': round(found.translation, 4),
        'translation_sigma_m': round(found.translation_sigma, 4),
        'rotation_deg': round(found.rotation, 3),
        'rotation_sigma_deg': round(found.rotation_sigma, 3),
        'relations': found.relations,
        'offset_s': round(found.offset, 4),
        'scans': slam.counts['scans'],
        'key_scans': len(slam.scans),
        'loops': slam.counts['loops'],
        'false_loops': slam.counts['false_loops'],
        'seconds': round(seconds, 2),
        'times_real_time': round(length / seconds, 1) if seconds else math.inf,
        'memory_mb': round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0),
    }


def _relations(arguments) -> Relations:
    if arguments.relations:
        return read_relations(arguments.relations)
    records = [record for record in read_log(arguments.reference, corrected=True) if record.ranges is not None]
    poses = np.array([record.pose for record in records])
    return relations_of(Track.of(np.array([record.stamp for record in records]), poses))


def _draw(grid_map, path):
    """The map as a picture, without what is unknown about it."""
    pixels = grey_values(grid_map.data)
    rows, columns = (np.flatnonzero((pixels != UNKNOWN_GREY).any(axis)) for axis in (1, 0))
    Image.fromarray(pixels[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]).save(path)


def _say(sentence):
    tqdm.write('warning: ' + sentence, file=sys.stderr)


def _told(figures, as_json):
    if as_json:
        return json.dumps(figures)
    return (
        '{translation_m:.3f} +- {translation_sigma_m:.3f} m, {rotation_deg:.2f} +- {rotation_sigma_deg:.2f} deg over '
        '{relations} relations\n{scans} scans, {key_scans} key scans, {loops} loops ({false_loops} found false)\n'
        '{seconds:.1f} s of one core, {times_real_time:.0f} times real time, {memory_mb} MB'
    ).format(**figures)


def _arguments(argv):
    parser = argparse.ArgumentParser(prog='bench_relations', description=__doc__.split('\n\n')[0])
    add = parser.add_argument
    add('log', metavar='LOG')
    add('relations', metavar='RELATIONS', nargs='?', help='lines "t1 t2 x y z roll pitch yaw"')
    add('--reference', metavar='CORRECTED_LOG', help='a log whose poses count as true, in place of relations')
    add('--corrected', action='store_true', help="take the poses of gmapping's log, corrections included, as odometry")
    add('--noise', metavar='SEED', type=int, help='add noise to the odometry (sara_slam.logs.noise)')
    add('--offset', metavar='S', type=float, help="the relations' clock less the log's; found where it is not given")
    add('--params', metavar='FILE.yaml', help='parameters of slam_gmapping')
    add('--map', metavar='NAME', help='write the map to NAME.pgm and NAME.yaml')
    add('--picture', metavar='FILE.png', help='draw the map')
    add('--json', action='store_true', help='one line of JSON')
    add('--quiet', action='store_true', help='no progress')
    arguments = parser.parse_args(sys.argv[1:] if argv is None else argv)
    if bool(arguments.relations) == bool(arguments.reference):
        parser.error('RELATIONS or --reference CORRECTED_LOG must be given, and not both')
    return arguments
