"""`make deb`: Debian packages of the stack, for a robot without a compiler; they install into /opt/sara.

    tools/deb.py [--out out/deb]

One for each catkin package, from an install space of its own, and sara-python (see deb_control.py). The workspace is
configured anew below build/deb, with Debian's interpreter and without tests. Every file bears the time of the commit:
bytecode and machine code know their sources by it.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import os
import re
import shutil
import subprocess
import time
from pathlib import Path

import deb_control
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parent.parent
PREFIX = Path('opt/sara')
MODULES = PREFIX / 'lib/python3/dist-packages'
PYTHON = '/usr/bin/python3'
SHEBANG = re.compile(rb'\A#!.*python3?\s*\n')
# Only ours and Debian's: a sourced workspace must not be frozen into the packages.
CLEAN = {
    name: value
    for name, value in os.environ.items()
    if name not in ('CMAKE_PREFIX_PATH', 'ROS_PACKAGE_PATH', 'PYTHONPATH', 'DESTDIR', 'SOURCE_DATE_EPOCH')
}


def run(log: Path, *command: object, **env: str) -> None:
    """Run a command, its output appended to the log. Raises SystemExit with the log's end where it fails."""
    with open(log, 'ab') as file:
        done = subprocess.run(
            [str(word) for word in command], cwd=ROOT, env={**CLEAN, **env}, stdout=file, stderr=subprocess.STDOUT
        )
    if done.returncode:
        last = '\n'.join(log.read_text(errors='replace').splitlines()[-40:])
        raise SystemExit(f'{last}\n{command[0]} failed: {log} has the whole of it')


def install(work: Path, packages: list[deb_control.Package], log: Path) -> None:
    """Build the workspace and install each package into a folder of its own below `work`/stage."""
    build = work / 'build'
    options = {
        'CMAKE_BUILD_TYPE': 'Release',
        'CATKIN_DEVEL_PREFIX': work / 'devel',
        'CMAKE_INSTALL_PREFIX': f'/{PREFIX}',
        'PYTHON_EXECUTABLE': PYTHON,
        'CATKIN_ENABLE_TESTING': 'OFF',
    }
    run(log, 'cmake', '-S', ROOT, '-B', build, *(f'-D{name}={value}' for name, value in options.items()))
    run(log, 'cmake', '--build', build, '--', f'-j{os.cpu_count()}')
    shutil.rmtree(work / 'stage', ignore_errors=True)
    destination = str(work / 'stage' / deb_control.BASE)
    run(log, 'cmake', '-DCMAKE_INSTALL_LOCAL_ONLY=1', '-P', build / 'cmake_install.cmake', DESTDIR=destination)
    for package in packages:
        destination = str(work / 'stage' / deb_control.debian_name(package.name))
        run(log, 'cmake', '-P', build / 'src' / package.name / 'cmake_install.cmake', DESTDIR=destination)


def pinned_names() -> list[str]:
    """What tools/python-packages.txt and tools/python-packages-alone.txt name, without what tests alone need."""
    return [*_listed('python-packages.txt'), *_listed('python-packages-alone.txt')]


def _listed(name):
    lines = (ROOT / 'tools' / name).read_text(encoding='utf-8').splitlines()
    return _wanted(line.split(' #')[0] for line in lines if line and line[0] != '#' and '# tests' not in line)


def _wanted(requirements):
    """Names of those of requirements (PEP 508) that hold on this machine."""
    found = map(Requirement, requirements)
    return [want.name for want in found if not want.marker or want.marker.evaluate({'extra': ''})]


def pinned(names: list[str], venv: Path) -> tuple[list[importlib.metadata.Distribution], set[str]]:
    """The distributions that lie in the virtual environment, of those named and all that they need, if they are not
    installed alone; the Debian packages of the rest. Raises PackageNotFoundError, and SystemExit where no Debian
    package brought one of the rest.
    """
    own, elsewhere, waiting, alone = {}, [], list(names), _listed('python-packages-alone.txt')
    while waiting:
        distribution = importlib.metadata.distribution(waiting.pop())
        path = Path(str(distribution.locate_file(''))).resolve()
        name = distribution.metadata['Name']
        if not path.is_relative_to(venv.resolve()):
            elsewhere.append(distribution)
        elif name not in own:
            own[name] = distribution
            waiting += _wanted(() if name in alone else distribution.requires or ())
    paths = sorted({str(distribution._path) for distribution in elsewhere})  # type: ignore[attr-defined]
    owners = subprocess.run(['dpkg', '-S', *paths], capture_output=True, text=True) if paths else None
    if owners and owners.returncode:
        raise SystemExit(f'neither in .venv nor from Debian: a robot would not have it\n{owners.stderr.strip()}')
    lines = owners.stdout.splitlines() if owners else []
    return [own[name] for name in sorted(own, key=str.lower)], {line.split(':')[0] for line in lines}


def copy_pinned(distributions: list[importlib.metadata.Distribution], modules: Path) -> None:
    """Copy what lies in site-packages; commands and bytecode stay behind, and what pip noted about this machine."""
    for distribution in distributions:
        for file in distribution.files or ():
            if not {'..', '__pycache__', 'RECORD', 'REQUESTED', 'direct_url.json'} & set(file.parts):
                target = modules / file
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(str(distribution.locate_file(file)), target)


def settle(stage: Path, seconds: int, log: Path) -> None:
    """Give the files of one package the interpreter that a robot has, one time, bytecode, and rights as in Debian."""
    for path in list(stage.rglob('__pycache__')):
        shutil.rmtree(path)
    for path in (stage, *stage.rglob('*')):
        if path.is_dir():
            path.chmod(0o755)
        elif not path.is_symlink():
            text = path.read_bytes()
            runs = bool(path.stat().st_mode & 0o100) and '.so' not in path.suffixes
            if runs and SHEBANG.match(text):
                path.write_bytes(SHEBANG.sub(f'#!{PYTHON}\n'.encode(), text))
            path.chmod(0o755 if runs else 0o644)
    date(stage, seconds)
    if (stage / MODULES).is_dir():
        words = f'-m compileall -q --invalidation-mode timestamp -s {stage} -p / {stage / MODULES}'
        run(log, PYTHON, *words.split())
    date(stage, seconds)


def date(folder: Path, seconds: int) -> None:
    """Set the time of all files below a folder."""
    for path in (folder, *folder.rglob('*')):
        os.utime(path, (seconds, seconds), follow_symlinks=False)


def compile_kernels(work: Path, packages: list[deb_control.Package], seconds: int, log: Path) -> None:
    """Compile the packages' kernels for any processor of this architecture, into sara-python."""
    together, modules = work / 'together', work / 'together' / MODULES
    shutil.rmtree(together, ignore_errors=True)
    for stage in (work / 'stage').iterdir():
        shutil.copytree(stage, together, copy_function=os.link, symlinks=True, dirs_exist_ok=True)
    before = set(modules.iterdir())
    users = [
        package.name for package in packages if 'ahead_of_time' in package.needs and (modules / package.name).is_dir()
    ]
    env = {'PYTHONPATH': str(modules), 'PYTHONDONTWRITEBYTECODE': '1'}
    options = ('--portable', '--installed', f'/{MODULES}')
    run(log, PYTHON, '-m', 'ahead_of_time.build', *options, modules, *users, **env)
    target = work / 'stage' / deb_control.BASE
    for path in set(modules.iterdir()) - before:
        shutil.copyfile(path, target / MODULES / path.name)
        if path.suffix == '.so':
            run(log, 'strip', '--strip-unneeded', target / MODULES / path.name)
    date(target, seconds)


def names_folder(content: bytes, folder: Path) -> bool:
    """Whether what a file holds names a folder: `/sara` is named by neither `/opt/sara` nor `/sara_nav`. Two letters
    before it are no part of a path: in bytecode they may be the type and the length of a string.
    """
    return re.search(rb'(?<![\w.-]{3})' + re.escape(bytes(folder)) + rb'(?!\.?[\w-])', content) is not None


def pack(stage: Path, control: deb_control.Control, seconds: int, out: Path, log: Path) -> None:
    """Make the .deb of a folder. Raises SystemExit where a file of it names a folder of this machine."""
    for path in stage.rglob('*'):
        if path.is_file() and names_folder(path.read_bytes(), ROOT):
            raise SystemExit(f'{path} names a folder of this machine')
    document = stage / 'usr/share/doc' / control.name / 'copyright'
    document.parent.mkdir(parents=True)
    shutil.copyfile(ROOT / 'LICENSE', document)
    size = sum(path.lstat().st_size for path in stage.rglob('*') if path.is_file())
    meta = stage / 'DEBIAN'
    meta.mkdir()
    (meta / 'control').write_text(control.text(-(-size // 1024)), encoding='utf-8')
    if any(stage.rglob('__pycache__')):
        (meta / 'prerm').write_text(deb_control.prerm(control.name), encoding='utf-8')
        (meta / 'prerm').chmod(0o755)
    date(stage, seconds)
    target = out / f'{control.name}_{control.version}_{control.architecture}.deb'
    run(log, 'dpkg-deb', '--root-owner-group', '--build', stage, target, SOURCE_DATE_EPOCH=str(seconds))


def commit_of(root: Path, now: float) -> tuple[int, str]:
    """(time (s since 1970), name) of what is built: of the commit, or now where files have been changed since or there
    is no git.
    """

    def git(*words: str) -> str:
        return subprocess.run(
            ['git', '-C', str(root), *words], capture_output=True, text=True, check=True
        ).stdout.strip()

    try:
        name = git('rev-parse', '--short=8', 'HEAD')
    except (OSError, subprocess.CalledProcessError):
        return int(now), 'unknown'
    if git('status', '--porcelain', '--untracked-files=no'):
        return int(now), f'{name}.changed'
    return int(git('log', '-1', '--format=%ct')), name


def build(out: Path, now: float) -> None:
    """Build all packages into a folder. `now`: s since 1970."""
    os.umask(0o022)
    work = ROOT / 'build' / 'deb'
    work.mkdir(parents=True, exist_ok=True)
    (work / 'CATKIN_IGNORE').touch()  # the source space is the whole folder
    log = work / 'deb.log'
    log.write_text('')
    packages = deb_control.read_packages(ROOT / 'src')
    seconds, commit = commit_of(ROOT, now)
    version = deb_control.version_of((ROOT / 'CHANGELOG.md').read_text(encoding='utf-8'), seconds, commit)
    print(f'== deb: {len(packages) + 1} packages, version {version}, into {out} (log: {log})', flush=True)
    install(work, packages, log)
    found, others = pinned(pinned_names(), ROOT / '.venv')
    copy_pinned(found, work / 'stage' / deb_control.BASE / MODULES)
    for stage in (work / 'stage').iterdir():
        settle(stage, seconds, log)
    compile_kernels(work, packages, seconds, log)
    names = [f'{distribution.metadata["Name"]} {distribution.version}' for distribution in found]
    architecture = subprocess.run(['dpkg', '--print-architecture'], capture_output=True, text=True, check=True).stdout
    controls = [deb_control.control(package, [other.name for other in packages], version) for package in packages]
    controls.append(deb_control.base_control(packages[0], version, architecture.strip(), names, others))
    made = work / 'made'
    shutil.rmtree(made, ignore_errors=True)
    made.mkdir()
    for control in controls:
        pack(work / 'stage' / control.name, control, seconds, made, log)
    shutil.rmtree(out, ignore_errors=True)  # only now: a failure leaves the earlier ones
    out.parent.mkdir(parents=True, exist_ok=True)
    shutil.move(made, out)


def main(arguments: list[str] | None = None) -> None:
    """Build all packages into a folder, which loses those of an earlier build."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').splitlines()[0])
    parser.add_argument('--out', type=Path, default=ROOT / 'out' / 'deb')
    options = parser.parse_args(arguments)
    build(options.out.resolve(), time.time())


if __name__ == '__main__':
    main()
