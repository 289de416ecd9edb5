"""The arm64 run: what it counts as fresh, how it compares two machines, what memory it takes for the program's."""

import json
import math
import os

import arm64_memory
import arm64_results
import arm64_root
import deb_control
import pytest

SMAPS = """\
00400000-00452000 r--p 00000000 fe:00 1 /usr/bin/python3.11
Rss:                 100 kB
Pss:                  50 kB
Anonymous:             0 kB
5502165000-5502965000 rw-p 00000000 00:00 0
Rss:                  30 kB
Anonymous:            30 kB
555555554000-55555f482000 rw-p 00000000 00:00 0 [heap]
Rss:                1156 kB
Anonymous:          1156 kB
7f6225e00000-7f622ddff000 rwxp 00000000 00:00 0
Rss:                2048 kB
Anonymous:          2048 kB
"""


@pytest.fixture
def tree(tmp_path):
    """Two packages, of which `above` needs `below`, as files; with what the results of all depend on."""
    names = [*arm64_results.TOOLS, 'README.md', 'tools/other.py']
    for package, needs in {'below': '', 'above': '<exec_depend>below</exec_depend>', 'beside': ''}.items():
        names += [f'src/{package}/package.xml', f'src/{package}/code.py']
        (tmp_path / 'src' / package).mkdir(parents=True)
        (tmp_path / 'src' / package / 'package.xml').write_text(
            f'<package format="2"><name>{package}</name><version>1.0.0</version><description>d</description>'
            f'<maintainer email="a@b.org">a</maintainer><license>BSD</license>{needs}</package>'
        )
    (tmp_path / 'tools').mkdir()
    for name in names:
        if not name.endswith('.xml'):
            (tmp_path / name).write_text(name)
    return tmp_path, names


@pytest.mark.parametrize(
    'changed, stale',
    [
        ('src/below/code.py', {'below', 'above', 'tools'}),
        ('src/above/code.py', {'above', 'tools'}),
        ('tools/steady.py', {'below', 'above', 'beside', 'tools'}),
        ('tools/other.py', {'tools'}),
    ],
)
def test_a_result_is_stale_when_anything_changes_that_its_package_needs(tree, changed, stale):
    root, names = tree
    before = arm64_results.keys(root, names)
    assert arm64_results.keys(root, names) == before
    (root / changed).write_text('changed')
    after = arm64_results.keys(root, names)
    assert {package for package in before if before[package] != after[package]} == stale


def test_every_unit_test_belongs_to_a_package_and_the_largest_comes_last():
    found = arm64_results.unit_files(arm64_root.ROOT)
    sizes = [len(files) for files in found.values()]
    assert sizes == sorted(sizes) and list(found)[-1] == 'sara_lab'
    assert set(found) - {'tools'} <= {package.name for package in deb_control.read_packages(arm64_root.ROOT / 'src')}
    assert 'tools/test/test_arm64.py' in found['tools']


def test_differences_are_found_wherever_they_are():
    ours = {'same': 1.0, 'list': [1.0, {'deep': 2.0}], 'text': 'a', 'only': 1, 'flag': True, 'none': None}
    theirs = {'same': 1.0, 'list': [1.0, {'deep': 2.5}], 'text': 'b', 'flag': True, 'none': None, 'longer': [1]}
    apart = {place: far for place, _, _, far in arm64_results.differences(ours, theirs) if far}
    assert apart == {'/list/1/deep': 0.5, '/text': math.inf, '/only': math.inf, '/longer': math.inf}
    assert [leaf[3] for leaf in arm64_results.differences([1], [1, 2])] == [math.inf]
    assert [leaf[3] for leaf in arm64_results.differences(True, 1)] == [0.0]


def test_the_square_says_how_many_values_differ_and_which():
    assert arm64_results.square_lines({'a': 1.0}, {'a': 1.0 + 5e-7})[0].startswith('1 values, 0 of them')
    lines = arm64_results.square_lines({'a': 1.0, 'b': 2}, {'a': 1.001, 'b': 2})
    assert lines[0].startswith('2 values, 1 of them') and lines[-1] == '| /a | 1.0 | 1.001 | 0.001 |'


def test_tests_are_counted_and_what_failed_is_named(tmp_path):
    kept = tmp_path / 'test_a.json'
    kept.write_text(json.dumps({'file': 'test_a.py', 'key': 'k', 'seconds': 60.0, 'end': 'pytest ended with status 1'}))
    kept.with_suffix('.xml').write_text(
        '<testsuite><testcase classname="a" name="good"/><testcase classname="a" name="not"><skipped message="no"/>'
        '</testcase><testcase classname="a" name="bad"><failure message="1 != 2&#10;more"/></testcase></testsuite>'
    )
    crashed = tmp_path / 'test_b.json'
    crashed.write_text(json.dumps({'file': 'test_b.py', 'key': 'k', 'seconds': 60.0, 'end': 'not finished in 9 s'}))
    count = arm64_results.Count(waiting=['test_c.py'])
    count.add(kept)
    count.add(crashed)
    assert (count.passed, count.skipped, count.seconds) == (1, 1, 120.0)
    assert count.failed == {'a.bad': '1 != 2', 'test_b.py': 'not finished in 9 s'}
    lines = arm64_results.units_table({'one': count})
    assert '| one | 1 | 2 | 1 | 1 | 2 |' in lines and '- `a.bad` failed:\n  1 != 2' in '\n'.join(lines)
    count.failed = {'a.one[0.5]': 'no browser', 'a.two': 'no browser', 'a.three': 'slow', 'b.one': 'no browser'}
    told = '\n'.join(arm64_results.units_table({'one': count})[-6:]).split('\n- ')
    assert told == [
        '- 2 tests of `a` failed:\n  no browser',
        '`a.three` failed:\n  slow',
        '`b.one` failed:\n  no browser',
    ]


def test_pip_in_the_root_trusts_what_this_machine_trusts(tmp_path):
    arm = arm64_root.Machine(tmp_path)
    assert not [word for word in arm.command('true') if word.startswith('PIP_CERT=')] or 'PIP_CERT' in os.environ
    kept = arm.root / arm64_root.KEPT_CERTIFICATES
    kept.parent.mkdir(parents=True)
    kept.touch()
    assert f'PIP_CERT=/{arm64_root.KEPT_CERTIFICATES}' in arm.command('true')


def test_only_what_lies_between_the_marks_is_written():
    page = f'# Title\n\n{arm64_results.BEGIN}\nold\n{arm64_results.END}\n\nwords\n'
    new = arm64_results.write_page(page, {'Part': ['new']})
    assert new.startswith('# Title') and new.endswith('words\n') and 'old' not in new and '## Part\nnew' in new
    assert arm64_results.write_page(new, {'Part': ['new']}) == new
    with pytest.raises(ValueError, match='lacks'):
        arm64_results.write_page('# Title', {})
    arm64_results.write_page((arm64_root.ROOT / 'docs/arm64.md').read_text(encoding='utf-8'), {})


def test_the_emulators_memory_is_not_the_programs():
    assert arm64_memory.resident(SMAPS, arm64_memory.EMULATOR) == {'resident': 130, 'anonymous': 30}
    assert arm64_memory.resident(SMAPS, 1 << 64) == {'resident': 3334, 'anonymous': 3234}


@pytest.mark.parametrize(
    'command, node',
    [
        ('qemu /venv/bin/python3 python3 /lib/move_base __name:=move_base __log:=x', 'move_base'),
        ('python3 /usr/bin/rosmaster --core -p 11311', 'rosmaster'),
        ('python3 /usr/bin/roslaunch sara_bringup sara.launch', None),
    ],
)
def test_a_node_is_known_by_its_command_line(command, node):
    assert arm64_memory.node_of(command.split()) == node
