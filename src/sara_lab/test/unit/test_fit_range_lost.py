"""Drives with a misplaced pose: what is judged of them, the fit on counts drawn from a law, and the table."""

import numpy as np
import pytest

from sara_lab.studies import wandering
from sara_lab.studies.fit_range_lost import doubted, fitted, noticed, table, windows
from sara_lab.studies.misplaced import KINDS, Case, Step, cases, steps
from sara_localization.particles.lost import Agreement
from sara_localization.particles.range_lost import LAW, STEPS

FOUND, LOST = (8.0, 0.2, 0.5, 0.3), (1.0, 2.0, 2.0, 3.0)


def drive(wrongs, probabilities=None, counts=(3, 0, 1, 0)):
    probabilities = probabilities or [0.0] * len(wrongs)
    return [Step(0.2 * k, wrong, Agreement(*counts), p) for k, (wrong, p) in enumerate(zip(wrongs, probabilities))]


def test_windows_are_of_poses_that_are_all_right_or_all_wrong():
    mixed = drive([False] * (2 * STEPS) + [True] * (2 * STEPS))
    right, wrong = windows(mixed, False), windows(mixed, True)
    assert right and wrong and set(right) == set(wrong) == {(3 * STEPS, 0, STEPS, 0)}
    assert windows(drive([False, True] * STEPS), True) == []


def test_the_fit_comes_near_the_distributions_that_counts_were_drawn_from():
    random, drives = np.random.default_rng(0), []
    for wrong, alphas in ((False, FOUND), (True, LOST)):
        for _ in range(400):
            counts = random.multinomial(20, random.dirichlet(alphas)).tolist()
            drives.append(drive([wrong] * STEPS, counts=[0, 0, 0, 0])[:-1] + drive([wrong], counts=counts))
    law = fitted(drives)
    for found, true in ((law.found, FOUND), (law.lost, LOST)):
        assert np.array(found) / sum(found) == pytest.approx(np.array(true) / sum(true), abs=0.03)
        assert sum(found) == pytest.approx(sum(true), rel=0.3)
    assert law.prior == LAW.prior


def test_what_is_noticed_and_what_is_doubted():
    late = drive([False] * 4 + [True] * 6, [0.1] * 7 + [0.6] * 3)
    assert noticed(late) == pytest.approx(0.6) and not doubted(late)
    assert noticed(drive([True] * 3)) is None
    assert doubted(drive([False] * 8, [0.1] * 6 + [0.5] * 2))
    assert not doubted(drive([True] + [False] * 4, [0.9] * 5))  # the window still holds the wrong pose
    lines = table([(Case('flat', 0, '', 'far'), late), (Case('flat', 1, '', 'right'), drive([False] * 8, [0.7] * 8))])
    assert lines[2] == '| 1 right | 1 | 0 | 0 |  |' and '| 1 far | 0 | 1 | 1 | 0.6 / 0.6 |' in lines


def test_a_drive_with_its_pose_put_elsewhere(tmp_path, monkeypatch):
    monkeypatch.setattr(wandering, 'WAY', 6.0)
    monkeypatch.setattr('sara_lab.studies.misplaced.PUT', (1.0, 2.0))
    found = {kind: steps(Case('flat', 2, '', kind), tmp_path) for kind in KINDS}
    assert not any(step.wrong for step in found['right']) and not doubted(found['right'])
    assert any(step.wrong for step in found['far']) and not found['far'][0].wrong
    assert max(step.probability for step in found['far']) > max(step.probability for step in found['right'])
    assert [step.agreement for step in found['changed']] != [step.agreement for step in found['right']]
    assert steps(Case('flat', 2, '', 'far'), tmp_path) == found['far']
    assert len(list(tmp_path.iterdir())) == 1


def test_cases_are_of_all_maps_surroundings_and_kinds():
    assert len(cases(range(2))) == 2 * 3 * len(wandering.ABOUT) * len(KINDS)
