"""How calm drives are in the campaign: figures of their judgements, and the limits that SARA's default planners are
held to.
"""

import math
from collections.abc import Sequence

from sara_lab.campaign.part import Figures, spread

REVERSALS_PER_M = 1.0  # p95
LAST_METRE_S = 15.0  # of any goal; on squares the final turn too
ACCELERATION = 0.315  # m/s2 r.m.s., of any drive


def calm_figures(judgements: Sequence[dict]) -> Figures:
    """How calm drives were, of their judgements as plain data."""
    return {
        'reversals_per_m': spread([found['reversals_per_m'] or 0.0 for found in judgements]),
        'last_metre_s': spread([seconds for found in judgements for seconds in found['last_way']] or [math.nan]),
        'last_metre_and_turn_s': spread(
            [seconds for found in judgements for seconds in found['last_metre']] or [math.nan]
        ),
        'acceleration_rms': spread([found['acceleration_rms'] or 0.0 for found in judgements]),
    }


def calm_faults(figures: Figures, prefix: str, with_final_turn: bool = False) -> list[str]:
    """Sentences about what of that is not calm; `with_final_turn`: that turn is part of the last metre."""
    limits = (
        ('reversals_per_m', 'p95', REVERSALS_PER_M),
        ('last_metre_and_turn_s' if with_final_turn else 'last_metre_s', 'worst', LAST_METRE_S),
        ('acceleration_rms', 'worst', ACCELERATION),
    )
    return [
        f'{prefix}{name} {which} {figures[prefix + name][which]:.3f}, at most {limit:g}'
        for name, which, limit in limits
        if figures[prefix + name][which] > limit
    ]
