"""Reads Gazebo's worlds and models (SDF, .world and .sdf files): what stands in the way of the chair, as obstacles.

Read are the collision shapes of models: boxes, cylinders and spheres, placed by the poses of model, nested model, link
and collision, and by the <state> that a saved world ends with. Models named by <include> are looked for in the given
folders and beside the file. Nothing moves: each model stands where the file first has it. Names and defaults are those
of the SDFormat specification (sdformat.org). Planes are the floor.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from sara_common.config import finite_numbers
from sara_sim.world.obstacles import Obstacle
from sara_sim.world.world import WorldError

HEIGHT = 1.4  # m: what hangs higher than this does not hinder somebody who sits
STEP = 0.02  # m: what is lower than this is floor
UPRIGHT = 1.0 - 1e-4  # cosine of the angle up to which an axis is upright
FLOOR = ('plane', 'heightmap')  # geometries that are no obstacles
MODEL = 'model://'
SKY = ('sun', 'ground_plane')  # models that many worlds include: the light, and the floor


@dataclass(frozen=True)
class Scene:
    """`shapes`: Obstacles that stand, m, in the world's frame. `left_out`: what cannot be read, a sentence each."""

    shapes: tuple[Obstacle, ...]
    left_out: tuple[str, ...]


def read_sdf(path: str | Path, models: Iterable[str | Path] = (), height: float = HEIGHT) -> Scene:
    """The Scene of a .world or .sdf file. `models`: folders that hold the models of <include> by their names.
    `height`: m, what hangs higher is no obstacle.

    Raises WorldError where the file cannot be read, holds no world or model, or a number is none.
    """
    path = Path(path)
    root = _parsed(path)
    reader = _Reader((path.parent, *map(Path, models)), height)
    world = root.find('world')
    if world is not None:
        reader.all_models(world, np.eye(4), '', _states(world, path))
    elif root.find('model') is not None:
        reader.all_models(root, np.eye(4), '', {})
    else:
        raise WorldError(f'{path} holds neither <world> nor <model>.')
    return Scene(tuple(reader.shapes), tuple(dict.fromkeys(reader.left_out)))


def _parsed(path):
    try:
        root = ElementTree.parse(path).getroot()
    except (OSError, ElementTree.ParseError, UnicodeDecodeError, ValueError) as error:
        raise WorldError(f'the world {path} cannot be read: {error}.') from error
    if root.tag != 'sdf':
        raise WorldError(f'{path} begins with <{root.tag}>, allowed is <sdf>.')
    return root


def _states(world, path):
    """{name: pose (4, 4)} of the models that a saved world's <state> places."""
    placed = {}
    for model in world.findall('state/model'):
        pose = model.find('pose')
        if pose is not None:
            placed[model.get('name')] = _transform(pose, f'{path}, state of {model.get("name")}')
    return placed


def _numbers(text, count, where):
    values = finite_numbers(text, count)
    if values is None:
        raise WorldError(f'{where}: {text!r} is given, allowed are {count} finite numbers.')
    return values


def _transform(pose, where):
    """(4, 4) of a <pose>: x y z roll pitch yaw, m and rad; the identity where there is none."""
    found = np.eye(4)
    if pose is None or not (pose.text or '').strip():
        return found
    x, y, z, *angles = _numbers(pose.text, 6, f'{where}, pose')
    if pose.get('degrees', 'false') in ('true', '1'):
        angles = [math.radians(angle) for angle in angles]
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(angle), math.sin(angle)) for angle in angles)
    found[:3, :3] = (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )
    found[:3, 3] = x, y, z
    return found


def _length(geometry, name, where):
    value = _numbers(geometry.findtext(name), 1, f'{where}, {name}')[0]
    if value <= 0.0:
        raise WorldError(f'{where}: {name} is {value:g}, allowed are lengths above 0 m.')
    return value


class _Reader:
    """Collects shapes and what is left out, going down the tree."""

    def __init__(self, folders, height):
        self.folders, self.height = folders, height
        self.shapes, self.left_out = [], []
        self._including: list[Path] = []

    def all_models(self, parent: Element, frame: np.ndarray, where: str, placed: dict) -> None:
        """Everything in a <world>, <model> or <sdf>, whose frame (4, 4) is known."""
        for model in parent.findall('model'):
            name = where + str(model.get('name'))
            self._model(model, self._placed(model, frame, name, placed), name)
        for include in parent.findall('include'):
            self._include(include, frame, where, placed)
        for kind in ('actor', 'population', 'road'):
            self.left_out += [f'{kind} {where}{found.get("name")}: not read' for found in parent.findall(kind)]

    def _placed(self, element, frame, name, placed=None):
        """The frame of an element; the <state> has the last word on it."""
        if placed and element.get('name') in placed:
            return placed[element.get('name')]
        pose = element.find('pose')
        if pose is not None:
            unread = [key for key in ('relative_to', 'frame') if pose.get(key)]
            if unread or pose.get('rotation_format', 'euler_rpy') != 'euler_rpy':
                self.left_out.append(f'{name}: its pose is {pose.attrib}, read as x y z roll pitch yaw in its parent')
        return frame @ _transform(pose, name)

    def _model(self, model, frame, name):
        self.all_models(model, frame, f'{name}/', {})
        for link in model.findall('link'):
            within = self._placed(link, frame, f'{name}/{link.get("name")}')
            for collision in link.findall('collision'):
                where = f'{name}/{link.get("name")}/{collision.get("name")}'
                self._shape(collision.find('geometry'), self._placed(collision, within, where), where)

    def _include(self, include, frame, where, placed):
        uri = (include.findtext('uri') or '').strip()
        if uri.split('/')[-1].lower().replace(' ', '_') in SKY:
            return
        folder = next((found for found in self._folders_of(uri) if found.is_dir()), None)
        if folder is None:
            self.left_out.append(f'include {uri}: there is no such model in {", ".join(map(str, self.folders))}')
            return
        name = (include.findtext('name') or folder.name).strip()
        file = folder / 'model.sdf'
        if file in self._including:
            raise WorldError(f'{file} includes itself.')
        self._including.append(file)
        for model in _parsed(file).findall('model'):
            own = frame @ _transform(model.find('pose'), str(file))
            if include.find('pose') is not None:
                own = frame @ _transform(include.find('pose'), f'include {uri}')
            self._model(model, placed.get(name, own), where + name)
        self._including.pop()

    def _folders_of(self, uri):
        """Where a model may lie: model://NAME in each folder, a path beside the file else."""
        relative = uri[len(MODEL) :] if uri.startswith(MODEL) else uri
        return [folder / relative for folder in self.folders] if relative and '://' not in relative else []

    def _shape(self, geometry, frame, where):
        """Add the outline on the floor of one collision."""
        kinds = [] if geometry is None else [part for part in geometry if part.tag not in FLOOR]
        for part in kinds:
            found = self._outline(part, frame, where)
            if found is None:
                self.left_out.append(f'{where}: a {part.tag} that is {_standing(frame)} is not read')
                continue
            obstacle, half_height = found
            if frame[2, 3] + half_height > STEP and frame[2, 3] - half_height < self.height:
                self.shapes.append(obstacle)

    def _outline(self, part, frame, where):
        """(Obstacle, m of half its height); None for what has no outline of a box or a disc."""
        at, upright = (float(frame[0, 3]), float(frame[1, 3])), int(np.argmax(np.abs(frame[2, :3])))
        if part.tag == 'sphere':
            radius = _length(part, 'radius', where)
            return Obstacle(where, radius=radius, at=at), radius
        if part.tag not in ('box', 'cylinder') or abs(frame[2, upright]) < UPRIGHT:
            return None
        if part.tag == 'cylinder':
            radius, length = _length(part, 'radius', where), _length(part, 'length', where)
            if upright == 2:
                return Obstacle(where, radius=radius, at=at), 0.5 * length
            sides = [2.0 * radius, 2.0 * radius, length]
        else:
            sides = _numbers(part.findtext('size'), 3, f'{where}, size')
            if min(sides) <= 0.0:
                raise WorldError(f'{where}: size is {sides}, allowed are lengths above 0 m.')
        first, second = (axis for axis in range(3) if axis != upright)
        yaw = math.atan2(frame[1, first], frame[0, first])
        return Obstacle(where, size=(sides[first], sides[second]), at=at, yaw=yaw), 0.5 * sides[upright]


def _standing(frame):
    return 'upright' if np.abs(frame[2, :3]).max() >= UPRIGHT else 'tilted'
