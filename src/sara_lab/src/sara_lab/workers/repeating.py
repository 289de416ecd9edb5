"""Work of which some may be lost on the way is done again until all is done."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TypeVar

Item, Result = TypeVar('Item'), TypeVar('Result')


def until_done(
    items: Sequence[Item],
    attempt: Callable[[dict[int, Item]], Iterable[tuple[int, Result]]],
    lost: Callable[[Mapping[int, Item], int], None],
) -> Iterator[tuple[Item, Result]]:
    """Yield (item, result) of every item once. `attempt`: given {index: item} of what is left, yields (index, result)
    of what it does before the rest is lost. `lost`: called with what is left then, and how many attempts in a row did
    nothing; it raises where these are enough.
    """
    left, in_vain = dict(enumerate(items)), 0
    while left:
        done = False
        for index, result in attempt(dict(left)):
            done = True
            yield left.pop(index), result
        if left:
            in_vain = 0 if done else in_vain + 1
            lost(left, in_vain)
