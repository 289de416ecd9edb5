"""Questions about rows: "school, fused, contacts by seed".

Before `by`, separated by commas: what the drives are asked to be, and which figures are asked for. A word that is a
value of some text column keeps the drives that have it; `column=value` those of that value. The name of a column of
numbers asks for its figures; of one inside another the last name is enough where only one ends so. After `by`: the
columns that drives are grouped by. Words that are values of the same column are alternatives.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

SHOWN_VALUES = 30  # a column with more values than that is not listed by them
OF_FIGURES = ('count', 'sum', 'mean', 'min', 'max')


class QuestionError(ValueError):
    """The question has a word that nothing is called, or there is nothing to ask; the sentence says what there is."""


@dataclass(frozen=True)
class Question:
    """`filters`: (columns, values): a drive has one of the values in one of the columns. `figures`, `by`: columns."""

    filters: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...]
    figures: tuple[str, ...]
    by: tuple[str, ...]


class Drives:
    """The rows of some Parquet files, columns read as they are asked for. Of each part on each platform those of the
    file that comes first, or with `every` all. Raises QuestionError where there is none, or one that cannot be read.
    """

    def __init__(self, paths: Sequence[Path], every: bool = False) -> None:
        self._files = []
        seen = set()
        for path in paths:
            try:
                file = pq.ParquetFile(path)
                which = tuple(file.read_row_group(0, columns=['platform', 'part']).slice(0, 1).to_pylist()[0].values())
            except (OSError, pa.ArrowException) as error:
                raise QuestionError(f'{path} cannot be read: {error}') from error
            if every or which not in seen:
                seen.add(which)
                self._files.append(file)
        if not self._files:
            raise QuestionError('there are no rows yet: `campaign` and `experiment --keep` write them')
        self._kinds: dict[str, set] = {}
        for file in self._files:
            for field in file.schema_arrow:
                self._kinds.setdefault(field.name, set()).add(field.type)
        self._read: dict[str, pa.ChunkedArray] = {}

    @property
    def columns(self) -> list[str]:
        """The names of all columns."""
        return list(self._kinds)

    def is_text(self, name: str) -> bool:
        """Whether a column holds texts."""
        return pa.string() in self._kinds[name]

    def column(self, name: str) -> pa.ChunkedArray:
        """A column of all drives: text, or numbers as double (False, True: 0, 1)."""
        if name not in self._read:
            kind = pa.string() if self.is_text(name) else pa.float64()
            self._read[name] = pa.chunked_array(
                [chunk for file in self._files for chunk in _cast(file, name, kind).chunks], kind
            )
        return self._read[name]

    def values(self) -> dict[str, set[str]]:
        """{text column: its values}"""
        texts = [name for name in self._kinds if self.is_text(name)]
        return {name: set(pc.unique(self.column(name)).drop_null().to_pylist()) for name in texts}


def _cast(file, name, kind):
    if name not in file.schema_arrow.names:
        return pa.chunked_array([pa.nulls(file.metadata.num_rows, kind)])
    found = file.read(columns=[name]).column(0)
    return (found.cast(pa.int8()) if found.type == pa.bool_() else found).cast(kind)


def parsed(text: str, drives: Drives) -> Question:
    """The Question that a text asks. Raises QuestionError."""
    before, *after = re.split(r'\bby\b', text)
    if len(after) > 1:
        raise QuestionError('`by` stands once, before the columns that drives are grouped by')
    by = tuple(_named(word, drives) for word in _words(after[0])) if after else ()
    if after and not by:
        raise QuestionError('no column stands after `by`')
    values, figures, filters = drives.values(), [], []
    for word in _words(before):
        if '=' in word:
            column, value = (part.strip() for part in word.split('=', 1))
            _add(filters, {_named(column, drives)}, value)
        elif (column := _column(word, drives)) is not None:
            if drives.is_text(column):
                raise QuestionError(f'{column} holds texts, no figures: ask for {column}=TEXT, or group by it')
            figures.append(column)
        elif holders := {name for name, held in values.items() if word in held}:
            _add(filters, holders, word)
        else:
            raise QuestionError(_unknown(word, drives, values))
    found = tuple((tuple(sorted(columns)), tuple(words)) for columns, words in filters)
    return Question(found, tuple(dict.fromkeys(figures)), by)


def _add(filters, columns, word):
    """A further filter; words that have a column in common are alternatives."""
    alternatives = [one for one in filters if one[0] & columns]
    for one in alternatives:
        filters.remove(one)
    filters.append(
        (columns.union(*(one[0] for one in alternatives)), [w for one in alternatives for w in one[1]] + [word])
    )


def _words(text):
    return [word.strip() for word in text.split(',') if word.strip()]


def _column(word, drives):
    """The column of that name, or the only one that ends so; None where there is none. Raises QuestionError."""
    if word in drives.columns:
        return word
    ends = [name for name in drives.columns if name.endswith(f'.{word}')]
    if len(ends) > 1:
        raise QuestionError(f'{word} may be {", ".join(ends)}; write one of them')
    return ends[0] if ends else None


def _named(word, drives):
    column = _column(word, drives)
    if column is None:
        raise QuestionError(_unknown(word, drives, {}))
    return column


def _unknown(word, drives, values):
    """What there is instead of a word, the nearest first."""
    all_of = {*drives.columns, *(value for held in values.values() for value in held)}
    near = difflib.get_close_matches(word, sorted(all_of), 3)
    lines = [f'nothing is called {word!r}' + (f'; did you mean {" or ".join(near)}?' if near else '.')]
    lines += [
        f'{name}: {", ".join(sorted(held))}' for name, held in sorted(values.items()) if len(held) <= SHOWN_VALUES
    ]
    lines.append(f'columns: {", ".join(sorted(drives.columns))}')
    return '\n'.join(lines)


def answer(question: Question, drives: Drives) -> pa.Table:
    """The groups' table, ordered by `by`: those columns, `drives` (how many), and for each figure its `count` (of the
    drives that have it), `sum`, `mean`, `min` and `max`, as FIGURE_OF. Without `by` one line for all.
    """
    names = dict.fromkeys((*question.by, *question.figures))
    table = pa.table({'drives': drives.column('part'), **{name: drives.column(name) for name in names}})
    if question.filters:
        table = table.filter(reduce(pc.and_, [_kept(drives, *one) for one in question.filters]))
    asked = [('drives', 'count'), *((name, of) for name in question.figures for of in OF_FIGURES)]
    found = table.group_by(list(question.by)).aggregate(asked)
    ordered = ['drives_count', *(f'{name}_{of}' for name in question.figures for of in OF_FIGURES)]
    found = found.select([*question.by, *ordered])
    found = found.rename_columns([*question.by, 'drives', *ordered[1:]])
    return found.sort_by([(name, 'ascending') for name in question.by]) if question.by else found


def _kept(drives, columns, words):
    """Which drives have one of the words in one of the columns."""
    return reduce(pc.or_, [_has(drives.column(name), words) for name in columns])


def _has(column, words):
    """Which entries are one of the words, as texts or as numbers; null is none."""
    if column.type == pa.string():
        wanted = pa.array(words)
    else:
        try:
            wanted = pa.array([float(word) for word in words])
        except ValueError:
            raise QuestionError(f'{", ".join(words)}: the column holds numbers') from None
    return pc.is_in(column, wanted)


def origins(question: Question, drives: Drives) -> list[Mapping[str, object]]:
    """Where the drives come from that a Question is about: {part, platform, sources, commit, drives} each."""
    about = ('part', 'platform', 'sources', 'commit')
    found = answer(Question(question.filters, (), about), drives)
    return found.to_pylist()
