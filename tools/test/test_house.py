"""The rules of the house that a program can hold: who may import whom, and that pure modules are pure."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import house
import pytest

SRC = Path(__file__).resolve().parents[2] / 'src'
BELOW_SIM = {'sara_common', 'canserial', 'sara_lowlevel', 'ahead_of_time', 'nmea_navsat_driver'}
BELOW_BRINGUP = {*BELOW_SIM, 'sara_sim', 'sara_nav', 'sara_localization', 'sara_control', 'sara_slam'}
MAY_KNOW = {
    'sara_lab': {*BELOW_BRINGUP, 'sara_bringup', 'sara_hmi'},
    'sara_bringup': BELOW_BRINGUP,
    'sara_hmi': {'sara_common', 'sara_control', 'sara_nav'},
    'sara_sim': BELOW_SIM,
    'sara_slam': {'ahead_of_time', 'sara_common', 'sara_control', 'sara_localization', 'sara_nav'},
    'sara_nav': {'ahead_of_time', 'sara_common'},
    'sara_localization': {'ahead_of_time', 'sara_common'},
    'sara_control': {'ahead_of_time', 'sara_common', 'canserial'},
    'sara_lowlevel': {'sara_common', 'canserial'},
    'canserial': {'sara_common'},
    'nmea_navsat_driver': {'sara_common'},
    'sara_common': {'ahead_of_time'},
    'ahead_of_time': set(),
}
MODULES = sorted(path for package in MAY_KNOW for path in (SRC / package / 'src' / package).rglob('*.py'))
PURE = [path for path in MODULES if 'ros' not in path.parts]


def imported(path):
    """Names of the top-level packages that a source file imports."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name.split('.')[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module.split('.')[0]


def test_ros_is_hidden_here():
    with pytest.raises(ImportError):
        importlib.import_module('rospy')


@pytest.mark.parametrize('path', MODULES, ids=lambda p: str(p.relative_to(SRC)))
def test_no_import_runs_upward(path):
    package = path.relative_to(SRC).parts[0]
    assert set(imported(path)) & set(MAY_KNOW) <= MAY_KNOW[package] | {package}


@pytest.mark.parametrize('path', PURE, ids=lambda p: str(p.relative_to(SRC)))
def test_pure_module_imports_without_ros(path):
    parts = path.relative_to(SRC).with_suffix('').parts[2:]
    importlib.import_module('.'.join(part for part in parts if part != '__init__'))


@pytest.mark.parametrize(
    'module, library',
    [
        ('canserial.dbc.modes', 'cantools'),
        ('sara_control.gate.guard', 'cantools'),
        ('sara_localization.checks.check_config', 'pyproj'),
    ],
)
def test_a_node_does_not_load_a_large_library_that_it_has_no_use_for(module, library):
    """Each costs 10 MB and a third of the time that a node needs to start."""
    asked = f'import {module}, sys; sys.exit({library!r} in sys.modules)'
    assert subprocess.run([sys.executable, '-c', asked]).returncode == 0


@pytest.fixture(scope='module')
def ours():
    return house.read_house()


def test_no_import_makes_a_circle(ours):
    assert house.all_circles(ours) == []


def test_a_circle_is_found(tmp_path):
    for name, text in (
        ('one', 'from toys import two'),
        ('two', 'import toys.sub.three'),
        ('sub/three', 'from .. import one'),
    ):
        path = tmp_path / 'src' / 'toys' / 'src' / 'toys' / f'{name}.py'
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f'{text}\n')
    assert ('toys.one', 'toys.sub.three', 'toys.two') in house.all_circles(house.read_house(tmp_path))


def test_a_package_shows_few_rooms(ours):
    rooms = {package: len(ours.rooms(package)) for package in ours.packages}
    assert {package: count for package, count in rooms.items() if count > house.MAX_ROOMS} == {}


def test_a_module_is_read_in_one_sitting(ours):
    assert {m.name: m.lines for m in ours.modules.values() if m.lines > house.MAX_MODULE_LINES} == {}


def test_only_the_laboratory_s_own_tests_and_programs_know_it():
    files = [path for folder in ('test', 'nodes', 'scripts') for path in SRC.glob(f'*/{folder}/**/*') if path.is_file()]
    programs = [
        path
        for path in files
        if path.suffix in ('.py', '') and '__pycache__' not in path.parts and (path.suffix or 'test' not in path.parts)
    ]
    known = [path for path in programs if 'sara_lab' in set(imported(path))]
    assert [path for path in known if path.relative_to(SRC).parts[0] != 'sara_lab'] == [] and known


COLUMNWISE = {'sin', 'cos', 'tan', 'exp', 'arctan2'}


def sines_of_columns(tree):
    """Lines where numpy takes a sine, or the like, of a column of a table: see sara_common.repeatable. Compiled
    functions take each by itself.
    """
    if isinstance(tree, ast.FunctionDef) and any('kernel' in ast.unparse(d) for d in tree.decorator_list):
        return
    if isinstance(tree, ast.Call) and ast.unparse(tree.func).startswith('np.') and tree.func.attr in COLUMNWISE:
        for of in tree.args:
            if (
                isinstance(of, ast.Subscript)
                and isinstance(of.slice, ast.Tuple)
                and isinstance(of.slice.elts[0], ast.Slice)
            ):
                yield tree.lineno
    for node in ast.iter_child_nodes(tree):
        yield from sines_of_columns(node)


def test_a_sine_of_a_column_is_taken_where_it_is_the_same_again():
    found = {path.relative_to(SRC): list(sines_of_columns(ast.parse(path.read_text()))) for path in MODULES}
    assert {path: lines for path, lines in found.items() if lines} == {}
    assert list(sines_of_columns(ast.parse('x = np.sin(a)\ny = np.cos(poses[:, 2])'))) == [2]
