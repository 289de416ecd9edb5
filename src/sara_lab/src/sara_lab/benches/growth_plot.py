"""The figure of growth: time over size, one panel for each family."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from sara_lab.benches.growth import FAMILIES, exponent, series

if TYPE_CHECKING:
    from sara_lab.benches.timed import Row


def draw(rows: Iterable[Row], path: Path) -> None:
    """Write a PNG of the rows' families; returns whether there was anything to draw."""
    import matplotlib

    matplotlib.use('Agg')
    import matplotlib.pyplot as plt

    found = {
        family: lines for family, lines in series(rows).items() if any(len(points) > 1 for points in lines.values())
    }
    if not found:
        return False
    figure, axes = plt.subplots(1, len(found), figsize=(4.6 * len(found), 3.9), squeeze=False)
    for axis, (family, lines) in zip(axes[0], found.items()):
        for name, points in lines.items():
            points = sorted(points)
            if len(points) > 1:
                label = name.removeprefix(family).removeprefix(' by ').lstrip(': ') or name
                axis.loglog(*zip(*points), marker='o', label=f'{label}: n^{exponent(points):.2f}')
        axis.set_xlabel(FAMILIES[family])
        axis.set_ylabel("ms at the peers' speed")
        axis.set_title(family)
        axis.grid(True, which='both', alpha=0.3)
        axis.legend(fontsize=8)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110, metadata={'Software': None})
    plt.close(figure)
    return True
