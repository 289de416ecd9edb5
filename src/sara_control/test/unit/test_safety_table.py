"""docs/safety.md against the tests: what it names is there, and every hazard of its table names a test."""

import re
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
DOCUMENT = Path(__file__).resolve().parents[4] / 'docs' / 'safety.md'
FILES = {
    'U': 'unit/test_guard.py',
    'S': 'unit/test_safety.py',
    'P': 'unit/test_plausibility.py',
    'M': 'unit/test_mux.py',
    'Z': 'unit/test_zones.py',
    'R': 'ros/safety_test.py',
    'N': '../../sara_nav/test/unit/test_lost.py',
}


@pytest.fixture(name='rows')
def read_rows():
    if not DOCUMENT.exists():
        pytest.skip('docs/safety.md is not here: the package stands alone')
    rows = [line.strip('| ').split(' | ') for line in DOCUMENT.read_text().splitlines() if line.startswith('| ')]
    rows = [row for row in rows if row[0] != 'hazard']
    assert len(rows) > 12
    return rows


def test_every_hazard_names_a_test_that_exists(rows):
    for row in rows:
        letters = re.findall(r'\b([USPMZRN])\b', row[-1])
        assert letters, row[0]
        for letter, name in re.findall(r'\b([USPMZRN]) `([^`]+)`', row[-1]):
            source = (TESTS / FILES[letter]).read_text()
            bracket = re.search(r'\[(\w+)\]', name)
            if bracket:
                assert f"'{bracket.group(1)}'" in source, name
            function = name.split('[')[0].rstrip('*')
            assert re.search(rf'def test_\w*{function}', source) or not function, name


def test_the_times_allowed_are_those_that_are_tested(rows):
    source = (TESTS / FILES['U']).read_text()
    for row in rows:
        name = re.search(r'\[(\w+)\]', row[-1])
        if name:
            allowed = float(re.search(rf"'{name.group(1)}': ([0-9.]+)", source).group(1))
            assert float(row[2]) == allowed, row[0]
            assert 0.0 < float(row[3].split(',')[0]) <= allowed + 0.8 / 1.5 + 0.25
