"""What fuzz commands share: how often, from which seed, blocks of inputs with a seed each, and what came of them."""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

BLOCK = 20000


@dataclass
class Report:
    """inputs: a count; kinds: Counter of what was given and of what became of it; faults: what must not happen, one
    sentence each.
    """

    inputs: int = 0
    kinds: Counter = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)

    def attack(
        self,
        rng: np.random.Generator,
        count: int,
        acts: Sequence[tuple[float, Callable[[], object]]],
        wrong: Callable[[], Iterable[str]],
        who: Callable[[], object],
    ) -> None:
        """Do `count` acts, (share, act), at random, until there is a fault: one raises something, or `wrong` yields a
        sentence after it. who: tells at whom.
        """
        shares = [share for share, _ in acts]
        for _ in range(count):
            self.inputs += 1
            act = acts[rng.choice(len(acts), p=shares)][1]
            name = getattr(act, 'func', act).__name__  # of a partial, that of its function
            self.kinds[name.lstrip('_')] += 1
            try:
                with np.errstate(all='ignore'):
                    act()
                self.faults += [f'{name}: {fault} ({who()})' for fault in wrong()]
            except Exception as error:  # whatever is raised is what is looked for
                self.faults.append(f'{name}: {type(error).__name__}: {error} ({who()})')
            if self.faults:
                return

    def check_said(self, said: Sequence[str], kinds: int) -> None:
        """A fault where a sentence was said twice, or there are more than kinds of trouble."""
        twice = [sentence for sentence, n in Counter(said).items() if n > 1]
        if twice or len(said) > kinds:
            self.faults.append(f'said more than once: {twice or said}')


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


def run(
    arguments: Sequence[str] | None, node: str, description: str | None, fuzz: Callable[[int, int], Report]
) -> None:
    """The command `fuzz_<node>`: fuzz(count, seed) by blocks. Ends the program with the seed and a sentence for each
    fault.
    """
    options = options_of(arguments, f'fuzz_{node}', description, 'inputs')
    began, kinds = time.monotonic(), Counter()
    for size, seed in blocks(options, f'inputs to {node}', BLOCK):
        report = fuzz(size, seed)
        if report.faults:
            sys.exit(f'seed {seed}: ' + '\n'.join(report.faults))
        kinds.update(report.kinds)
    seen = ', '.join(f'{what} {often}' for what, often in sorted(kinds.items()))
    print(f'{options.count} inputs to {node}, no failure, {time.monotonic() - began:.1f} s: {seen}')
