"""The scale of the dead reckoning's turns, kept in a file from one drive to the next."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import yaml

from sara_common.config import is_number
from sara_common.files import write_whole

MOST = 0.1
"""By which turns may be longer or shorter than the dead reckoning's."""
TRUST = 0.5
"""Share of turn_scale_sigma by which a kept scale is uncertain at least: the gyro may have been calibrated since."""
HEAD = (
    '# Turns of the robot over those of the dead reckoning, learned by range_localization; sigma: standard deviation.\n'
)


class TurnScale(NamedTuple):
    """Turns of the robot over those of the dead reckoning, and the standard deviation of that."""

    scale: float
    sigma: float


def load(path: str | Path, sigma: float) -> TurnScale | None:
    """What the file holds, as uncertain as TRUST says; None where there is no file, or it knows no more than `sigma`, a
    scale's standard deviation without it. Raises ValueError with a sentence where the file is damaged.
    """
    try:
        content = yaml.safe_load(Path(path).read_text(encoding='utf-8'))
    except FileNotFoundError:
        return None
    except (OSError, ValueError, yaml.YAMLError, RecursionError) as error:
        raise ValueError(f'{path} cannot be read: {" ".join(str(error).split())}') from error
    values = content if isinstance(content, dict) else {}
    scale, kept = values.get('turn_scale'), values.get('sigma')
    if not (is_number(scale) and abs(scale - 1.0) <= MOST and is_number(kept) and kept > 0.0):
        raise ValueError(f'{path} holds no turn_scale within {MOST:g} of 1 with a sigma above 0')
    return TurnScale(float(scale), max(float(kept), TRUST * sigma)) if kept < sigma else None


def save(path: str | Path, learned: TurnScale) -> None:
    """Write the file anew, at once or not at all. Raises OSError."""
    write_whole(path, f'{HEAD}turn_scale: {learned.scale:.6f}\nsigma: {learned.sigma:.6f}\n', 0o600)
