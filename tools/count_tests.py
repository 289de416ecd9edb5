"""Adds up the JUnit files below a folder, names what failed, and ends with the line 'N passed, N failed, N skipped'."""

import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path


def main(folder):
    """Print the count of `folder`; return 1 if anything failed or nothing ran."""
    passed, failed, skipped = 0, 0, 0
    for path in sorted(Path(folder).rglob('*.xml')):
        try:
            cases = list(ElementTree.parse(path).getroot().iter('testcase'))
        except ElementTree.ParseError as error:
            print(f'FAILED {path}: not a JUnit file: {error}')
            failed += 1
            continue
        for case in cases:
            name = f'{case.get("classname")}.{case.get("name")}'
            problem = case.find('failure') if case.find('failure') is not None else case.find('error')
            if problem is not None:
                failed += 1
                print(
                    f'FAILED {name}: {(problem.get("message") or problem.text or "").strip().splitlines()[:1]} ({path})'
                )
            elif case.find('skipped') is not None:
                skipped += 1
                print(f'skipped {name}: {case.find("skipped").get("message")}')
            else:
                passed += 1
    print(f'{passed} passed, {failed} failed, {skipped} skipped')
    return 1 if failed or not passed else 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1]))
