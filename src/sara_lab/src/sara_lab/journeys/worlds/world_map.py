"""`world_map`: a Gazebo world, or a ROS map, as a map of another scale: NAME.pgm and NAME.yaml, which the simulator,
map_server and whatever reads maps take. What of a Gazebo world cannot be read is said, a line each.
"""

import argparse
import math
import sys
from pathlib import Path

from sara_lab.journeys.worlds.foreign import GAZEBO, drawn_map, scaled
from sara_nav.maps import map_io
from sara_nav.maps.map_io import GridMap, MapError
from sara_nav.maps.map_saver import SaveError, SaverConfig, save_map
from sara_sim.world.sdf import HEIGHT, read_sdf
from sara_sim.world.world import WorldError


def main(words: list[str] | None = None) -> None:
    """Exit status 1, and why, where the world cannot be read or the map cannot be written."""
    parser = argparse.ArgumentParser(prog='world_map', description=__doc__)
    parser.add_argument('world', type=Path, help='a .world, .sdf or .yaml file')
    parser.add_argument('name', help='of the map: a path without ending')
    parser.add_argument('--scale', type=float, default=1.0, help='by which it is made larger (%(default)s)')
    parser.add_argument('--models', type=Path, nargs='+', default=(), metavar='FOLDER', help='of included models')
    parser.add_argument(
        '--height', type=float, default=HEIGHT, metavar='M', help='what hangs higher is left out (%(default)s)'
    )
    options = parser.parse_args(words)
    if not (math.isfinite(options.scale) and options.scale > 0.0):
        parser.error(f'--scale is {options.scale}, allowed are numbers above 0')
    try:
        print('\n'.join(save_map(_map(options), SaverConfig(options.name))))
    except (WorldError, MapError, SaveError, ValueError) as error:
        sys.exit(f'world_map: {error}')


def _map(options) -> GridMap:
    if options.world.suffix not in GAZEBO:
        return scaled(map_io.load_map(str(options.world)), options.scale)
    scene = read_sdf(options.world, options.models, options.height)
    for sentence in scene.left_out:
        print(f'left out: {sentence}', file=sys.stderr)
    if not scene.shapes:
        raise WorldError(f'{options.world}: nothing stands in it')
    return drawn_map(scene, options.scale)
