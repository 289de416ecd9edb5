"""What came of journeys driven through the touch screen's page, a line of JSON each, and which are yet to be driven."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass

NEAR_ENOUGH = 0.5  # m from the place, to have arrived


@dataclass(frozen=True)
class TouchJourney:
    """`by`: the input. `off`: m from the place at the end; `gap`: m at least to what stands about; `way`: m; `seconds`:
    of simulated time, from the first motion until rest. `fault`: what went wrong on the page, or "". By the true pose.
    """

    by: str
    number: int
    start: str
    goal: str
    off: float
    contacts: int
    gap: float
    way: float
    seconds: float
    fault: str = ''

    @property
    def arrived(self) -> bool:
        """Whether it ended at the place, and the page said nothing else."""
        return not self.fault and self.off <= NEAR_ENOUGH

    def line(self) -> str:
        """As JSON."""
        return json.dumps({**asdict(self), 'arrived': self.arrived})

    def __str__(self):
        end = 'arrived' if self.arrived else f'FAILED ({self.fault or "elsewhere"})'
        return (
            f'{self.by} {self.number}: {self.start} to {self.goal} {end}, {self.off:.2f} m off, {self.way:.1f} m in '
            f'{self.seconds:.0f} s, gap {self.gap:.2f} m, {self.contacts} contacts'
        )


def journeys_of(text: str) -> list[TouchJourney]:
    """Journeys of a file's text; a last line that was not written to its end is left out. Raises ValueError."""
    whole, made = text.rpartition('\n')[0], []
    for number, line in enumerate(whole.splitlines(), 1):
        try:
            fields = json.loads(line)
            fields.pop('arrived', None)
            made.append(TouchJourney(**fields))
        except (ValueError, TypeError, AttributeError) as error:
            raise ValueError(f'line {number} is no journey: {error}') from error
    return made


def missing(made: Iterable[TouchJourney], inputs: Sequence[str], count: int) -> list[tuple[str, int]]:
    """(input, number) of those that are still to be driven, in order."""
    there = {(one.by, one.number) for one in made}
    return [(by, number) for by in inputs for number in range(1, count + 1) if (by, number) not in there]


def summary(made: Sequence[TouchJourney]) -> str:
    """All journeys by one input in a line."""
    return (
        f'{made[0].by}: {sum(one.arrived for one in made)} of {len(made)} arrived, '
        f'{sum(one.contacts for one in made)} contacts, '
        f'{max(one.off for one in made):.2f} m off at most, gap {min(one.gap for one in made):.2f} m at least, '
        f'{sum(one.way for one in made):.0f} m in {sum(one.seconds for one in made):.0f} s'
    )
