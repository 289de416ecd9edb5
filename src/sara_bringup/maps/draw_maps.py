"""Draws the maps of this folder: `python3 draw_maps.py [FOLDER]` writes room, hall, doorway, school, flat, street and
street_world, .pgm and .yaml (ROS map format, trinary).

The room holds the thesis's 4 m square (1, 1) .. (5, 5) with 1.4 m to the walls and a cupboard in its middle. The others
are where
planners drive: the hall is open, the doorway is one door of 0.80 m between two rooms, the school has corridors,
classrooms and doors of 0.80 and 0.90 m, the flat is furnished. The street is nine blocks of houses; in `street` the
carriageways are forbidden, but for the crossings, as if their kerbs were walls; `street_world` is what stands there.
"""

import sys
from pathlib import Path

import numpy as np
import yaml
from PIL import Image

RESOLUTION, OUTDOORS = 0.05, 0.10  # m per cell
FREE, OCCUPIED, UNKNOWN = 254, 0, 205  # grey values as map_saver writes them


class Drawing:
    """A grey image addressed in metres, y up, whose lower left corner is `origin`."""

    def __init__(self, origin, size, resolution=RESOLUTION):
        self.origin, self.resolution = origin, resolution
        self.cells = np.full((round(size[1] / resolution), round(size[0] / resolution)), UNKNOWN, np.uint8)

    def fill(self, x0, y0, x1, y1, value):
        """Fill the rectangle (x0, y0)..(x1, y1), metres."""
        i0, i1 = (round((x - self.origin[0]) / self.resolution) for x in (x0, x1))
        j0, j1 = (round((y - self.origin[1]) / self.resolution) for y in (y0, y1))
        self.cells[j0:j1, i0:i1] = value

    def build(self, outline, hollows, things):
        """A house: a block with rooms and doors cut out of it and things put into them; each (x0, y0, x1, y1), m."""
        self.fill(*outline, OCCUPIED)
        for hollow in hollows:
            self.fill(*hollow, FREE)
        for thing in things:
            self.fill(*thing, OCCUPIED)

    def save(self, folder, name):
        """Write NAME.pgm (top row first) and NAME.yaml into `folder`."""
        Image.fromarray(self.cells[::-1]).save(folder / f'{name}.pgm')
        description = {
            'image': f'{name}.pgm',
            'resolution': self.resolution,
            'origin': [*self.origin, 0.0],
            'negate': 0,
            'occupied_thresh': 0.65,
            'free_thresh': 0.196,
        }
        (folder / f'{name}.yaml').write_text(yaml.safe_dump(description, sort_keys=False))


def room():
    """6.8 x 6.8 m inside, walls 0.10 m thick, a cupboard of 1.6 x 1.2 m in the middle."""
    drawing = Drawing((-1.0, -1.0), (8.0, 8.0))
    drawing.fill(-0.5, -0.5, 6.5, 6.5, OCCUPIED)
    drawing.fill(-0.4, -0.4, 6.4, 6.4, FREE)
    drawing.fill(2.2, 2.4, 3.8, 3.6, OCCUPIED)
    return drawing


def hall():
    """30 x 8 m inside, empty: room to drive fast and to stop."""
    drawing = Drawing((-1.0, -1.0), (32.0, 10.0))
    drawing.fill(-0.5, -0.5, 30.5, 8.5, OCCUPIED)
    drawing.fill(-0.4, -0.4, 30.4, 8.4, FREE)
    return drawing


def doorway():
    """Two rooms of 6 x 8 m, a wall of 0.10 m between them, a door of 0.80 m in its middle."""
    drawing = Drawing((-1.0, -1.0), (14.0, 10.0))
    drawing.build((-0.1, -0.1, 12.2, 8.1), ((0.0, 0.0, 6.0, 8.0), (6.1, 0.0, 12.1, 8.0), (6.0, 3.6, 6.1, 4.4)), ())
    return drawing


SCHOOL_ROOMS = (
    (0.0, 6.0, 28.0, 8.2),
    (15.0, 8.2, 17.0, 14.0),  # corridors, 2.2 and 2.0 m wide
    (0.0, 0.0, 8.9, 5.9),
    (9.0, 0.0, 17.9, 5.9),
    (18.0, 0.0, 28.0, 5.9),  # classrooms in the south
    (0.0, 8.3, 7.4, 14.0),
    (7.5, 8.3, 14.9, 14.0),  # two in the north-west
    (17.1, 8.3, 28.0, 10.9),
    (17.1, 11.0, 28.0, 14.0),
)  # two beside the short corridor
SCHOOL_DOORS = (
    (1.8, 5.9, 2.7, 6.0),
    (7.0, 5.9, 7.8, 6.0),
    (12.6, 5.9, 13.5, 6.0),
    (20.0, 5.9, 20.8, 6.0),  # 0.90, 0.80, 0.90, 0.80 m
    (3.2, 8.2, 4.0, 8.3),
    (10.0, 8.2, 10.9, 8.3),
    (7.4, 9.2, 7.5, 10.1),  # 0.80, 0.90, 0.90 m
    (17.0, 9.2, 17.1, 10.0),
    (17.0, 12.0, 17.1, 12.9),
    (26.0, 10.9, 26.8, 11.0),
)  # 0.80, 0.90, 0.80 m
CLASSROOM = (
    (1.2, 0.8),
    (3.9, 0.8),
    (6.6, 0.8),
    (1.2, 2.4),
    (3.9, 2.4),
    (6.6, 2.4),
)  # desks for two, lower left corners
SCHOOL_THINGS = (
    *((x0 + x, y, x0 + x + 1.2, y + 0.5) for x0 in (0.0, 9.0, 18.4) for x, y in CLASSROOM),
    *(
        (x0 + x, y, x0 + x + 1.2, y + 0.5)
        for x0 in (0.4, 7.9)
        for x, y in ((0.8, 11.4), (3.5, 11.4), (0.8, 13.0), (3.5, 13.0))
    ),
    (20.5, 8.9, 23.7, 9.9),
    (20.0, 12.2, 21.4, 12.9),
    (23.2, 12.2, 24.6, 12.9),  # a long table; two tables
    (5.0, 7.85, 8.0, 8.2),
    (22.0, 6.0, 25.0, 6.35),
)  # lockers along the corridor


def school():
    """28 x 14 m inside: two corridors, seven classrooms, ten doors; every aisle lets the chair turn."""
    drawing = Drawing((-1.0, -1.0), (30.0, 16.0))
    drawing.build((-0.1, -0.1, 28.1, 14.1), SCHOOL_ROOMS + SCHOOL_DOORS, SCHOOL_THINGS)
    return drawing


FLAT_ROOMS = (
    (0.0, 4.0, 11.0, 5.8),  # corridor, 1.8 m wide
    (0.0, 5.9, 6.4, 9.4),
    (6.5, 5.9, 11.0, 9.4),  # living room, bedroom
    (0.0, 0.0, 4.4, 3.9),
    (4.5, 0.0, 7.2, 3.9),
    (7.3, 0.0, 11.0, 3.9),
)  # kitchen, bathroom, child's room
FLAT_DOORS = (
    (2.6, 5.8, 3.5, 5.9),
    (8.0, 5.8, 8.8, 5.9),  # 0.90, 0.80 m
    (1.5, 3.9, 2.4, 4.0),
    (5.55, 3.9, 6.35, 4.0),
    (8.6, 3.9, 9.4, 4.0),
)  # 0.90, 0.80, 0.80 m
FLAT_THINGS = (
    (1.0, 8.5, 3.2, 9.4),
    (0.0, 6.5, 0.35, 8.3),
    (4.8, 7.8, 6.0, 8.7),  # sofa, shelf, dining table
    (5.2, 7.35, 5.6, 7.75),
    (4.35, 8.05, 4.75, 8.45),  # two chairs
    (9.2, 7.4, 11.0, 9.0),
    (6.5, 7.3, 7.1, 9.4),  # double bed, wardrobe
    (0.0, 0.0, 4.4, 0.6),
    (0.0, 0.6, 0.6, 2.0),
    (3.3, 1.6, 4.1, 2.4),  # the kitchen's worktops and table
    (4.5, 0.0, 5.2, 1.7),
    (6.75, 0.6, 7.2, 1.1),
    (6.75, 1.7, 7.2, 2.2),  # bath, toilet, basin
    (10.0, 0.0, 11.0, 2.0),
    (7.3, 0.5, 7.9, 1.7),
    (10.6, 4.0, 11.0, 4.8),
)  # bed, desk; a chest in the corridor


def flat():
    """11 x 9.4 m inside: a corridor, five furnished rooms, five doors."""
    drawing = Drawing((-1.0, -1.0), (13.0, 11.4))
    drawing.build((-0.1, -0.1, 11.1, 9.5), FLAT_ROOMS + FLAT_DOORS, FLAT_THINGS)
    return drawing


STREET_ROADS_X, STREET_ROADS_Y = ((47.0, 53.0), (97.0, 103.0)), ((17.0, 23.0), (37.0, 43.0))
"""The carriageways, m: those along y and those along x."""
PAVEMENT, LAMP, LAMPS_APART = 4.0, 0.2, 25.0
STREET_SIZE = 150.0, 60.0
STREET_HOUSES = tuple(
    (x0, y0, x1, y1)
    for x0, x1 in ((0.0, 43.0), (57.0, 93.0), (107.0, 150.0))
    for y0, y1 in ((0.0, 13.0), (27.0, 33.0), (47.0, 60.0))
)
STREET_LAMPS = tuple(
    (x - 0.5 * LAMP, y - 0.5 * LAMP, x + 0.5 * LAMP, y + 0.5 * LAMP)
    for x in np.arange(0.5 * LAMPS_APART, STREET_SIZE[0], LAMPS_APART)
    for y in (16.5, 23.5, 36.5, 43.5)
)


def street_world():
    """150 x 60 m outdoors: houses, pavements of 4 m, lamp posts at the kerbs; the carriageways are free."""
    drawing = Drawing((0.0, 0.0), STREET_SIZE, OUTDOORS)
    drawing.fill(0.0, 0.0, *STREET_SIZE, FREE)
    for thing in STREET_HOUSES + STREET_LAMPS:
        drawing.fill(*thing, OCCUPIED)
    return drawing


def street():
    """As street_world, with carriageways of 6 m forbidden; crossings of 4 m go on from the pavements at each corner."""
    drawing = street_world()
    for x0, x1 in STREET_ROADS_X:
        drawing.fill(x0, 0.0, x1, STREET_SIZE[1], OCCUPIED)
    for y0, y1 in STREET_ROADS_Y:
        drawing.fill(0.0, y0, STREET_SIZE[0], y1, OCCUPIED)
    for x0, x1 in STREET_ROADS_X:
        for y0, y1 in STREET_ROADS_Y:
            for side in (x0 - PAVEMENT, x1):
                drawing.fill(side, y0, side + PAVEMENT, y1, FREE)
            for side in (y0 - PAVEMENT, y1):
                drawing.fill(x0, side, x1, side + PAVEMENT, FREE)
    return drawing


MAPS = (room, hall, doorway, school, flat, street, street_world)


if __name__ == '__main__':
    for draw in MAPS:
        draw().save(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent, draw.__name__)
