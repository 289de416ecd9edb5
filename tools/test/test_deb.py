"""The Debian packages: what each needs comes with it, its files name no folder of the builder, nothing of it stays."""

import ast
import importlib.machinery
import marshal
import os
import platform
import re
import subprocess
import sys
import sysconfig
from functools import cache
from pathlib import Path

import deb
import deb_control
import pytest
from catkin_pkg.packages import find_package_paths

SRC = deb.ROOT / 'src'
PACKAGES = {package.name: package for package in deb_control.read_packages(SRC)}
VERSION = '1.0'
TESTS_ALONE = SRC / 'sara_hmi/src/sara_hmi/browser'  # for tests and sara_lab
OPTIONAL = {'gymnasium', 'pyarrow', 'mcap', 'distributed'}  # imported where they are asked for: for a desk, no robot
PLACES = ['/usr/lib/python3/dist-packages', sysconfig.get_path('purelib')]


@cache
def installed():
    """{package: names of what it depends on} of this machine's Debian packages, under the names they provide too."""
    form = '${Package}\t${Depends}, ${Pre-Depends}\t${Provides}\n'
    text = subprocess.run(['dpkg-query', '-W', '-f', form], capture_output=True, text=True, check=True).stdout
    found = {}
    for line in text.splitlines():
        name, depends, provides = line.split('\t')
        for known in (name, *re.findall(r'[a-z0-9][a-z0-9+.-]+(?= \(|,|$)', provides)):
            found[known] = set(re.findall(r'(?:^|[,|])\s*([a-z0-9][a-z0-9+.-]+)', depends))
    return found


def control_of(name):
    return deb_control.control(PACKAGES[name], PACKAGES, VERSION)


@cache
def base():
    pins = deb.pinned_names()
    own, others = deb.pinned(pins, deb.ROOT / '.venv')
    return own, deb_control.base_control(PACKAGES['sara_common'], VERSION, 'amd64', pins, others)


def names(control):
    return [entry.split(' ')[0] for entry in (*control.depends, *control.recommends)]


def brought_by(name):
    """Names of all that comes with a catkin package: Debian packages and ours."""
    found, waiting = set(), [deb_control.debian_name(name)]
    ours = {deb_control.debian_name(package): package for package in PACKAGES}
    while waiting:
        package = waiting.pop()
        if package not in found:
            found.add(package)
            if package == deb_control.BASE:
                waiting += names(base()[1])
            else:
                waiting += names(control_of(ours[package])) if package in ours else installed().get(package, ())
    return found


def programs(package):
    folders = [SRC / package / 'src', SRC / package / 'nodes', SRC / package / 'scripts']
    files = [path for folder in folders for path in folder.rglob('*') if path.is_file()]
    return [path for path in files if path.suffix in ('', '.py') and not path.is_relative_to(TESTS_ALONE)]


def statements(node):
    """All below a node, without imports that may fail."""
    for child in ast.iter_child_nodes(node):
        if not (
            isinstance(child, ast.Try) and 'ImportError' in map(ast.unparse, (h.type for h in child.handlers if h.type))
        ):
            yield child
            yield from statements(child)


@cache
def imported(package):
    found = set()
    for path in programs(package):
        for node in statements(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                found |= {alias.name.split('.')[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                found.add(node.module.split('.')[0])
    return found


@pytest.mark.parametrize('name', PACKAGES)
def test_what_a_package_depends_on_is_there(name):
    control = control_of(name)
    ours = {deb_control.BASE, *map(deb_control.debian_name, PACKAGES)}
    assert f'{deb_control.BASE} (= {VERSION})' in control.depends and len(set(names(control))) == len(names(control))
    wanted = {need for need in PACKAGES[name].needs if need in PACKAGES}
    assert {entry for entry in names(control) if entry in ours} == {
        deb_control.BASE,
        *map(deb_control.debian_name, wanted),
    }
    assert [entry for entry in names(control) if entry not in ours and entry not in installed()] == []


@cache
def owners():
    """{module: Debian packages that hold it} of all that is imported from elsewhere; the pinned ones: sara-python."""
    modules = {module for package in PACKAGES for module in imported(package)}
    foreign = modules - set(sys.stdlib_module_names) - set(PACKAGES)
    specs = {module: importlib.machinery.PathFinder.find_spec(module, PLACES) for module in foreign}
    paths = {
        module: os.path.realpath(spec.origin or list(spec.submodule_search_locations)[0])
        for module, spec in specs.items()
        if spec
    }
    found = subprocess.run(['dpkg', '-S', *set(paths.values())], capture_output=True, text=True).stdout
    holders = dict(line.rsplit(': ', 1)[::-1] for line in found.splitlines())
    known = {
        module: {name.split(':')[0] for name in holders.get(path, '').split(', ')} for module, path in paths.items()
    }
    pinned = {file.parts[0].removesuffix('.py') for distribution in base()[0] for file in distribution.files}
    return known | {module: {deb_control.BASE} for module in foreign & pinned}


@pytest.mark.parametrize('name', PACKAGES)
def test_what_a_package_imports_comes_with_it(name):
    ours = {module: {deb_control.debian_name(module)} for module in PACKAGES}
    modules = set(imported(name)) - set(sys.stdlib_module_names) - OPTIONAL
    assert [module for module in modules if not (owners() | ours).get(module, set()) & brought_by(name)] == []


@pytest.mark.parametrize('name', PACKAGES)
def test_what_a_launch_file_starts_comes_with_it(name):
    wanted = set()
    for path in (SRC / name / 'launch').glob('*.launch'):
        wanted |= set(re.findall(r'pkg="([a-z_0-9]+)"|\$\(find ([a-z_0-9]+)\)', path.read_text()))
    known = {first or second for first, second in wanted}
    assert [need for need in known if need in PACKAGES and deb_control.debian_name(need) not in brought_by(name)] == []
    foreign = {need: set(deb_control.debian_packages(need)) for need in known - set(PACKAGES)}
    assert [need for need, packages in foreign.items() if not packages <= brought_by(name)] == []


def test_the_pinned_packages_come_whole_and_without_the_tools():
    own, control = base()
    found = {distribution.metadata['Name'] for distribution in own}
    assert {'python-can', 'cantools', 'filterpy', 'textparser'} <= found and not {'ruff', 'pip'} & found
    assert [name for name in names(control) if name not in installed()] == []


def test_what_is_for_another_processor_alone_is_not_packed():
    assert ('numba' in deb.pinned_names()) == (platform.machine() == 'aarch64')


def test_what_neither_the_venv_nor_debian_brought_stops_the_build(tmp_path, monkeypatch):
    (tmp_path / 'stray-1.0.dist-info').mkdir()
    (tmp_path / 'stray-1.0.dist-info/METADATA').write_text('Metadata-Version: 2.1\nName: stray\nVersion: 1.0\n')
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(SystemExit, match=r'a robot would not have it\n.*stray'):
        deb.pinned(['stray'], deb.ROOT / '.venv')


def test_a_later_commit_is_a_later_version_and_a_release_later_than_all():
    text = '# Changelog\n\n## 0.2.0{}\nNew\n\n## 0.1.0\n'
    versions = [
        '0.1.0',
        *(deb_control.version_of(text.format(' (not released)'), second, 'abc') for second in (10**9, 2 * 10**9)),
    ]
    versions.append(deb_control.version_of(text.format(''), 0, 'abc'))
    assert versions[1] == '0.2.0~git20010909014640.abc' and versions[3] == '0.2.0'
    for earlier, later in zip(versions, versions[1:]):
        assert subprocess.run(['dpkg', '--compare-versions', earlier, 'lt', later]).returncode == 0
    with pytest.raises(ValueError, match='no heading'):
        deb_control.version_of('# Changelog\n', 0, 'abc')


def test_the_changelog_s_version_is_the_packages():
    version = deb_control.version_of((deb.ROOT / 'CHANGELOG.md').read_text(), 0, 'abc')
    assert {package.release for package in PACKAGES.values()} == {version.split('~')[0]}


def test_what_a_build_leaves_behind_is_no_source_of_the_next(tmp_path, monkeypatch):
    for name in ('CHANGELOG.md', 'src/p/package.xml'):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / 'CHANGELOG.md').write_text('# Changelog\n\n## 0.1.0\n')
    (tmp_path / 'src/p/package.xml').write_text('<package/>')

    def install(work, *_):
        (work / 'stage/p').mkdir(parents=True)
        (work / 'stage/p/package.xml').write_text('<package/>')
        raise KeyboardInterrupt

    monkeypatch.setattr(deb, 'ROOT', tmp_path)
    monkeypatch.setattr(deb, 'install', install)
    monkeypatch.setattr(deb_control, 'read_packages', lambda _: [])
    with pytest.raises(KeyboardInterrupt):
        deb.build(tmp_path / 'out', 0.0)
    assert list(find_package_paths(tmp_path)) == ['src/p']


@pytest.fixture
def stage(tmp_path):
    """Two files of a package as an install space has them."""
    stage = tmp_path / 'stage'
    node, module = stage / 'opt/sara/lib/sara_nav/move_base', stage / deb.MODULES / 'sara_nav/maps.py'
    for path, text in ((node, '#!/usr/bin/env python3\nprint(1)\n'), (module, 'def f():\n    return 1\n')):
        path.parent.mkdir(parents=True)
        path.write_text(text)
    node.chmod(0o755)
    return stage


def test_a_package_holds_debian_s_interpreter_bytecode_that_is_fresh_and_one_time(stage, tmp_path):
    deb.settle(stage, 10**9, tmp_path / 'log')
    deb.pack(stage, control_of('sara_nav'), 10**9, tmp_path, tmp_path / 'log')
    (package,) = tmp_path.glob('*.deb')
    fields = subprocess.run(['dpkg-deb', '-f', package], capture_output=True, text=True, check=True).stdout
    assert (
        package.name == 'sara-nav_1.0_all.deb' and 'Package: sara-nav\n' in fields and ' sara-common (= 1.0)' in fields
    )
    subprocess.run(['dpkg-deb', '-x', package, tmp_path / 'robot'], check=True)
    files = [path for path in (tmp_path / 'robot').rglob('*') if path.is_file()]
    assert {int(path.stat().st_mtime) for path in files} == {10**9} and len(files) == 4
    assert (tmp_path / 'robot/opt/sara/lib/sara_nav/move_base').read_text().startswith('#!/usr/bin/python3\n')
    (bytecode,) = (path for path in files if path.suffix == '.pyc')
    assert (
        int.from_bytes(bytecode.read_bytes()[8:12], 'little') == 10**9
        and str(tmp_path).encode() not in bytecode.read_bytes()
    )


def test_a_file_that_names_a_folder_of_the_builder_is_refused(stage, tmp_path):
    (stage / 'opt/sara/setup.sh').write_text(f'. {deb.ROOT}/devel/setup.sh\n')
    with pytest.raises(SystemExit, match=r'setup\.sh names a folder of this machine'):
        deb.pack(stage, control_of('sara_nav'), 10**9, tmp_path, tmp_path / 'log')


@pytest.mark.parametrize('folder', ('/sara', '/app', '/home/somebody/sara', f'/home/{"x" * 80}/sara'))
def test_a_folder_is_named_as_a_whole_path_alone(folder):
    """As a container has it, a checkout may lie at /sara, and packages are installed in /opt/sara."""
    code = marshal.dumps(compile('def f():\n    return 1\n', f'{folder}/src/sara_nav/maps.py', 'exec'))
    for content in (
        code,
        f'. {folder}/devel/setup.sh',
        f'PATH={folder}:/bin',
        f"'{folder}'",
        f'x{folder}/devel',
        f'in {folder}.',
    ):
        assert deb.names_folder(content if isinstance(content, bytes) else content.encode(), Path(folder))
    for innocent in ('/opt{}/setup.sh', 'platforms{}/sara.dbc', '{}_nav/maps.py', '{}-nav', '{}.yaml', '/usr/lib{}/x'):
        assert not deb.names_folder(innocent.format(folder).encode(), Path(folder))


def test_a_command_that_fails_shows_its_log(tmp_path):
    with pytest.raises(SystemExit, match=r'(?s)no such place.*sh failed: .*log has the whole of it'):
        deb.run(tmp_path / 'log', 'sh', '-c', 'echo no such place >&2; exit 3')


def test_before_it_is_removed_caches_go_and_nothing_else(stage, tmp_path):
    cache = stage / deb.MODULES / 'sara_nav/__pycache__'
    cache.mkdir()
    (cache / 'maps.f-1.py311.nbi').write_text('')
    dpkg = tmp_path / 'bin/dpkg'
    dpkg.parent.mkdir()
    dpkg.write_text(f'#!/bin/sh\n[ "$*" = "-L sara-nav" ] && find {stage}\n')
    dpkg.chmod(0o755)
    env = {'PATH': f'{dpkg.parent}:/usr/bin:/bin'}
    for _ in range(2):  # the second time there is none
        subprocess.run(['sh', '-c', deb_control.prerm('sara-nav')], env=env, check=True)
    assert not cache.exists() and (stage / deb.MODULES / 'sara_nav/maps.py').exists()


def test_what_was_changed_since_the_commit_is_of_now(tmp_path):
    env = {**os.environ, 'GIT_COMMITTER_DATE': '2001-09-09T01:46:40Z'}

    def git(*words):
        command = ['git', '-C', tmp_path, '-c', 'user.name=a', '-c', 'user.email=a@b.c', *words]
        subprocess.run(command, env=env, stdout=subprocess.DEVNULL, check=True)

    assert deb.commit_of(tmp_path, 5e9) == (5 * 10**9, 'unknown')
    git('init', '-q')
    (tmp_path / 'file').write_text('one')
    git('add', 'file')
    git('commit', '-q', '-m', 'first')
    seconds, name = deb.commit_of(tmp_path, 5e9)
    assert seconds == 10**9 and re.fullmatch('[0-9a-f]{8}', name)
    (tmp_path / 'file').write_text('another')
    assert deb.commit_of(tmp_path, 5e9) == (5 * 10**9, f'{name}.changed')


@pytest.mark.parametrize('path', ['README.md', 'tools/deb_check.sh'])
def test_one_package_alone_is_named_with_all_of_ours_that_it_brings(path):
    (told,) = re.findall(r'sara-\{(localization,[a-z,-]+)\}', (deb.ROOT / path).read_text())
    ours = {deb_control.debian_name(package) for package in PACKAGES} | {deb_control.BASE}
    assert {f'sara-{name}' for name in told.split(',')} == brought_by('sara_localization') & ours
