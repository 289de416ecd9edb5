"""What a robot has passed."""

import numpy as np
import pytest

from sara_common.planar import Pose2D
from sara_nav.grids.grid import Grid
from sara_slam.exploring.cones import FREE_CELL, UNKNOWN_CELL, WALL_CELL, Cells, strides
from sara_slam.exploring.passed import Passed

CELL = 0.05


def cells(kinds):
    flat = np.zeros(kinds.shape, np.float32)
    return Cells(kinds, flat, flat, strides(kinds), Grid(0.0, 0.0, CELL))


def passed(kinds, places):
    found = Passed()
    found.on_cells(cells(kinds))
    for x, y in places:
        found.at(Pose2D(x, y, 0.0))
    return found


def test_free_cells_in_sight_within_2_4_m_of_the_way_have_been_passed_on_this_map_and_the_next():
    kinds = np.full((40, 200), FREE_CELL, np.uint8)
    kinds[:, 120:] = UNKNOWN_CELL
    kinds[:, 30] = WALL_CELL
    found = passed(kinds, [(2.0, 1.0), (4.0, 1.0)])
    seen = found.free()
    assert seen[20, 31:120].all() and not seen[:, 120:].any() and not seen[:, :30].any()
    assert not passed(kinds, [(2.0, 1.0)]).free()[20, 90]
    kinds[:, 120:] = FREE_CELL
    found.on_cells(cells(kinds))
    assert found.free()[20, 31:127].all() and not found.free()[20, 129:].any()


@pytest.mark.parametrize('beyond', [FREE_CELL, UNKNOWN_CELL])
def test_the_share_that_has_been_passed_falls_with_how_far_a_place_is_from_the_way(beyond):
    """Something may stand where nothing is known, too."""
    kinds = np.full((40, 200), FREE_CELL, np.uint8)
    kinds[:, 70:] = beyond
    found = passed(kinds, [(2.5, 1.0)])
    shares = [found.share_from(x, 1.0) for x in (2.5, 3.0, 4.0, 8.0)]
    assert shares[0] == 1.0 and 0.8 < shares[1] < 0.95 and 0.5 < shares[2] < 0.75 and shares[3] == 0.0
    kinds[:, 60] = WALL_CELL
    assert passed(kinds, [(2.5, 1.0)]).share_from(2.9, 1.0) > 0.97  # a wall hides what is behind


def test_from_when_it_holds_until_it_releases_nothing_more_has_been_passed():
    kinds = np.full((40, 200), FREE_CELL, np.uint8)
    found = passed(kinds, [(2.5, 1.0)])
    found.hold()
    before = found.share_from(4.0, 1.0)
    found.at(Pose2D(4.0, 1.0, 0.0))
    found.hold()
    assert found.share_from(4.0, 1.0) == before < 0.9 and found.free()[20, 120]
    found.on_cells(cells(kinds))
    assert found.share_from(4.0, 1.0) == before
    found.release()
    assert found.share_from(4.0, 1.0) == 1.0
