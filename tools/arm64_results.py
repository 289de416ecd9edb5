"""Results of tools/arm64.py: which are fresh, how many tests passed, how two machines' numbers differ; as tables."""

from __future__ import annotations

import hashlib
import json
import os
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import count_tests
import deb_control

TOLERANCE = 1e-6  # between two machines' numbers
TOOLS = (
    'tools/hide_ros.py',
    'tools/steady.py',
    'tools/apt-packages.txt',
    'tools/python-packages.txt',
    'tools/python-packages-alone.txt',
)
BEGIN, END = '<!-- written by make arm64 -->', '<!-- end of what make arm64 writes -->'


def unit_files(root: Path) -> dict[str, list[str]]:
    """{package: its files of unit tests}, the fewest first; `tools` among them."""
    found: dict[str, list[str]] = {}
    for path in sorted([*root.glob('src/*/test/unit/**/test_*.py'), *root.glob('src/*/test/browser/test_*.py')]):
        found.setdefault(path.relative_to(root).parts[1], []).append(str(path.relative_to(root)))
    found['tools'] = [str(path.relative_to(root)) for path in sorted(root.glob('tools/test/test_*.py'))]
    return dict(sorted(found.items(), key=lambda item: (len(item[1]), item[0])))


def keys(root: Path, files: list[str]) -> dict[str, str]:
    """{package: a number of all files that its tests' results depend on}: its own, those of the packages that it needs,
    the plugins of pytest and the lists of Debian's and PyPI's packages. `files`: of the working tree, from `root`.
    """
    digests: dict[str, bytes] = {}
    for name in sorted(files):
        folder = '/'.join(Path(name).parts[:2]) if name.startswith('src/') else name
        path = root / name
        content = os.readlink(path).encode() if path.is_symlink() else path.read_bytes()
        digests[folder] = hashlib.sha256(digests.get(folder, b'') + name.encode() + content).digest()
    needs = {package.name: package.needs for package in deb_control.read_packages(root / 'src')}
    found = {}
    for package in needs:
        names, waiting = {package}, [package]
        while waiting:
            new = {need for need in needs[waiting.pop()] if need in needs} - names
            names |= new
            waiting += new
        parts = [*TOOLS, *(f'src/{name}' for name in sorted(names))]
        found[package] = hashlib.sha256(b''.join(digests[part] for part in parts)).hexdigest()
    found['tools'] = hashlib.sha256(b''.join(digests.values())).hexdigest()
    return found


@dataclass
class Count:
    """Tests of one package. `failed`: {test: first line of why}; `waiting`: files without a fresh result."""

    passed: int = 0
    skipped: int = 0
    failed: dict[str, str] = field(default_factory=dict)
    waiting: list[str] = field(default_factory=list)
    seconds: float = 0.0

    def add(self, result: Path) -> None:
        """Take in the result of one file: JSON as arm64.py writes it, with the JUnit file beside it if there is one."""
        told = json.loads(result.read_text(encoding='utf-8'))
        self.seconds += told['seconds']
        junit = result.with_suffix('.xml')
        if not junit.exists():
            self.failed[told['file']] = told['end']
            return
        for name, outcome, why in count_tests.cases(junit):
            if outcome == 'failed':
                self.failed[name] = why
            else:
                setattr(self, outcome, getattr(self, outcome) + 1)


def differences(ours: object, theirs: object, place: str = '') -> Iterator[tuple[str, object, object, float]]:
    """Yield (place, ours, theirs, how far apart) of each leaf of two JSON values; inf where they are no numbers and
    not equal, or where one has no such leaf.
    """
    if isinstance(ours, dict) and isinstance(theirs, dict):
        for name in sorted({*ours, *theirs}):
            yield from differences(ours.get(name), theirs.get(name), f'{place}/{name}')
    elif isinstance(ours, list) and isinstance(theirs, list) and len(ours) == len(theirs):
        for number, (one, other) in enumerate(zip(ours, theirs)):
            yield from differences(one, other, f'{place}/{number}')
    else:
        numbers = all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in (ours, theirs))
        yield place, ours, theirs, abs(ours - theirs) if numbers else 0.0 if ours == theirs else float('inf')


def units_table(counts: dict[str, Count]) -> list[str]:
    """Lines of Markdown: a row for each package, then what failed."""
    lines = ['| package | passed | failed | skipped | files not run | minutes |', '|---|---|---|---|---|---|']
    for name, count in counts.items():
        numbers = (count.passed, len(count.failed), count.skipped, len(count.waiting), f'{count.seconds / 60:.0f}')
        lines.append(f'| {" | ".join([name, *map(str, numbers)])} |')
    total = [sum(count.passed for count in counts.values()), sum(len(count.failed) for count in counts.values())]
    total += [sum(count.skipped for count in counts.values()), sum(len(count.waiting) for count in counts.values())]
    minutes = sum(count.seconds for count in counts.values()) / 60
    lines.append(f'| all | {" | ".join(map(str, total))} | {minutes:.0f} |')
    return [*lines, '', *_failures({name: why for count in counts.values() for name, why in count.failed.items()})]


def _failures(failed):
    """Lines of Markdown: what failed, and why; tests of one file that failed for the same reason together."""
    alike: dict[tuple[str, str], list[str]] = {}
    for name, why in failed.items():
        file = name.partition('[')[0].rpartition('.')[0]
        alike.setdefault((file, textwrap.shorten(why, 110)), []).append(name)
    for (file, why), names in alike.items():
        yield f'- `{names[0]}` failed:' if len(names) == 1 else f'- {len(names)} tests of `{file}` failed:'
        yield f'  {why}'


def square_lines(ours: object, theirs: object) -> list[str]:
    """Lines of Markdown: whether two squares are equal, and where not."""
    leaves = list(differences(ours, theirs))
    apart = [leaf for leaf in leaves if leaf[3] > TOLERANCE]
    most = max(leaf[3] for leaf in leaves)
    lines = [f'{len(leaves)} values, {len(apart)} of them more than {TOLERANCE:g} apart; at most {most:.3g}.']
    if apart:
        lines += ['', '| value | arm64 | amd64 | apart |', '|---|---|---|---|']
        lines += [f'| {place} | {one} | {other} | {far:.3g} |' for place, one, other, far in apart]
    return lines


def write_page(page: str, parts: dict[str, list[str]]) -> str:
    """The page with the lines of the parts, under their headings, between its two marks. Raises ValueError without."""
    before, found, rest = page.partition(BEGIN)
    _, ended, after = rest.partition(END)
    if not found or not ended:
        raise ValueError(f'the page lacks {BEGIN} or {END}')
    text = '\n'.join(line for heading, lines in parts.items() for line in ('', f'## {heading}', *lines))
    return f'{before}{BEGIN}\n{text.strip()}\n\n{END}{after}'
