"""Which cells of a grid changed: a few rectangles, so that only they are computed anew."""

WASTE = 1.25
"""Two rectangles are made one when that has at most this many times the cells of both."""


def area(window):
    """Return the number of cells of a window (x0, y0, xn, yn)."""
    return (window[2] - window[0]) * (window[3] - window[1])


class Windows:
    """Rectangles (x0, y0, xn, yn) of cells, columns x0..xn-1 and rows y0..yn-1, always within the grid."""

    def __init__(self, geometry):
        self.geometry = geometry
        self._all = []

    def __iter__(self):
        return iter(list(self._all))

    def __bool__(self):
        return bool(self._all)

    def add(self, x0, y0, xn, yn):
        """Enter a rectangle; what lies off the grid is cut away."""
        if xn <= x0 or yn <= y0:
            return
        new = (max(0, int(x0)), max(0, int(y0)), min(self.geometry.width, int(xn)), min(self.geometry.height, int(yn)))
        if new[2] <= new[0] or new[3] <= new[1]:
            return
        for old in list(self._all):
            both = _around(old, new)
            if area(both) <= WASTE * (area(old) + area(new)):
                self._all.remove(old)
                self.add(*both)
                return
        self._all.append(new)

    def add_all(self):
        """Enter the whole grid."""
        self._all = [(0, 0, self.geometry.width, self.geometry.height)]

    def grow(self, cells):
        """Widen every rectangle by so many cells on each side."""
        old, self._all = self._all, []
        for x0, y0, xn, yn in old:
            self.add(x0 - cells, y0 - cells, xn + cells, yn + cells)

    def bounds(self):
        """Return the one rectangle around all, or None when there is none."""
        result = None
        for window in self._all:
            result = window if result is None else _around(result, window)
        return result


def _around(a, b):
    (ax, ay, an, am), (bx, by, bn, bm) = a, b
    return ax if ax < bx else bx, ay if ay < by else by, an if an > bn else bn, am if am > bm else bm
