"""How soon what a finger does is what a robot is told."""

from __future__ import annotations

import math
from collections.abc import Sequence

Series = Sequence[tuple[float, float]]  # (s, m/s), in order


def delays(events: Series, published: Series) -> list[float]:
    """s from each event, which asks for a speed, to the first command that is of it or of a newer one; infinite where
    none came.
    """
    asked: dict[float, list[int]] = {}
    for number, (_, speed) in enumerate(events):
        asked.setdefault(round(speed, 9), []).append(number)
    answers = []
    for t, speed in published:
        before = [number for number in asked.get(round(speed, 9), ()) if events[number][0] <= t]
        if before:
            answers.append((t, before[-1]))
    return [
        min((t for t, newest in answers if newest >= number), default=math.inf) - began
        for number, (began, _) in enumerate(events)
    ]
