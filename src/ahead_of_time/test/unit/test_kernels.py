"""Kernels compiled at build time: they are found when fresh, take no type that they were not made for, and numba steps
in otherwise.
"""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

SOURCE = """
from typing import NamedTuple
import numpy as np
from ahead_of_time import kernel
from toys import numbers


@kernel
def inner(a, k):
    return a[k] * numbers.FACTOR


@kernel
def summed(a, k, scale, flag, pair):
    total = pair[0]
    for i in range(k):
        total += inner(a, i) * scale
    if flag:
        a[0] = -1.0
    return total, np.full(2, pair[1])


class Place(NamedTuple):
    x: float
    y: float


class Line(NamedTuple):
    count: int
    closed: bool
    values: np.ndarray
    begin: Place


@kernel
def moved(line, by, factors):
    # values and the ends of where it begins, each by its factor; and the place where it begins, moved
    total = line.begin.x * factors[0] + line.begin.y * factors[1]
    for i in range(line.count):
        total += line.values[i]
    if line.closed:
        total = -total
    return total, Place(line.begin.x + by.x, line.begin.y + by.y)


def warm():
    summed(np.zeros(2), 2, 1.0, False, (0.0, 1.0))
    moved(Line(2, False, np.zeros(2), Place(0.0, 0.0)), Place(0.0, 0.0), (1.0, 1.0))
"""
PROBE = """
import json, sys
import numpy as np
from ahead_of_time import misses
from toys import sums
values = %s
total, full = sums.summed(*values)
print(json.dumps([total, full.tolist(), 'numba' in sys.modules, misses()]))
"""
PROBES = """
import json, sys
import numpy as np
from ahead_of_time import misses
from toys import sums
found = []
assert 'numba' not in sys.modules
for values in [%s]:
    total, full = sums.summed(*values())
    found.append([total, full.tolist(), 'numba' in sys.modules, dict(misses())])
print(json.dumps(found))
"""
PROBE_OF_TUPLES = """
import json, sys
from collections import namedtuple
import numpy as np
from ahead_of_time import misses
from toys import sums
from toys.sums import Line, Place
class Other(Place):
    pass
Same = namedtuple('Place', 'x y', module='toys.sums')
Swapped = namedtuple('Place', 'y x', module='toys.sums')
total, place = sums.moved(%s)
assert type(place) is Place or type(place) is Other, type(place)
print(json.dumps([total, list(place), 'numba' in sys.modules, misses()]))
"""
ARRAY, REST = 'np.array([1.0, 2.0, 3.0])', '3, 2.0, True, (10.0, 5.0)'


@pytest.fixture(scope='module')
def workshop(tmp_path_factory):
    """A folder with a package `toys`, and its kernels compiled beside it."""
    folder = tmp_path_factory.mktemp('workshop')
    (folder / 'toys').mkdir()
    (folder / 'toys' / '__init__.py').write_text('')
    (folder / 'toys' / 'numbers.py').write_text('FACTOR = 1.0\n')
    (folder / 'toys' / 'sums.py').write_text(SOURCE)
    build(folder)
    return folder


def python(folder, *arguments, **more):
    path = os.pathsep.join([str(folder), str(Path(__file__).parents[2] / 'src')])
    environment = {**os.environ, 'PYTHONPATH': path, 'NUMBA_CACHE_DIR': str(folder / 'cache'), **more}
    return subprocess.run([sys.executable, *arguments], env=environment, capture_output=True, text=True, check=False)


def build(folder):
    done = python(folder, '-m', 'ahead_of_time.build', str(folder), 'toys')
    assert done.returncode == 0, done.stderr
    return done.stdout


def probe(folder, array=ARRAY, rest=REST, **more):
    done = python(folder, '-c', PROBE % f'[{array}, {rest}]', **more)
    assert done.returncode == 0, done.stderr
    total, full, numba, missed = json.loads(done.stdout)
    assert full == [5.0, 5.0]
    return total, numba, missed


def test_without_numba_the_result_is_the_same(workshop):
    total, numba, missed = probe(workshop)
    assert total == 22.0 and not numba and not missed
    total, numba, missed = probe(workshop, AHEAD_OF_TIME='off')
    assert total == 22.0 and numba and not missed


def test_other_types_are_left_to_numba(workshop):
    """In one process, so that numba is imported once; each is a miss."""
    others = (
        f'np.array([1, 2, 3]), {REST}',  # another dtype of the same size
        f'np.array([1.0, 2.0, 3.0], np.float32), {REST}',
        'np.array([1.0, 2.0, 3.0]).astype(">f8").byteswap().view("f8"), 3, 2, True, (10.0, 5.0)',
        f'np.array([1.0, 0.0, 2.0, 0.0, 3.0])[::2], {REST}',  # not contiguous
        f'{ARRAY}, 3, 2, True, (10.0, 5.0)',  # an int for a float
        f'{ARRAY}, 3, 2.0, 1, (10.0, 5.0)',  # an int for a bool
        f'{ARRAY}, 3, 2.0, True, (10.0, 5.0, 0.0)',  # a longer tuple
        f'{ARRAY}, 3, 2.0, True, (10, 5.0)',
    )
    code = PROBES % ', '.join(f'lambda: ({other})' for other in others)
    done = python(workshop, '-c', code)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == [
        [22.0, [5.0, 5.0], True, {'toys.sums.summed': k + 1}] for k in range(len(others))
    ]


@pytest.mark.parametrize(
    'rest', ['np.int64(3), 2.0, True, (10.0, 5.0)', '3, np.float64(2.0), np.bool_(True), (10.0, 5.0)']
)
def test_numpys_scalars_are_what_numba_takes_them_for(workshop, rest):
    assert probe(workshop, rest=rest) == (22.0, False, {})


def probe_tuples(
    folder, line='Line(3, True, np.array([1.0, 2.0, 3.0]), Place(1.0, 2.0))', by='Place(10.0, 0.5)', **more
):
    done = python(folder, '-c', PROBE_OF_TUPLES % f'{line}, {by}, (1.0, 10.0)', **more)
    assert done.returncode == 0, done.stderr
    total, place, numba, missed = json.loads(done.stdout)
    return total, place, numba, missed


def test_named_tuples_are_read_by_field_and_returned_without_numba(workshop):
    assert probe_tuples(workshop) == (-27.0, [11.0, 2.5], False, {})
    assert probe_tuples(workshop, AHEAD_OF_TIME='off') == (-27.0, [11.0, 2.5], True, {})


def test_a_class_of_the_same_name_and_fields_is_the_class(workshop):
    """As after a module is loaded again."""
    assert probe_tuples(workshop, by='Same(10.0, 0.5)') == (-27.0, [11.0, 2.5], False, {})


def test_other_named_tuples_are_left_to_numba(workshop):
    """In one process, so that numba is imported once."""
    line, place = 'Line(3, True, np.array([1.0, 2.0, 3.0]), Place(1.0, 2.0))', 'Place(10.0, 0.5)'
    others = (
        (line, 'Swapped(0.5, 10.0)'),  # other fields
        (line, 'Other(10.0, 0.5)'),  # another class
        ('Line(3, True, np.array([1.0, 2.0, 3.0]), Place(1, 2.0))', place),  # an int for a float
        ('Line(3, True, np.array([1.0, 2.0, 3.0], np.float32), Place(1.0, 2.0))', place),
    )
    head, tail = PROBE_OF_TUPLES.split('total, place = ')
    body = ''.join('total, place = ' + tail % f'{line}, {by}, (1.0, 10.0)' for line, by in others)
    done = python(workshop, '-c', head + "assert 'numba' not in sys.modules\n" + body)
    assert done.returncode == 0, done.stderr
    assert [json.loads(said) for said in done.stdout.splitlines()] == [
        [-27.0, [11.0, 2.5], True, {'toys.sums.moved': k + 1}] for k in range(len(others))
    ]


def refused(folder, calls, head=''):
    """The names of the exceptions that calls raise, each None where it raised none; in one process."""
    code = f"""
import json
import numpy as np
from toys import sums
from toys.sums import Line, Place
{head}
raised = []
for call in [{', '.join(f'lambda: {call}' for call in calls)}]:
    try:
        call()
        raised.append(None)
    except Exception as error:
        raised.append(type(error).__name__)
print(json.dumps(raised))
"""
    done = python(folder, '-c', code)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_a_tuple_without_the_fields_is_refused(workshop):
    """`Bad` is shorter than its fields: nothing is read that is not there."""
    others = '(10.0, 0.5)', 'Line(3, True, np.zeros(3), Place(1.0, 2.0))', 'None', 'Bad((10.0,))'
    line = 'Line(3, True, np.zeros(3), Place(1.0, 2.0))'
    calls = [f'sums.moved({line}, {by}, (1.0, 10.0))' for by in others]
    assert None not in refused(workshop, calls, 'def Bad(values):\n    return tuple.__new__(Place, values)')


def test_an_array_that_may_not_be_written_is_not_written(workshop):
    assert (
        python(
            workshop,
            '-c',
            PROBE.replace('total,', 'values[0].flags.writeable = False\ntotal,', 1) % f'[{ARRAY}, {REST}]',
        ).returncode
        != 0
    )


def test_what_numba_refuses_is_refused(workshop):
    others = '', ARRAY, f'{ARRAY}, {REST}, 1', f'None, {REST}', f'"abc", {REST}', f'[1.0], {REST}'
    raised = refused(workshop, [f'sums.summed({arguments})' for arguments in others])
    assert len(raised) == len(others) and None not in raised


def test_changed_sources_are_not_run_as_they_were(workshop):
    assert build(workshop) == ''  # all is fresh
    time.sleep(0.02)
    (workshop / 'toys' / 'numbers.py').write_text('FACTOR = 10.0\n')
    done = python(
        workshop,
        '-c',
        'from ahead_of_time import library\nprint(library._kernels_of("toys", "toys.sums", "%s"))'
        % (workshop / 'toys' / 'sums.py'),
    )
    assert done.stdout.strip() == '{}', done.stderr
    assert 'toys' in build(workshop)
    assert probe(workshop) == (130.0, False, {})


def test_a_kernel_of_another_package_is_called_and_its_changes_are_seen(tmp_path):
    for name, lines in (
        ('lower', 'def f(a):\n    return a + 1.0\nf = kernel(f)\ndef warm(): f(1.0)\n'),
        ('upper', 'from lower.one import f\n@kernel\ndef g(a):\n    return f(a)\ndef warm(): g(1.0)\n'),
    ):
        (tmp_path / name).mkdir()
        (tmp_path / name / '__init__.py').write_text('')
        (tmp_path / name / 'one.py').write_text('from ahead_of_time import kernel\n' + lines)
    called = 'import sys\nfrom upper import one\nprint(one.g(1.0), "numba" in sys.modules)'
    compile_both = ('-m', 'ahead_of_time.build', str(tmp_path), 'lower', 'upper')
    assert python(tmp_path, *compile_both).returncode == 0
    assert python(tmp_path, '-c', called).stdout.split() == ['2.0', 'False']
    changed = tmp_path / 'lower' / 'one.py'
    changed.write_text(changed.read_text().replace('1.0', '10.0'))
    assert python(tmp_path, '-c', called).stdout.split() == ['11.0', 'True']  # numba compiles it anew
    assert python(tmp_path, *compile_both).stdout.count('compiling') == 2
    assert python(tmp_path, '-c', called).stdout.split() == ['11.0', 'False']


def test_another_machines_code_is_not_run(workshop):
    path = workshop / 'ahead_of_time.index.json'
    was = path.read_text()
    path.write_text(json.dumps({**json.loads(was), 'machine': ['another']}))
    assert probe(workshop)[1]
    path.write_text(was)


@pytest.fixture
def one_kernel(tmp_path):
    """A folder with the module lower.one, whose kernel `f` adds 1 and refuses what is below 0; a package without."""
    for name in ('lower', 'plain'):
        (tmp_path / name).mkdir()
        (tmp_path / name / '__init__.py').write_text('')
    (tmp_path / 'lower/one.py').write_text(
        'from ahead_of_time import kernel\n\n\n@kernel\ndef f(a):\n    if a < 0.0:\n'
        "        raise ValueError('below')\n    return a + 1.0\n\n\ndef warm():\n    f(1.0)\n"
    )
    return tmp_path


def test_portable_code_runs_on_another_processor(one_kernel):
    elsewhere = (
        'import sys\nfrom ahead_of_time import library\nhere = library.machine\n'
        'library.machine = lambda portable=False: [*here(True), "another processor"]\n'
        'from lower import one\nprint(one.f(1.0), "numba" in sys.modules)'
    )
    for options, imports_numba in (((), 'True'), (('--portable',), 'False')):
        assert python(one_kernel, '-m', 'ahead_of_time.build', *options, str(one_kernel), 'lower').returncode == 0
        assert python(one_kernel, '-c', elsewhere).stdout.split() == ['2.0', imports_numba]


def test_what_is_installed_elsewhere_runs_there_and_does_not_know_where_it_was_compiled(one_kernel, tmp_path_factory):
    robot = tmp_path_factory.mktemp('robot')
    options = ('--installed', str(robot), str(one_kernel))
    assert python(one_kernel, '-m', 'ahead_of_time.build', *options, 'lower', 'plain').returncode == 0
    assert not list(one_kernel.glob('_ahead_of_plain*'))
    shutil.copytree(one_kernel, robot, dirs_exist_ok=True, ignore=shutil.ignore_patterns('__pycache__'))
    called = 'import sys\nfrom lower import one\nprint(one.f(1.0), "numba" in sys.modules)'
    assert python(robot, '-c', called).stdout.split() == ['2.0', 'False']
    (code,) = robot.glob('_ahead_of_lower*.so')
    assert f'{robot}/lower/one.py'.encode() in code.read_bytes()
    assert f'{one_kernel}/lower'.encode() not in code.read_bytes()


@pytest.mark.parametrize(
    'line, warm, why',
    [
        ('return a.no_such_thing', 'f(1.0)', 'no_such_thing'),
        ('return a', 'import os, signal; os.kill(os.getpid(), signal.SIGKILL)', 'signal 9 ended the compiling of bad'),
    ],
)
def test_a_kernel_that_does_not_compile_fails_the_build_and_not_the_others(tmp_path, line, warm, why):
    for name, lines in (('good', ('return a + 1.0', 'f(1.0)')), ('bad', (line, warm))):
        (tmp_path / name).mkdir()
        (tmp_path / name / '__init__.py').write_text('')
        (tmp_path / name / 'one.py').write_text(
            'from ahead_of_time import kernel\n@kernel\ndef f(a):\n    {}\ndef warm():\n    {}\n'.format(*lines)
        )
    done = python(tmp_path, '-m', 'ahead_of_time.build', str(tmp_path), 'bad', 'good')
    assert done.returncode == 1 and why in done.stderr
    assert 'the kernels of bad could not be compiled' in done.stderr
    done = python(tmp_path, '-c', 'import sys\nfrom good import one\nprint(one.f(1.0), "numba" in sys.modules)')
    assert done.stdout.split() == ['2.0', 'False']


WAITING = """
import time
from pathlib import Path
from ahead_of_time import kernel, library
@kernel
def f(a):
    return a + 1.0
def warm():
    index = Path(__file__).parents[1] / library.INDEX
    for _ in range(600):
        if index.exists() and '"good"' in index.read_text():
            return f(1.0)
        time.sleep(0.1)
    raise RuntimeError('not in the index')
"""


def test_a_package_is_in_the_index_as_soon_as_it_is_compiled(tmp_path):
    good = 'from ahead_of_time import kernel\n@kernel\ndef f(a):\n    return a + 1.0\ndef warm():\n    f(1.0)\n'
    first = good + '#' * len(WAITING)  # the largest is the first to be compiled, where there is one core
    for name, text in (('good', first), ('waits', WAITING)):
        (tmp_path / name).mkdir()
        (tmp_path / name / '__init__.py').write_text('')
        (tmp_path / name / 'one.py').write_text(text)
    done = python(tmp_path, '-m', 'ahead_of_time.build', str(tmp_path), 'waits', 'good')
    assert done.returncode == 0, done.stderr


def test_the_extension_takes_what_it_is_given():
    from ahead_of_time import library

    try:
        kernel_type = library.dispatch().Kernel
    except TypeError:
        pytest.skip('the workspace is not built')
    made = kernel_type([('af82Cw', np.linalg.norm)], lambda *values, **named: (len(values), sorted(named)), len)
    assert made(np.eye(2)) == np.sqrt(2.0) and made.missed == 0
    assert made(np.eye(2).T[:1], 2) == (2, []) and made(a=1) == (0, ['a']) and made.missed == 2
    for variant in (1, 2), (), 'af', ('f', len, 1), ('{0f}', len), ('{1f}', len, 'a.B:c'):
        with pytest.raises((TypeError, ValueError)):
            kernel_type([variant], None, None)
