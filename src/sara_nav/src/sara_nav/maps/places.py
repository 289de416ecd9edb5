"""Named places of a map, kept beside it: MAP.places.yaml holds `places: {NAME: [x m, y m, yaw deg]}`, poses of
`base_link` in the map frame.

People write these files by hand: comments and order survive when a place is added or moved.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
import re
from dataclasses import dataclass
from pathlib import Path

import yaml

from sara_common.config import is_number
from sara_common.files import write_whole
from sara_common.planar import wrap

NAME = re.compile(r'[^\W\d][\w-]*')  # a letter first, so that no name is taken for a number or an option
FORM = 'three finite numbers: [x m, y m, yaw deg]'


class PlacesError(ValueError):
    """A places file, or a place, that cannot be used; the text is a sentence for the terminal."""


@dataclass(frozen=True)
class Place:
    """`name` is "" for a pose given in numbers. x, y: m; yaw: rad; in the map frame."""

    name: str
    x: float
    y: float
    yaw: float

    def __str__(self):
        return (
            f'{self.name + " " if self.name else ""}({self.x:.2f} m, {self.y:.2f} m, {math.degrees(self.yaw):.0f} deg)'
        )


def beside(map_yaml: Path | str) -> Path:
    """The places file of a map's YAML file."""
    return Path(map_yaml).with_suffix('.places.yaml')


def load(path: Path | str) -> dict[str, Place]:
    """{name: Place} of a places file, in its order. Raises PlacesError with every fault at once."""
    path = Path(path)
    try:
        content = yaml.safe_load(path.read_text(encoding='utf-8'))
    except OSError as error:
        raise PlacesError(f'{path}: {error.strerror}; `go --here NAME` begins such a file') from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:  # ValueError: of a text, a date or an endless number
        raise PlacesError(f'{path} is no YAML: {" ".join(str(error).split())}') from error
    return _read(content, path)


def _read(content, path):
    entries = content.get('places') if isinstance(content, dict) else None
    if entries is None and isinstance(content, dict) and 'places' in content:
        entries = {}
    if not isinstance(entries, dict):
        raise PlacesError(f'{path}: `places` is missing; it holds NAME: [x m, y m, yaw deg], a line each')
    faults = [
        f'{name!r} is no name: a letter first, then letters, digits, _ and -'
        for name in entries
        if not (isinstance(name, str) and NAME.fullmatch(name))
    ]
    faults += [f'{name} holds {pose!r}, allowed are {FORM}' for name, pose in entries.items() if not _is_pose(pose)]
    if faults:
        raise PlacesError(f'{path}: {"; ".join(faults)}')
    return {
        name: Place(name, float(x), float(y), wrap(math.radians(yaw_deg))) for name, (x, y, yaw_deg) in entries.items()
    }


def _is_pose(pose):
    return isinstance(pose, list) and len(pose) == 3 and all(map(is_number, pose))


def find(places: dict[str, Place], name: str, where: Path | str = '') -> Place:
    """The Place of that name, upper and lower case alike where there is only one such. Raises PlacesError that names
    the near ones, or all.
    """
    if name in places:
        return places[name]
    alike = [known for known in places if known.lower() == name.lower()]
    if len(alike) == 1:
        return places[alike[0]]
    of = f' of {where}' if where else ''
    if not places:
        raise PlacesError(
            f'there is no place {name!r}: the list{of} is empty; `go --here {name}` writes where the chair is as one'
        )
    near = alike or difflib.get_close_matches(name.lower(), [known.lower() for known in places], n=3, cutoff=0.5)
    near = [known for known in places if known in near or known.lower() in near]
    if near:
        raise PlacesError(f'there is no place {name!r}{of}; did you mean {" or ".join(near)}?')
    raise PlacesError(f'there is no place {name!r}{of}; there are {", ".join(places)}')


def pose(x: float | str, y: float | str, yaw_deg: float | str) -> Place:
    """A Place without a name of three numbers or texts (m, m, deg). Raises PlacesError."""
    try:
        numbers = [float(value) for value in (x, y, yaw_deg)]
    except ValueError:
        numbers = []
    if not (numbers and all(map(math.isfinite, numbers))):
        raise PlacesError(f'{x} {y} {yaw_deg} is no pose, allowed are {FORM}')
    return Place('', numbers[0], numbers[1], wrap(math.radians(numbers[2])))


def write(path: Path | str, place: Place) -> bool:
    """Put a Place into a places file, which is made if need be; what else it holds stays as it is. Returns whether the
    name was known before.

    Raises PlacesError where the name is none, the file is faulty or cannot be written. The file is replaced in one go.
    """
    path = Path(path)
    if not NAME.fullmatch(place.name):
        raise PlacesError(f'{place.name!r} is no name: a letter first, then letters, digits, _ and -')
    before = load(path) if path.exists() else {}
    text = (
        path.read_text(encoding='utf-8')
        if path.exists()
        else (
            f'# Named places of {path.name.removesuffix(".places.yaml")}: NAME: [x m, y m, yaw deg], base_link in '
            'the map.\nplaces:\n'
        )
    )
    line = f'  {_line(place)}'
    _change(
        path, _with_line(text, place.name, line), {**before, **_read(yaml.safe_load('places:\n' + line), path)}, line
    )
    return place.name in before


def rename(path: Path | str, name: str, to: str) -> None:
    """Give a place of a file another name; its line stays where it is. Raises PlacesError as `write` does, and where
    there is no such place or the new name is taken.
    """
    path = Path(path)
    before = load(path)
    find({held: before[held] for held in before if held == name}, name, path)
    if not NAME.fullmatch(to):
        raise PlacesError(f'{to!r} is no name: a letter first, then letters, digits, _ and -')
    if to in before:
        raise PlacesError(f'there is a place {to} already, in {path}')
    changed = re.sub(
        rf'(?m)^(\s+){re.escape(name)}(\s*:)', rf'\g<1>{to}\g<2>', path.read_text(encoding='utf-8'), count=1
    )
    after = {to if held == name else held: place for held, place in before.items()}
    after[to] = dataclasses.replace(after[to], name=to)
    _change(path, changed, after, f'  {_line(after[to])}')


def remove(path: Path | str, name: str) -> None:
    """Take a place and its line's comment out of a file. Raises PlacesError as `write` does, and where there is no such
    place.
    """
    path = Path(path)
    before = load(path)
    find({held: before[held] for held in before if held == name}, name, path)
    changed = re.sub(rf'(?m)^\s+{re.escape(name)}\s*:.*\n?', '', path.read_text(encoding='utf-8'), count=1)
    after = {held: place for held, place in before.items() if held != name}
    _change(path, changed, after, f'  without {name}')


def _line(place):
    return f'{place.name}: [{place.x:.3f}, {place.y:.3f}, {math.degrees(place.yaw):.1f}]'


def _change(path, changed, wanted, line):
    """Write the changed text if it holds what is wanted and nothing else; `line`: what to write by hand if not."""
    try:
        after = _read(yaml.safe_load(changed), path)
    except (yaml.YAMLError, PlacesError):
        after = None
    if after != wanted:
        raise PlacesError(
            f'{path} is not written as one NAME: [x m, y m, yaw deg] a line below `places:`; put this into it '
            f'by hand:\n{line}'
        )
    _replace(path, changed)


def _with_line(text, name, line):
    """The text with the line of that name replaced, or added after the last place."""
    lines = text.splitlines()
    head = next((k for k, held in enumerate(lines) if re.match(r'places\s*:', held)), None)
    if head is None:
        return text
    lines[head] = re.sub(r':\s*\{\s*\}', ':', lines[head])
    inside = [
        k for k, held in enumerate(lines) if k > head and re.match(r'\s+\S', held) and not held.lstrip().startswith('#')
    ]
    mine = [k for k in inside if re.match(rf'\s+{re.escape(name)}\s*:', lines[k])]
    indent = re.match(r'\s+', lines[inside[0]]).group() if inside else '  '
    if mine:
        comment = re.search(r'\s+#.*$', lines[mine[0]])
        lines[mine[0]] = indent + line.lstrip() + (comment.group() if comment else '')
    else:
        lines.insert((inside[-1] if inside else head) + 1, indent + line.lstrip())
    return '\n'.join(lines) + '\n'


def _replace(path, text):
    try:
        write_whole(path, text, path.stat().st_mode & 0o777 if path.exists() else 0o644)
    except OSError as error:
        raise PlacesError(f'{path} cannot be written: {error.strerror}; --places FILE names another one') from error


def listing(places: dict[str, Place]) -> str:
    """The places as text, a line each."""
    width = max((len(name) for name in places), default=0)
    return '\n'.join(
        f'{name:{width}}  x {place.x:7.3f} m  y {place.y:7.3f} m  yaw {math.degrees(place.yaw):6.1f} deg'
        for name, place in places.items()
    )
