"""Adds up the JUnit files below a folder, names what failed, and ends with the line 'N passed, N failed, N skipped'."""

import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

OUTCOMES = {'failure': 'failed', 'error': 'failed', 'skipped': 'skipped'}  # a case without one of these tags has passed


def cases(path):
    """Yield (test's name, 'passed', 'failed' or 'skipped', first line of why) of a JUnit file. Raises ParseError."""
    for case in ElementTree.parse(path).getroot().iter('testcase'):
        found = [(outcome, case.find(tag)) for tag, outcome in OUTCOMES.items() if case.find(tag) is not None]
        outcome, why = found[0] if found else ('passed', None)
        message = '' if why is None else (why.get('message') or why.text or '').strip()
        yield f'{case.get("classname")}.{case.get("name")}', outcome, message.partition('\n')[0]


def main(folder):
    """Print the count of `folder`; return 1 if anything failed or nothing ran."""
    count = dict.fromkeys(('passed', 'failed', 'skipped'), 0)
    for path in sorted(Path(folder).rglob('*.xml')):
        try:
            found = list(cases(path))
        except ElementTree.ParseError as error:
            found = [(path, 'failed', f'not a JUnit file: {error}')]
        for name, outcome, why in found:
            count[outcome] += 1
            if outcome == 'failed':
                print(f'FAILED {name}: {why} ({path})')
            elif outcome == 'skipped':
                print(f'skipped {name}: {why}')
    passed, failed, skipped = count.values()
    print(f'{passed} passed, {failed} failed, {skipped} skipped')
    return 1 if failed or not passed else 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1]))
