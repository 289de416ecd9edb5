"""No code knows a robot: neither the name of a platform nor a number that belongs to one; their folders hold them."""

import ast
import io
import re
import tokenize
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
SRC = ROOT / 'src'
FOLDERS = {
    path.name: path
    for path in (SRC / 'sara_description' / 'platforms').iterdir()
    if path.is_dir() and not path.is_symlink()
}
# The project is called so too: its packages sara_..., sara.launch, sara.rviz, and the page's own window.sara.
NAMES = re.compile(rf'(?<![A-Za-z_.])({"|".join(FOLDERS)})(?![A-Za-z_]|\.(?!dbc|yaml|urdf)[a-z])')
THESIS = 'sara_lab/experiments/'  # repeats the thesis's experiments, whose figures are SARA's
BY_CHANCE = {
    'sara_lab/campaign/pairs.py': {565},  # where a joystick is
    'sara_common/grids/images.py': {257},  # 65535 / 255
    'sara_lab/fuzz/localization/fuzz_ranges.py': {0.54},  # share of the inputs
    'sara_sim/pedestrians/social_force.py': {0.54},  # a published relaxation time
    'sara_hmi/config/config.py': {0.125},  # s of a touch
    'sara_lab/studies/draw_global_start.py': {0.46},  # of a figure
    'sara_nav/costmaps/costmap_settings.py': {0.46},  # costmap_2d's robot_radius
    'sara_nav/ros/costmap_node.py': {0.46},
    'sara_nav/goals/move_base_config.py': {0.46},
    'sara_nav/move_base/settings.py': {0.46},
    'sara_nav/lattice/planner.py': {0.46},
}
MODULES = sorted([*SRC.glob('*/src/**/*.py'), *SRC.glob('*/examples/*.py')])
SCRIPTS = sorted([*SRC.glob('*/www/js/**/*.js'), *(path for path in SRC.glob('*/nodes/*') if path.is_file())])


def own_numbers(folder):
    """The numbers of a platform that are hardly anybody else's: sizes, wheels, slip, gain, the bus's identifiers; round
    ones left out.
    """
    tree = yaml.safe_load((folder / 'platform.yaml').read_text())
    facts = tree['platform']
    sizes = [facts['body']['length'], facts['body']['width'], *facts['wheels'].values()]
    numbers = [
        *sizes,
        *(0.5 * size for size in sizes[:2]),
        tree['safety_gate']['turn_slip'],
        tree['read']['default_gain'],
    ]
    bus = {
        int(identifier)
        for path in folder.glob('*.dbc')
        for identifier in re.findall(r'^BO_ (\d+) ', path.read_text(), re.MULTILINE)
    }
    return bus | {number for number in numbers if number >= 1000 or abs(20 * number - round(20 * number)) > 1e-9}


OWN = set().union(*map(own_numbers, FOLDERS.values()))


def constants(path):
    """(line, value) of the numbers and texts in a module, docstrings left out."""
    tree = ast.parse(path.read_text())
    docs = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef))
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    yield from (
        (node.lineno, node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and id(node) not in docs and not isinstance(node.value, bool)
    )


def identifiers(path):
    """(line, name) of the names in a module."""
    tokens = tokenize.generate_tokens(io.StringIO(path.read_text()).readline)
    yield from ((token.start[0], token.string) for token in tokens if token.type == tokenize.NAME)


def name_of(path):
    return str(path.relative_to(SRC)).split('/src/', 1)[-1]


def test_there_are_numbers_to_look_for():
    assert {1.08, 0.58, 0.525, 0.155, 64000, 0.54, 0.29, 1.27, 0x204} <= OWN and {
        0.275,
        0.125,
        0.46,
        8192,
        1.08,
        0x090,
    } <= OWN


@pytest.mark.parametrize('path', MODULES, ids=name_of)
def test_no_platforms_number_in_code(path):
    if name_of(path).startswith(THESIS):
        return
    known = BY_CHANCE.get(name_of(path), set())
    found = [
        f'{name_of(path)}:{line}: {value}'
        for line, value in constants(path)
        if isinstance(value, (int, float)) and value in OWN - known
    ]
    assert found == []


@pytest.mark.parametrize('path', MODULES, ids=name_of)
def test_no_platforms_name_in_code(path):
    if name_of(path).startswith(THESIS):
        return
    texts = [(line, value) for line, value in constants(path) if isinstance(value, str)]
    found = [f'{name_of(path)}:{line}: {text!r}' for line, text in [*texts, *identifiers(path)] if NAMES.search(text)]
    assert found == []


@pytest.mark.parametrize('path', SCRIPTS, ids=lambda path: str(path.relative_to(SRC)))
def test_neither_in_scripts(path):
    text = re.sub(r'"""(.|\n)*?"""|/\*(.|\n)*?\*/', '', path.read_text())
    text = '\n'.join(re.split(r'//|#', line)[0] for line in text.splitlines())
    numbers = {float(number) for number in re.findall(r'(?<![\w.])\d+(?:\.\d+)?(?![\w.])', text)}
    assert not NAMES.search(text) and not numbers & OWN
