"""The gain k: exact data give it exactly, table 4.11 gives 1.08, an outlier is named."""

import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canserial.calibration.gain import GainError, GainProcedure


def procedure_with(pairs, **settings):
    procedure = GainProcedure([true for true, _ in pairs], **settings)
    for true, measured in pairs:
        procedure.add(true, measured)
    assert procedure.next_angle is None
    return procedure


@given(st.floats(0.6, 1.9), st.lists(st.floats(10.0, 720.0) | st.floats(-720.0, -10.0), min_size=2, max_size=12))
def test_without_noise_the_gain_is_exact_and_nothing_is_left(gain, angles):
    result = procedure_with([(angle, angle / gain) for angle in angles]).result()
    assert result.gain == pytest.approx(gain)
    assert result.error == pytest.approx(0.0, abs=1e-6)
    assert result.worst == pytest.approx(0.0, abs=1e-6)


def test_table_4_11():
    result = procedure_with([(90, 82), (180, 167), (270, 250), (360, 332.5)]).result()
    assert result.gain == pytest.approx(1.08, abs=0.005)
    assert result.error == pytest.approx(0.002, abs=0.001)
    assert result.worst < 1.5
    assert result.rows[3][2] == pytest.approx(360.0, abs=1.0)
    table = result.table()
    assert table[-1] == 'k = 1.0817 +- 0.0020'
    assert '360.0    332.50   359.67   +0.33' in table[4]


def test_the_residuals_are_orthogonal_to_what_was_measured():
    chance = random.Random(5)
    result = procedure_with(
        [(angle, angle / 1.08 + chance.gauss(0, 1)) for angle in (90, 180, 270, 360, -90, -180)]
    ).result()
    assert sum(left * measured for left, (_, measured, _) in zip(result.residuals, result.rows)) == pytest.approx(
        0.0, abs=1e-6
    )


def test_the_standard_error_is_honest():
    """Over many procedures the gains scatter as the error says."""
    chance = random.Random(6)
    gains, errors = [], []
    for _ in range(400):
        result = procedure_with(
            [(a, a / 1.08 + chance.gauss(0, 1)) for a in (90, 180, 270, 360, -90, -180, -270, -360)]
        ).result()
        gains.append(result.gain)
        errors.append(result.error)
    mean = sum(gains) / len(gains)
    scatter = math.sqrt(sum((g - mean) ** 2 for g in gains) / len(gains))
    assert scatter == pytest.approx(sum(errors) / len(errors), rel=0.12)


def test_both_ways_cancel_an_offset_error():
    drift = [(true, true / 1.08 + 0.05 * 10 * k) for k, true in enumerate((90, 180, 270, 360), 1)]
    back = [(-true, -true / 1.08 + 0.05 * 10 * k) for k, true in enumerate((90, 180, 270, 360), 1)]
    assert abs(procedure_with(drift).result().gain - 1.08) > 0.005
    assert procedure_with(drift + back).result().gain == pytest.approx(1.08, abs=1e-4)


def test_a_misread_angle_is_named():
    with pytest.raises(GainError, match=r'the turn of 270 deg \(measured 230.0.*off the line, allowed is 5: repeat'):
        procedure_with([(90, 82), (180, 167), (270, 230), (360, 332.5)]).result()


@pytest.mark.parametrize(
    'true, measured', [(90, -82), (90, 0.0), (90, 200), (90, 30), (math.nan, 82), (90, math.inf), (5, 5)]
)
def test_pairs_that_no_scale_error_explains_are_refused_and_not_kept(true, measured):
    procedure = GainProcedure()
    with pytest.raises(GainError):
        procedure.add(true, measured)
    assert procedure.next_angle == 90.0


def test_too_few_turns_and_bad_angles():
    procedure = GainProcedure()
    procedure.add(90, 82)
    with pytest.raises(GainError, match='1 turns give no gain'):
        procedure.result()
    for angles in ((), (90,), (90, 0), (90, math.nan)):
        with pytest.raises(GainError, match='angles'):
            GainProcedure(angles)


def test_the_default_is_the_table_both_ways():
    assert GainProcedure().angles == (90, 180, 270, 360, -90, -180, -270, -360)
