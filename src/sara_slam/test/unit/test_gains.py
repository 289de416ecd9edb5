"""What a robot hears where it stands and on the way there: each piece of border counts once."""

import math

import numpy as np
import pytest

from sara_common.planar import Pose2D
from sara_slam.exploring.gains import Gains, Listening

START = Pose2D(1.0, 2.0, 0.5)


def gains(expected=(), rows=10, columns=12, resolution=0.05):
    """Of a map where so much (0 to 1) is expected of cells {(row, column): figure}, nothing of the others."""
    field = np.zeros((rows, columns), np.float32)
    for cell, figure in dict(expected).items():
        field[cell] = figure
    return Gains(field, resolution)


def test_cells_that_lie_together_count_once_and_each_stand_by_itself():
    of = gains({(4, 4): 1.0, (4, 5): 0.5, (0, 9): 0.25, (9, 11): 1.0})
    flat = {cell: 12 * cell[0] + cell[1] for cell in ((4, 4), (4, 5), (0, 9), (9, 11), (0, 0))}
    stands = [
        [flat[4, 4], flat[4, 5], -1],  # 0.15 m, of which most is expected
        [flat[4, 4], flat[4, 4], flat[0, 9]],
        [flat[9, 11], flat[0, 9], flat[4, 4]],  # the last cells of the map, too
        [-1, -1, flat[0, 0]],
    ]
    assert of.of_each(np.array(stands)) == pytest.approx([0.15, 0.1875, 0.3375, 0.0])


def test_on_the_way_what_was_heard_before_counts_no_more():
    of = gains({(0, 0): 1.0, (0, 3): 1.0, (0, 6): 0.5})
    heard = np.array([[-1, -1], [0, 3], [1, 4], [6, 0]])
    assert of.as_it_goes(heard) == pytest.approx([0.0, 0.3, 0.3, 0.375])


def listening(stands, ways=None):
    """On a map of one row of 400 blocks, where a robot hears the block that its x is in: 0.15 m each."""
    stands = np.array(stands, float)
    ways = np.hypot(stands[:, 0] - START.x, stands[:, 1] - START.y) if ways is None else np.array(ways)
    of = Gains(np.ones((3, 1200), np.float32), 0.05)
    return Listening(START, stands, ways, lambda poses: 3 * np.floor(poses[:, :1] / 0.15).astype(int)), of


def test_a_straight_way_hears_what_is_beside_it():
    """At 1.0, 1.25, 1.5, ... m: another block each."""
    ahead, of = listening([(4.0, 2.0, 0.0)])
    (offer,) = ahead.offers([0], of, of, np.array([6.0]))
    assert offer.gain == pytest.approx(0.15 * 13) and offer.rate == pytest.approx(0.15 * 13 / 6.0)
    assert len(offer.cells) == 13 and offer.stand == 0
    assert ahead.at_most(of)[0] == pytest.approx(0.15 * 14)  # the last block is heard from the stand, too
    aside, of = listening([(1.0, 4.0, 0.0)])
    assert aside.offers([0], of, of, np.array([1.0]))[0].gain == pytest.approx(0.15)  # the same block all along


def test_nothing_is_heard_on_a_way_that_is_not_straight_nor_beyond_4_m():
    round_about, of = listening([(4.0, 2.0, 0.0)], [3.6])
    assert round_about.offers([0], of, of, np.array([1.0]))[0].gain == pytest.approx(0.15)
    nearly, of = listening([(4.0, 2.0, 0.0)], [3.5])
    assert nearly.offers([0], of, of, np.array([1.0]))[0].gain == pytest.approx(0.15 * 13)
    far, of = listening([(8.0, 2.0, 0.0)])
    assert far.offers([0], of, of, np.array([1.0]))[0].gain == pytest.approx(0.15 * (17 + 1))


def test_offers_are_sorted_by_what_they_are_worth_a_second_and_are_of_those_that_were_asked_for():
    stands = [(1.0, 2.0, 0.0), (2.0, 2.0, 0.0), (4.0, 2.0, 0.0)]
    found, of = listening(stands)
    offers = found.offers([0, 2], of, of, np.array([0.1, 1.0, 20.0]))
    assert [offer.stand for offer in offers] == [0, 2]
    assert [offer.stand for offer in found.offers(range(3), of, of, np.array([9.0, 1.0, 2.0]))] == [2, 1, 0]
    nothing = Gains(np.zeros((3, 1200), np.float32), 0.05)
    assert found.offers([1], nothing, of, np.ones(3))[0][:2] == pytest.approx((0.0, 0.15 * 5))


def test_a_way_is_listened_to_in_the_direction_in_which_it_leads():
    """Looking along the way: a robot that hears what is ahead of it alone."""
    heard = []

    def ahead(poses):
        heard.append(poses)
        return np.full((len(poses), 1), -1)

    Listening(START, np.array([(1.0, 0.0, 0.0)]), np.array([2.0]), ahead)
    stands, ways = heard
    assert len(stands) == 1
    off = ways[:, :2] - (START.x, START.y)
    there = np.hypot(*off.T) > 0.01
    assert np.allclose(np.arctan2(*off[there].T[::-1]) % (2.0 * math.pi), ways[there, 2])
    assert len(ways) == 32 * 17
