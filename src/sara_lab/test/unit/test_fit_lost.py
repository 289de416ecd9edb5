"""The fit of the probability of being lost, on drives drawn from a law; what is recorded; how calibration is drawn."""

import json

import numpy as np
import pytest

from sara_lab.journeys.travel_cases import MAPS
from sara_lab.studies import draw_lost, fit_lost
from sara_lab.studies.carried import GROUPS, KEEPS_HEADING, Step
from sara_localization.particles.lost import LAW, Agreement, Evidence, LostLaw

TRUE = LostLaw((20.0, 0.6, 1.5, 0.1), (5.0, 1.0, 1.0, 4.0), 0.02, 0.1, 0.9, 0.2, 0.8)
WRONG = TRUE._replace(found=(5.0, 1.0, 1.0, 2.0), loses=0.2)


def drawn(law, seed, steps=60):
    """A drive whose poses become wrong and right, and whose readings agree, as a law has it."""
    rng, wrong, moments = np.random.default_rng(seed), False, []
    for _ in range(steps):
        wrong = bool(rng.random() < (1.0 - law.finds if wrong else law.loses))
        counts = rng.multinomial(30, rng.dirichlet(law.lost if wrong else law.found)).tolist()
        moments.append((Evidence(Agreement(*counts), 0.0, True), wrong))
    return moments


DRIVES = [drawn(TRUE, seed) for seed in range(8)]


def test_numbers_without_bounds_are_the_law_again():
    for law in (LAW, TRUE):
        back = fit_lost.unpacked(fit_lost.packed(law))
        assert np.concatenate([np.ravel(part) for part in back]) == pytest.approx(
            np.concatenate([np.ravel(part) for part in law])
        )
    assert fit_lost.rounded(TRUE._replace(loses=0.0123456)).loses == 0.0123


def test_the_law_that_drives_were_drawn_from_is_likelier_and_the_fit_comes_near_it():
    found = fit_lost.fitted(DRIVES, WRONG, iterations=8)
    true, wrong, fit = (fit_lost.loss(DRIVES, law) for law in (TRUE, WRONG, found))
    assert true < wrong and fit < true + 0.3 * (wrong - true)
    others = [drawn(TRUE, seed) for seed in range(100, 110)]
    assert fit_lost.loss(others, found) < fit_lost.loss(others, WRONG)
    assert fit_lost.calibration(others, TRUE) < 0.05


def test_a_drive_is_recorded_once_and_read_back(tmp_path, monkeypatch):
    step = Step(1.0, 0.0, 3.0, 0.0, 0.7, Evidence(Agreement(20, 1, 2, 7), 0.25, True))
    driven = []
    monkeypatch.setattr(fit_lost, 'drive', lambda case: driven.append(case) or [step._replace(evidence=None), step])
    first = fit_lost.recorded_drives([1000, 1001], tmp_path)
    assert len(set(driven)) == len(driven) == len(first) == 2 * 2 * len(KEEPS_HEADING) * len(MAPS)
    assert first[0] == [(step.evidence, True)]
    assert fit_lost.recorded_drives([1000, 1001], tmp_path) == first and len(driven) == len(first)


@pytest.mark.parametrize('words', [['--seeds', '0'], ['--held-out', '-1']])
def test_no_drives_are_refused(words, capsys):
    with pytest.raises(SystemExit):
        fit_lost.main(words)
    assert 'whole numbers of 1 or more' in capsys.readouterr().err


def kept(folder, moments):
    """The files of a campaign in which each drive had these moments."""
    for number, ((heading, people), name) in enumerate([(group, name) for group in GROUPS for name in MAPS]):
        result = {'heading': heading, 'people': people, 'map': name, 'moments': moments}
        (folder / f'kidnapped_{number}.json').write_text(json.dumps(result))


def test_the_calibration_of_a_campaign_is_drawn(tmp_path, capsys):
    kept(tmp_path, [[0.05, False]] * 900 + [[0.95, True]] * 50 + [[0.95, False]] * 50)
    draw_lost.main(['--results', str(tmp_path), '--out', str(tmp_path / 'images')])
    told = capsys.readouterr().out
    assert '| gyro, among pedestrians | 0.090 | 0.090 | 0.090 | 0.090 |' in told
    assert f'{len(GROUPS) * len(MAPS)} drives, 9000 moments: calibration error 0.090' in told
    assert (tmp_path / 'images' / 'lost_reliability.png').stat().st_size > 5000


def test_too_few_moments_draw_nothing(tmp_path):
    kept(tmp_path, [[0.05, False]])
    with pytest.raises(SystemExit, match='holds 9 moments, at least 5000 are needed'):
        draw_lost.main(['--results', str(tmp_path), '--out', str(tmp_path)])
