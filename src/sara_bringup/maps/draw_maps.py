"""Draws the maps of this folder: `python3 draw_maps.py` writes room and hall, .pgm and .yaml (ROS map format, trinary).

The room holds the thesis's 4 m square (1, 1) .. (5, 5) with 1.4 m to the walls and a cupboard in its middle.
"""
from pathlib import Path

import numpy as np
import yaml
from PIL import Image

RESOLUTION = 0.05  # m per cell
FREE, OCCUPIED, UNKNOWN = 254, 0, 205  # grey values as map_saver writes them


class Drawing:
    """A grey image addressed in metres, y up, whose lower left corner is `origin`."""

    def __init__(self, origin, size):
        self.origin = origin
        self.cells = np.full((round(size[1] / RESOLUTION), round(size[0] / RESOLUTION)), UNKNOWN, np.uint8)

    def fill(self, x0, y0, x1, y1, value):
        """Fill the rectangle (x0, y0)..(x1, y1), metres."""
        i0, i1 = (round((x - self.origin[0]) / RESOLUTION) for x in (x0, x1))
        j0, j1 = (round((y - self.origin[1]) / RESOLUTION) for y in (y0, y1))
        self.cells[j0:j1, i0:i1] = value

    def save(self, folder, name):
        """Write NAME.pgm (top row first) and NAME.yaml into `folder`."""
        Image.fromarray(self.cells[::-1]).save(folder / f"{name}.pgm")
        description = {"image": f"{name}.pgm", "resolution": RESOLUTION, "origin": [*self.origin, 0.0], "negate": 0,
                       "occupied_thresh": 0.65, "free_thresh": 0.196}
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(description, sort_keys=False))


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


if __name__ == "__main__":
    for draw in (room, hall):
        draw().save(Path(__file__).resolve().parent, draw.__name__)
