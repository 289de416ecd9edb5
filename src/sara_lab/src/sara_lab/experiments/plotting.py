"""Matplotlib as the experiments use it: one look, files that are the same to the byte for the same data, no date in
them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np

matplotlib.use('Agg')
from matplotlib import pyplot  # noqa: E402
from PIL import Image  # noqa: E402

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from sara_lab.experiments.core import Figure

TRUE, FUSED, WHEELS, IMU = 'black', 'tab:blue', 'tab:red', 'tab:green'
COLOURS = 128
STYLE = {
    'figure.dpi': 100,
    'axes.grid': True,
    'grid.alpha': 0.3,
    'font.size': 10,
    'legend.fontsize': 9,
    'axes.titlesize': 11,
    'svg.hashsalt': 'sara',
}


@contextmanager
def figure(
    path: Path, rows: int = 1, columns: int = 1, size: tuple[float, float] = (8, 5), **options
) -> Iterator[tuple[Figure, Any]]:
    """(figure, axes) to draw into; saved to `path` at the end."""
    with pyplot.rc_context(STYLE):
        made, axes = pyplot.subplots(rows, columns, figsize=size, layout='constrained', **options)
        yield made, axes
        made.savefig(path, metadata={'Software': None}, bbox_inches='tight')
        pyplot.close(made)
    with Image.open(path) as picture:  # lines on white need few colours: a third of the bytes in the repository
        picture.convert('RGB').quantize(COLOURS).save(path, optimize=True)


def series(axis: Axes, t: np.ndarray, values: np.ndarray, colour: str, label: str, **options) -> None:
    """A line over time."""
    if np.isfinite(values).any():  # what a bag does not hold has no line, and no place in the legend
        axis.plot(t, values, color=colour, label=label, linewidth=options.pop('linewidth', 1.2), **options)
