#!/usr/bin/env python3
"""`make house`: how the code is laid out: packages, their rooms, lines, and who imports whom.

A room is what stands at the top of a package: a sub-package or a module. An arrow is an import. Prints a table, the
circles, and the figures that the house is held to; writes a picture. Exit status 1 where there is a circle or a figure
is over its limit.
"""

import argparse
import ast
import sys
from collections import defaultdict
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LABORATORY = 'sara_lab'
MAX_ROOMS, MAX_MODULE_LINES, MAX_PRODUCT_LINES = 12, 300, 40_000
LONG_FUNCTION_LINES, MAX_LONG_FUNCTIONS = 40, 10
MANY_PARAMETERS, MAX_WITH_MANY_PARAMETERS = 7, 40
Graph = dict[str, set[str]]


@dataclass(frozen=True)
class Function:
    """A function or method: where it stands, its lines without the docstring, its parameters without self, and whether
    a public one has a hint for every parameter and for what it returns (None: it is not public).
    """

    where: str
    lines: int
    parameters: int
    hinted: bool | None


@dataclass(frozen=True)
class Module:
    """A source file by its dotted name; `imports`: dotted names it may import (modules, or names in them)."""

    name: str
    lines: int
    imports: frozenset[str]
    functions: tuple[Function, ...]

    @property
    def package(self) -> str:
        """The package's name."""
        return self.name.split('.')[0]

    @property
    def room(self) -> str:
        """`package.room`: the sub-package or module at the package's top that it is, or is in."""
        return '.'.join(self.name.split('.')[:2])


@dataclass
class House:
    """The modules of all packages by dotted name."""

    modules: dict[str, Module] = field(default_factory=dict)

    @cached_property
    def arrows(self) -> Graph:
        """{module: modules it imports}."""
        return {
            module.name: {known for name in module.imports if (known := self._known(name)) and known != module.name}
            for module in self.modules.values()
        }

    def _known(self, name: str) -> str | None:
        """The module that a dotted name is, or is defined in."""
        while name and name not in self.modules:
            name = name.rpartition('.')[0]
        return name or None

    def folded(self, of) -> Graph:
        """The arrows between what `of` (a Module -> a name) makes of the modules."""
        found: Graph = defaultdict(set)
        for name, targets in self.arrows.items():
            here = of(self.modules[name])
            found[here] |= {there for target in targets if (there := of(self.modules[target])) != here}
        return dict(found)

    @property
    def packages(self) -> list[str]:
        """Their names, those that know the most first."""
        graph = closure(self.folded(lambda module: module.package))
        return sorted(graph, key=lambda name: (-len(graph[name]), name))

    def rooms(self, package: str) -> dict[str, int]:
        """{room: lines}, largest first."""
        found: dict[str, int] = defaultdict(int)
        for module in self.modules.values():
            if module.package == package and module.name != package:
                found[module.room.split('.')[1]] += module.lines
        return dict(sorted(found.items(), key=lambda item: -item[1]))

    @property
    def functions(self) -> list[Function]:
        """All functions."""
        return [function for module in self.modules.values() for function in module.functions]


def closure(graph: Graph) -> Graph:
    """{node: all that can be reached from it}."""
    found = {}
    for node in graph:
        seen, waiting = set(), [node]
        while waiting:
            new = graph.get(waiting.pop(), set()) - seen
            seen |= new
            waiting += new
        found[node] = seen
    return found


def circles(graph: Graph) -> list[tuple[str, ...]]:
    """Groups of nodes that reach each other."""
    reached = closure(graph)
    groups = {
        tuple(sorted(other for other in reached[node] if node in reached.get(other, set())))
        for node in reached
        if node in reached[node]
    }
    return sorted(groups)


def read_house(root: Path = ROOT) -> House:
    """Parse the sources of all packages below `root`/src."""
    house = House()
    for base in sorted((root / 'src').glob('*/src/*')):
        for path in sorted(base.rglob('*.py')):
            parts = [base.name, *path.relative_to(base).with_suffix('').parts]
            is_package = parts[-1] == '__init__'
            name = '.'.join(parts[:-1] if is_package else parts)
            text = path.read_text()
            tree = ast.parse(text)
            functions = tuple(_functions(tree, name))
            imports = frozenset(_imports(tree, name if is_package else name.rpartition('.')[0]))
            house.modules[name] = Module(name, text.count('\n'), imports, functions)
    return house


def _imports(tree: ast.Module, package: str):
    """Dotted names that a source may import; `package`: what its relative imports start from."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package.split('.')[: len(package.split('.')) - node.level + 1] if node.level else []
            module = '.'.join([*base, *([node.module] if node.module else [])])
            yield from (f'{module}.{alias.name}' for alias in node.names)


def _functions(tree: ast.Module, name: str):
    """Every function of a module with its figures."""
    for node in ast.walk(tree):
        for child in getattr(node, 'body', []) if isinstance(node, (ast.Module, ast.ClassDef)) else ():
            if isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef)):
                yield _function(child, name, node.name if isinstance(node, ast.ClassDef) else None)


def _function(node: ast.FunctionDef, module: str, owner: str | None) -> Function:
    spec = node.args
    static = any(isinstance(mark, ast.Name) and mark.id == 'staticmethod' for mark in node.decorator_list)
    all_of_them = [*spec.posonlyargs, *spec.args, *spec.kwonlyargs]
    parameters = all_of_them[1:] if owner and not static else all_of_them
    first = node.body[1] if ast.get_docstring(node) and len(node.body) > 1 else node.body[0]
    public = not (node.name.startswith('_') or (owner or '').startswith('_'))
    hinted = node.returns is not None and all(argument.annotation for argument in parameters)
    where = '.'.join(part for part in (module, owner, node.name) if part)
    return Function(where, node.end_lineno - first.lineno + 1, len(parameters), hinted if public else None)


def figures(house: House) -> list[tuple[str, float, float, list[str]]]:
    """(what, figure, limit, the worst of it) of what the house is held to."""
    product = sum(module.lines for module in house.modules.values() if module.package != LABORATORY)
    rooms = {package: len(house.rooms(package)) for package in house.packages}
    long_modules = sorted((m for m in house.modules.values() if m.lines > MAX_MODULE_LINES), key=lambda m: -m.lines)
    long_functions = sorted((f for f in house.functions if f.lines > LONG_FUNCTION_LINES), key=lambda f: -f.lines)
    many = sorted((f for f in house.functions if f.parameters >= MANY_PARAMETERS), key=lambda f: -f.parameters)
    widest = max(rooms, key=rooms.get)
    return [
        ("rooms at a package's top", rooms[widest], MAX_ROOMS, [widest]),
        (f'modules over {MAX_MODULE_LINES} lines', len(long_modules), 0, [f'{m.name} {m.lines}' for m in long_modules]),
        (f'lines without {LABORATORY}', product, MAX_PRODUCT_LINES, []),
        (
            f'functions over {LONG_FUNCTION_LINES} lines (docstring apart)',
            len(long_functions),
            MAX_LONG_FUNCTIONS,
            [f'{f.where} {f.lines}' for f in long_functions],
        ),
        (
            f'functions with {MANY_PARAMETERS} or more parameters',
            len(many),
            MAX_WITH_MANY_PARAMETERS,
            [f'{f.where} {f.parameters}' for f in many],
        ),
    ]


def hinted(house: House, package: str) -> float:
    """The share of the package's public functions with all their hints."""
    public = [
        function.hinted
        for module in house.modules.values()
        if module.package == package
        for function in module.functions
        if function.hinted is not None
    ]
    return sum(public) / len(public) if public else 1.0


def all_circles(house: House) -> list[tuple[str, ...]]:
    """Circles among packages, among the rooms of each, and among modules."""
    graphs = [house.folded(of) for of in (lambda m: m.package, lambda m: m.room)] + [house.arrows]
    return [circle for graph in graphs for circle in circles(graph)]


def table(house: House) -> str:
    """The packages and their rooms as text."""
    lines, packages = [], house.folded(lambda module: module.package)
    rooms = house.folded(lambda module: module.room)
    for package in house.packages:
        inside = house.rooms(package)
        total = sum(module.lines for module in house.modules.values() if module.package == package)
        knows = ', '.join(sorted(packages[package])) or 'none of ours'
        lines.append(f'\n{package}: {total} lines, {hinted(house, package):.0%} with type hints; imports {knows}')
        for room, size in inside.items():
            knows = sorted(n.split('.')[1] for n in rooms.get(f'{package}.{room}', ()) if n.startswith(f'{package}.'))
            lines.append(f'  {room:22} {size:6}  {"-> " + ", ".join(knows) if knows else ""}')
    return '\n'.join(lines).lstrip()


def picture(house: House, path: Path) -> None:
    """Draw the packages as boxes with their rooms, importers above what they import, and a line for each import."""
    import matplotlib

    matplotlib.use('Agg')
    from matplotlib import pyplot

    levels = _levels(house.folded(lambda module: module.package))
    figure, axes = pyplot.subplots(figsize=(16, 1.9 * (1 + max(levels.values()))))
    boxes = {}
    for level in range(1 + max(levels.values())):
        names = sorted(name for name, at in levels.items() if at == level)
        for column, name in enumerate(names):
            boxes[name] = ((column + 0.5) / len(names), level)
    for name, targets in house.folded(lambda module: module.package).items():
        for target in targets:
            axes.plot(*zip(boxes[name], boxes[target]), color='tab:blue', alpha=0.35, zorder=1)
    for name, (x, y) in boxes.items():
        rooms = house.rooms(name)
        total = sum(module.lines for module in house.modules.values() if module.package == name)
        words = [f'{room} {size}' for room, size in rooms.items()]
        rows = [' · '.join(words[start : start + 3]) for start in range(0, len(words), 3)]
        text = '\n'.join([f'$\\bf{{{name.replace("_", chr(92) + "_")}}}$  {total} lines', *rows])
        axes.text(
            x, y, text, ha='center', va='center', fontsize=8, bbox={'boxstyle': 'round', 'facecolor': 'white'}, zorder=2
        )
    axes.set(xlim=(0.0, 1.0), ylim=(-0.6, max(levels.values()) + 0.6))
    axes.axis('off')
    axes.set_title('Packages, their rooms with lines of code, and a line down to each package they import')
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110, bbox_inches='tight')
    pyplot.close(figure)


def _levels(graph: Graph) -> dict[str, int]:
    """{node: the longest path below it}; in a circle all are at one level."""
    reached, found = closure(graph), {}
    for node in sorted(graph, key=lambda name: len(reached[name])):
        below = [found[other] for other in graph[node] if other in found and node not in reached[other]]
        found[node] = 1 + max(below, default=-1)
    return found


def main() -> None:
    """Exit status 1 where there is a circle or a figure is over its limit."""
    parser = argparse.ArgumentParser(prog='house', description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument('--out', type=Path, default=ROOT / 'out' / 'house.png', help='the picture')
    parser.add_argument('--all', action='store_true', help='name everything that is over a limit, not the worst ten')
    arguments = parser.parse_args()
    house = read_house()
    print(table(house), '\n')
    found = all_circles(house)
    for circle in found:
        print('circle:', ' - '.join(circle))
    print(f'{len(found)} circles')
    over = bool(found)
    for what, figure, limit, worst in figures(house):
        over |= figure > limit
        print(f'{what}: {figure} (at most {limit})')
        for line in worst if arguments.all else worst[:10] if figure > limit else ():
            print(f'  {line}')
    picture(house, arguments.out)
    print(f'picture: {arguments.out}')
    sys.exit(over)


if __name__ == '__main__':
    main()
