"""Messages of a bag that may be damaged: rosbag believes what its index says, and raises whatever comes of that."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

import rosbag


@contextmanager
def damage_told(what: str) -> Iterator[None]:
    """Within, whatever goes wrong is that `what` is damaged. Raises ROSBagException."""
    try:
        yield
    except rosbag.ROSBagException:
        raise
    except Exception as error:  # pylint: disable=broad-except
        raise rosbag.ROSBagException(f'{what} is damaged: {type(error).__name__}: {error}') from error


def messages(bag: rosbag.Bag, topics: Iterable[str] | None = None, raw: bool = False) -> Iterator[tuple]:
    """What `bag.read_messages` gives. Raises ROSBagException where the bag is damaged."""
    with damage_told(bag.filename):
        yield from bag.read_messages(topics=topics, raw=raw)
