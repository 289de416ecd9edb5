"""The rules of the house that a program can hold: who may import whom, and that pure modules are pure."""

import ast
import importlib
from pathlib import Path

import pytest

SRC = Path(__file__).resolve().parents[2] / 'src'
MAY_KNOW = {
    'sara_lab': {
        'ahead_of_time',
        'sara_common',
        'sara_bringup',
        'sara_sim',
        'sara_nav',
        'sara_localization',
        'sara_control',
        'sara_lowlevel',
        'canserial',
    },
    'sara_bringup': {
        'ahead_of_time',
        'sara_common',
        'sara_sim',
        'sara_nav',
        'sara_localization',
        'sara_control',
        'sara_lowlevel',
        'canserial',
    },
    'sara_sim': {'ahead_of_time', 'sara_common', 'sara_lowlevel', 'canserial'},
    'sara_nav': {'ahead_of_time', 'sara_common'},
    'sara_localization': {'ahead_of_time', 'sara_common'},
    'sara_control': {'ahead_of_time', 'sara_common', 'canserial'},
    'sara_lowlevel': {'sara_common', 'canserial'},
    'canserial': {'sara_common'},
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
