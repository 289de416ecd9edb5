"""Which cells of a grid changed: a few rectangles, so that only they are computed anew."""

from __future__ import annotations

from collections.abc import Iterator

from ahead_of_time import kernel
from sara_nav.grids.grid import GridGeometry

Window = tuple[int, int, int, int]
"""x0, y0, xn, yn: columns x0..xn-1 and rows y0..yn-1."""
WASTE = 1.25
"""Two rectangles are made one when that has at most this many times the cells of both."""


def area(window: Window) -> int:
    """Return the number of cells of a window (x0, y0, xn, yn)."""
    return (window[2] - window[0]) * (window[3] - window[1])


@kernel
def grown(window: Window, column: int, row: int) -> Window:
    """Return the least window around a window and a cell."""
    return min(window[0], column), min(window[1], row), max(window[2], column + 1), max(window[3], row + 1)


class Windows:
    """Rectangles (x0, y0, xn, yn) of cells, columns x0..xn-1 and rows y0..yn-1, always within the grid."""

    def __init__(self, geometry: GridGeometry) -> None:
        self.geometry = geometry
        self._all = []

    def __iter__(self) -> Iterator[Window]:
        return iter(list(self._all))

    def __bool__(self) -> bool:
        return bool(self._all)

    def add(self, x0: int, y0: int, xn: int, yn: int) -> None:
        """Enter a rectangle; what lies off the grid is cut away."""
        if xn <= x0 or yn <= y0:
            return
        new = (max(0, int(x0)), max(0, int(y0)), min(self.geometry.width, int(xn)), min(self.geometry.height, int(yn)))
        if new[2] <= new[0] or new[3] <= new[1]:
            return
        for old in list(self._all):
            both = around(old, new)
            if area(both) <= WASTE * (area(old) + area(new)):
                self._all.remove(old)
                self.add(*both)
                return
        self._all.append(new)

    def add_all(self) -> None:
        """Enter the whole grid."""
        self._all = [(0, 0, self.geometry.width, self.geometry.height)]

    def grow(self, cells: int) -> None:
        """Widen every rectangle by so many cells on each side."""
        old, self._all = self._all, []
        for x0, y0, xn, yn in old:
            self.add(x0 - cells, y0 - cells, xn + cells, yn + cells)

    def bounds(self) -> Window | None:
        """Return the one rectangle around all, or None when there is none."""
        result = None
        for window in self._all:
            result = window if result is None else around(result, window)
        return result


def around(a: Window, b: Window) -> Window:
    """Return the least window around two, by comparisons, which are quicker than min and max in plain Python."""
    (ax, ay, an, am), (bx, by, bn, bm) = a, b
    return ax if ax < bx else bx, ay if ay < by else by, an if an > bn else bn, am if am > bm else bm


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    grown((0, 0, 0, 0), 0, 0)
