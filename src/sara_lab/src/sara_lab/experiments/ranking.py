"""Who is better than whom over the same chairs: a ranking by the mean, and which neighbours in it are apart beyond
chance.
"""

from collections.abc import Sequence

import numpy as np

DRAWS = 4000


def ranking(values: dict[str, Sequence[float]]) -> str:
    """The names of {name: one value a chair} in the order of their means, `<` where the mean of the paired differences
    is above zero with 97.5 % of the bootstrap's draws, `~` where it may be chance. Less is better.
    """
    order = sorted(values, key=lambda name: np.mean(values[name]))
    text = f'**{order[0]}**'
    for better, worse in zip(order, order[1:]):
        text += f' {"<" if apart(values[better], values[worse]) else "~"} **{worse}**'
    return text


def apart(better: Sequence[float], worse: Sequence[float]) -> bool:
    """Whether `worse` is larger than `better` on the same chairs, beyond chance (bootstrap of the paired differences, a
    fixed seed).
    """
    difference = np.asarray(worse, float) - np.asarray(better, float)
    draws = np.random.default_rng(2).integers(len(difference), size=(DRAWS, len(difference)))
    return bool(np.percentile(difference[draws].mean(axis=1), 2.5) > 0.0)
