"""What the fuzz commands share: how often and from which seed, and the inputs in blocks that each have a seed."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence


def options_of(
    arguments: Sequence[str] | None, prog: str, description: str | None, inputs: str = 'inputs of each kind'
) -> argparse.Namespace:
    """--count and --seed; inputs: what is counted. Ends the program where they are faulty."""
    parser = argparse.ArgumentParser(prog=prog, description=description)
    parser.add_argument('--count', type=int, default=20000, help=f'{inputs} (default: %(default)s)')
    parser.add_argument('--seed', type=int, default=0)
    options = parser.parse_args(arguments)
    if options.count < 1:
        parser.error(f'--count is {options.count}, allowed are whole numbers above 0')
    return options


def blocks(options: argparse.Namespace, title: str, most: int) -> Iterator[tuple[int, int]]:
    """(how many inputs, seed) of each block of at most so many, with a progress bar."""
    from tqdm import tqdm

    with tqdm(total=options.count, desc=title, delay=1.0, disable=None) as progress:
        for number, first in enumerate(range(0, options.count, most)):
            size = min(most, options.count - first)
            yield size, options.seed * 1000000 + number
            progress.update(size)
