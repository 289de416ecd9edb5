"""Compiles the kernels of packages: `python3 -m ahead_of_time.build FOLDER PACKAGE...`, with FOLDER on the path that
will be searched. `--portable`: for every processor of this architecture, not just for this one. `--installed PLACE`:
what lies in FOLDER will run from there.

The modules that say `@kernel` are imported and their `warm()` is called; what is called then, and with which types, is
compiled into one object per package (numba.pycc), with the index that library.py reads beside it. What is fresh is left
alone.
"""

import argparse
import ast
import importlib
import importlib.util
import json
import multiprocessing
import os
import sys
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import connection
from pathlib import Path

from . import library
from .signatures import types_of


@dataclass(frozen=True)
class Target:
    """Where machine code goes (`folder`), where that will be when it runs, and whether any processor will do."""

    folder: Path
    installed: Path | None = None
    portable: bool = False

    def place(self, path: str) -> str:
        """Where a source file will be when its machine code runs."""
        if self.installed is None or not Path(path).is_relative_to(self.folder):
            return path
        return str(self.installed / Path(path).relative_to(self.folder))


class Recorder:
    """Takes in every kernel that is made, and with which types Python calls it."""

    def __init__(self, target: Target):
        self.kernels, self._target = [], target

    def record(self, function: Callable, options: dict) -> 'Recorded':
        """A kernel that remembers its calls."""
        place = self._target.place(function.__code__.co_filename)  # what it raises says where
        function.__code__ = function.__code__.replace(co_filename=place)
        self.kernels.append(Recorded(function, options))
        return self.kernels[-1]


class Recorded:
    """numba's dispatcher; `called`: the signatures that Python called it with."""

    def __init__(self, function: Callable, options: dict):
        from numba import njit

        self.function, self.dispatcher, self.called = (
            function,
            njit(**options)(function),
            {},
        )  # numba's cache does not see all changes
        self.py_func, self.targetoptions = function, self.dispatcher.targetoptions  # as numba's inlining looks for them

    def __call__(self, *arguments):
        from numba import typeof

        result = self.dispatcher(*arguments)
        signature = self.dispatcher.overloads[tuple(map(typeof, arguments))].signature
        self.called[types_of(signature)] = signature
        return result


def kernel_modules(package: str) -> dict[str, Path]:
    """{name: path} of the package's modules that say `from ahead_of_time import kernel`."""
    found = {}
    for root in map(Path, importlib.import_module(package).__path__):
        for path in sorted(root.rglob('*.py')):
            if any('ahead_of_time.kernel' in names for names in _imports(path)):
                found['.'.join([package, *path.relative_to(root).with_suffix('').parts])] = path.resolve()
    return found


def _imports(path):
    """For each import of a source file the set of the modules' names that it may mean."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = '.' * node.level + (node.module or '')
            yield {base} | {f'{base}{"" if base.endswith(".") else "."}{alias.name}' for alias in node.names}


def sources_of(name: str, packages: list[str]) -> list[str]:
    """Paths of a module and of all that it imports from the packages, directly or not: what its machine code may
    depend on.
    """
    found, waiting = {}, [name]
    while waiting:
        name = waiting.pop()
        spec = _spec(name)
        if name in found or spec is None or not spec.origin:
            continue
        found[name] = os.path.realpath(spec.origin)
        parent = name if spec.submodule_search_locations else name.rpartition('.')[0]
        for names in _imports(Path(spec.origin)):
            names = {importlib.util.resolve_name(n, parent) if n.startswith('.') else n for n in names}
            waiting += [n for n in names if n.split('.')[0] in packages]
    return sorted(found.values())


def _spec(name):
    try:
        return importlib.util.find_spec(name)
    except (ImportError, AttributeError):  # a function's name, not a module's
        return None


def record(modules: dict) -> list[Recorded]:
    """Import the modules and warm them; returns what became of their kernels, a list of Recorded."""
    loaded = [importlib.import_module(name) for name in modules]
    for module in loaded:
        if hasattr(module, 'warm'):
            module.warm()
    return [kernel for kernel in library.recorder.kernels if kernel.function.__module__ in modules]


def teach_numba() -> None:
    """Tell numba's typing what a Recorded is where one kernel calls another."""
    from numba.core import types
    from numba.extending import typeof_impl

    @typeof_impl.register(Recorded)
    def _typeof(value, _context):
        return types.Dispatcher(value.dispatcher)


def mend_pycc() -> None:
    """Give each function that pycc compiles flags of its own: inlining turns some off, for all that are compiled after
    it.
    """
    from numba.pycc import compiler

    compile_one = compiler.compile_extra

    def compile_extra(typing, target, function, arguments, result, flags, **rest):
        return compile_one(typing, target, function, arguments, result, flags.copy(), **rest)

    compiler.compile_extra = compile_extra


def compile_package(target: Target, package: str, modules: dict, packages: list[str]) -> dict:
    """Compile a package's kernels into an object in the target's folder; returns the package's entry of the index.
    `packages`: names of all packages whose sources its machine code may depend on.
    """
    from numba.pycc import CC

    folder = target.folder
    stamps = {
        name: {target.place(path): library.stamp(path) for path in sources_of(name, packages)} for name in modules
    }
    object_code = CC(library.object_name(package))
    object_code.target_cpu, object_code.output_dir = '' if target.portable else 'host', str(folder)
    entry = {
        'object': object_code.output_file,
        'modules': {name: {'sources': stamps[name], 'kernels': {}} for name in modules},
    }
    for kernel in record(modules):
        name = kernel.function.__module__
        variants = entry['modules'][name]['kernels'][
            kernel.function.__name__
        ] = []  # stays empty for what compiled code alone calls
        for number, ((types, classes), signature) in enumerate(sorted(kernel.called.items())):
            symbol = f'{name.replace(".", "_")}__{kernel.function.__name__}__{number}'
            object_code.export(symbol, signature)(kernel.function)
            variants.append([types, symbol, *classes])
    with tempfile.TemporaryDirectory(dir=folder) as scratch:  # what runs keeps the file that it has open
        object_code.output_dir = scratch
        object_code.compile()
        os.replace(os.path.join(scratch, entry['object']), folder / entry['object'])
    return entry


def compile_aloud(target: Target, package: str, modules: dict, packages: list[str], told: Path) -> None:
    """compile_package, and say so; the entry goes to a file `told`."""
    print(f'compiling the kernels of {package}', flush=True)
    told.write_text(json.dumps(compile_package(target, package, modules, packages)))


def compile_dispatch(folder: Path) -> None:
    """Compile dispatch.c into the folder, unless it is there and newer."""
    from numba.pycc.platform import Toolchain

    source, tools = Path(__file__).with_name('dispatch.c'), Toolchain()
    target = folder / tools.get_ext_filename(library.DISPATCH)
    if target.exists() and target.stat().st_mtime > source.stat().st_mtime:
        return
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        objects = tools.compile_objects(
            [str(source)], scratch, include_dirs=tools.get_python_include_dirs(), extra_cflags=['-O2']
        )
        tools.link_shared(os.path.join(scratch, target.name), objects)
        os.replace(os.path.join(scratch, target.name), target)


def build(target: Target, packages: list[str]) -> list[str]:
    """Compile what is not fresh; names of the packages whose kernels could not be compiled."""
    path, machine = target.folder / library.INDEX, library.machine(target.portable)
    index = json.loads(path.read_text()) if path.exists() else {}
    if index.get('machine') != machine:
        index = {'machine': machine, 'packages': {}}
    library.recorder = Recorder(target)  # before anything with a kernel is imported
    warnings.simplefilter('ignore')  # pycc is what there is; it warns that it will be replaced one day
    modules = {package: kernel_modules(package) for package in packages}
    known = index['packages']
    stale = [
        package
        for package in packages
        if modules[package]
        and (
            package not in known
            or set(known[package]['modules']) != set(modules[package])
            or not all(map(library.fresh, known[package]['modules'].values()))
        )
    ]
    compile_dispatch(target.folder)

    def done(package, entry):  # an interrupted build goes on from here
        known[package] = entry
        write_index(path, index)

    failed = compile_all(target, {package: modules[package] for package in stale}, packages, done) if stale else []
    write_index(path, index)
    return failed


def compile_all(target: Target, modules: dict, packages: list[str], done: Callable[[str, dict], None]) -> list[str]:
    """Compile packages, {name: modules}, each in a process of its own, as many at a time as there are cores, largest
    first; `done(package, entry)` for each that was compiled. Names of the others: whatever is wrong with one, or ends
    its process, they are compiled.
    """
    teach_numba()
    mend_pycc()
    waiting = sorted(modules, key=lambda name: sum(path.stat().st_size for path in modules[name].values()))
    context, running, failed = multiprocessing.get_context('fork'), {}, []
    with tempfile.TemporaryDirectory() as folder:
        while waiting or running:
            while waiting and len(running) < os.cpu_count():
                package = waiting.pop()
                arguments = (target, package, modules[package], packages, Path(folder) / package)
                process = context.Process(target=compile_aloud, args=arguments, daemon=True)
                process.start()
                running[process.sentinel] = package, process
            for sentinel in connection.wait(running):
                package, process = running.pop(sentinel)
                process.join()
                if process.exitcode == 0:
                    done(package, json.loads((Path(folder) / package).read_text()))
                    continue
                failed.append(package)
                if process.exitcode < 0:  # nothing else tells of it: a machine with too little memory kills
                    print(f'signal {-process.exitcode} ended the compiling of {package}', file=sys.stderr)
    return failed


def write_index(path: Path, index: dict) -> None:
    """Replace the index at once: whoever reads it meanwhile has the old one."""
    new = path.with_suffix('.new')
    new.write_text(json.dumps(index, indent=1))
    os.replace(new, path)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description='Compile the kernels of packages.')
    parser.add_argument('--portable', action='store_true', help='for every processor of this architecture')
    parser.add_argument('--installed', type=Path, metavar='PLACE', help='what lies in FOLDER will run from there')
    parser.add_argument('folder', type=Path)
    parser.add_argument('packages', nargs='+')
    arguments = parser.parse_args()
    target = Target(arguments.folder.resolve(), arguments.installed, arguments.portable)
    failed = build(target, arguments.packages)
    if failed:
        sys.exit(f'the kernels of {", ".join(failed)} could not be compiled')


if __name__ == '__main__':
    main()
