"""The documents against the source tree: links, commands, files and make targets that a page names are there."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ('*.md', 'docs/**/*.md', 'src/**/*.md', 'tools/**/*.md')
PAGES = sorted(path for folder in FOLDERS for path in ROOT.glob(folder))

FENCE = re.compile(r'^(```|~~~).*?^\1', re.MULTILINE | re.DOTALL)
INLINE_CODE = re.compile(r'`[^`\n]*`')
LINK = re.compile(r'!?\[[^\]]*\]\(\s*<?([^)\s>]+)>?[^)]*\)')
HEADING = re.compile(r'^#{1,6}\s+(.*?)\s*#*$', re.MULTILINE)
RUN = re.compile(r'\b(rosrun|roslaunch)\s+(?:--\S+\s+)*([a-z]\w*)\s+(\w[\w.]*)')
TARGET = re.compile(r'`make ([a-z]+)\b')
FILE = re.compile(r'(?<![\w./$~-])((?:src|tools|docs)/[\w./-]*\w)')
MODULE = re.compile(r'(?<![\w./$-])((?:sara_[a-z]+|canserial|ahead_of_time)(?:\.[a-zA-Z_]\w*)+)(?![\w/])')
ENDINGS = {'cfg', 'dbc', 'json', 'launch', 'md', 'py', 'yaml'}
COMMIT = re.compile(r'\b(?=[0-9a-f]*[0-9])(?=[0-9a-f]*[a-f])[0-9a-f]{7,40}\b')


def anchors(text):
    """Anchors of a page's headings as GitHub makes them: lower case, hyphens for spaces, -1, -2 if repeated."""
    names = []
    for heading in HEADING.findall(FENCE.sub('', text)):
        plain = re.sub(r'\[([^\]]*)\]\([^)]*\)', r'\1', heading)
        name = re.sub(r'[^\w\- ]', '', plain.lower()).replace(' ', '-')
        repeated = sum(other == name or re.fullmatch(re.escape(name) + r'-\d+', other) is not None for other in names)
        names.append(f'{name}-{repeated}' if repeated else name)
    return names


def broken_links(page):
    """Targets of a page's relative links and images that are no file, or no heading of it."""
    prose = INLINE_CODE.sub('', FENCE.sub('', page.read_text()))
    for target in LINK.findall(prose):
        if re.match(r'[a-z][a-z+.-]*:', target):  # a scheme: elsewhere
            continue
        name, _, anchor = target.partition('#')
        file = (page.parent / name).resolve() if name else page
        if not file.exists() or anchor and (file.suffix != '.md' or anchor not in anchors(file.read_text())):
            yield target


def programs(package):
    """Names that `rosrun PACKAGE` finds, by the package's CMakeLists.txt."""
    cmake = re.sub(r'#.*', '', (package / 'CMakeLists.txt').read_text())
    calls = re.findall(r'catkin_install_python\(\s*PROGRAMS\s+(.*?)\s+DESTINATION', cmake, re.DOTALL)
    return {Path(program).name for call in calls for program in call.split()}


def missing_commands(text, src=ROOT / 'src'):
    """Each `rosrun PACKAGE NAME` and `roslaunch PACKAGE FILE` of a page that one of our packages has not."""
    for command, name, what in RUN.findall(text):
        package, what = src / name, what.rstrip('.')
        if what.isupper() or not (package / 'CMakeLists.txt').exists():  # PLACE stands for a name
            continue
        there = what in programs(package) if command == 'rosrun' else next(package.rglob(what), None) is not None
        if not there:
            yield f'{command} {name} {what}'


def missing_files(text, root=ROOT):
    """Paths below src, tools or docs that a page's code names, as from the root, and that are not there."""
    code = ' '.join(re.findall(r'`[^`\n]+`|^ {4}.*$', text, re.MULTILINE))
    return [path for path in FILE.findall(code) if not any(root.glob(path)) and 'PKG' not in path]


def missing_modules(text, src=ROOT / 'src'):
    """Dotted names in a page's code, such as `sara_nav.maps.map_io`, whose package or module is not there."""
    for name in MODULE.findall(' '.join(re.findall(r'`[^`\n]+`|^ {4}.*$', text, re.MULTILINE))):
        package, *parts = name.split('.')
        folder = src / package / 'src' / package
        if not folder.exists() or parts[-1] in ENDINGS:  # a package of others; a file
            continue
        while parts and (folder / parts[0]).is_dir():
            folder = folder / parts.pop(0)
        if parts and not (folder / f'{parts[0]}.py').exists() and parts[0] not in imported(folder / '__init__.py'):
            yield name


def imported(module):
    """Names that a module imports."""
    tree = ast.parse(module.read_text() if module.exists() else '')
    froms = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom))
    return {alias.asname or alias.name for node in froms for alias in node.names}


def commits(text):
    """What looks like the hash of a commit."""
    return COMMIT.findall(text)


def page_id(path):
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize('page', PAGES, ids=page_id)
def test_every_link_leads_to_a_file_and_heading(page):
    assert list(broken_links(page)) == []


@pytest.mark.parametrize('page', PAGES, ids=page_id)
def test_every_command_and_file_named_is_there(page):
    text = page.read_text()
    assert list(missing_commands(text)) == []
    assert list(missing_modules(text)) == []
    targets = re.search(r'^\.PHONY:(.*)', (ROOT / 'Makefile').read_text(), re.MULTILINE).group(1).split()
    assert [name for name in TARGET.findall(text) if name not in targets] == []
    if page.parent in (ROOT, ROOT / 'docs'):  # a package's pages name files as from the package
        assert missing_files(text) == []


@pytest.mark.parametrize('page', [page for page in PAGES if page.name != 'CHANGELOG.md'], ids=page_id)
def test_no_page_names_a_commit(page):
    assert commits(page.read_text()) == []


def test_every_picture_is_shown_on_a_page():
    shown = {(page.parent / target).resolve() for page in PAGES for target in LINK.findall(page.read_text())}
    assert sorted({*ROOT.glob('docs/**/*.png'), *ROOT.glob('src/*/docs/**/*.png')} - shown) == []


def test_what_is_broken_is_found(tmp_path):
    (tmp_path / 'other.md').write_text('# A `b` (c)\n## Twice\n## Twice\n')
    page = tmp_path / 'page.md'
    page.write_text(
        '[1](other.md#a-b-c) [2](other.md#twice-1) [3](https://example.org/x) `[4](code.md)` [5](#here)\n# Here\n'
        '[6](gone.md) ![7](gone.png) [8](other.md#nowhere) [9](#there)\n```\n[10](fenced.md)\n```\n'
    )
    assert list(broken_links(page)) == ['gone.md', 'gone.png', 'other.md#nowhere', '#there']


def test_missing_commands_and_files_are_found(tmp_path):
    (tmp_path / 'src/robot/launch').mkdir(parents=True)
    (tmp_path / 'src/robot/launch/all.launch').touch()
    cmake = 'catkin_install_python(PROGRAMS nodes/drive\n  nodes/look.py\n  DESTINATION x)\n'
    (tmp_path / 'src/robot/CMakeLists.txt').write_text(cmake)
    text = (
        'rosrun robot drive, rosrun robot look.py. rosrun robot PLACE, rosrun robot fly, rosrun rviz rviz; '
        'roslaunch robot all.launch, roslaunch robot no.launch'
    )
    assert list(missing_commands(text, tmp_path / 'src')) == ['rosrun robot fly', 'roslaunch robot no.launch']
    text = '`src/robot/launch` and `src/robot/gone.py`, src/prose.py\n\n    python3 src/robot/too.py\n'
    assert missing_files(text, tmp_path) == ['src/robot/gone.py', 'src/robot/too.py']


def test_missing_modules_are_found(tmp_path):
    (tmp_path / 'canserial/src/canserial/dbc').mkdir(parents=True)
    (tmp_path / 'canserial/src/canserial/dbc/bus.py').touch()
    (tmp_path / 'canserial/src/canserial/__init__.py').write_text('from canserial.dbc.bus import Bus')
    text = (
        '`canserial.dbc.bus.Bus(path)` `canserial.Bus` canserial.prose `canserial.bus` `canserial.dbc.gone` `sara_x.y`'
    )
    assert list(missing_modules(text, tmp_path)) == ['canserial.bus', 'canserial.dbc.gone']


def test_hashes_are_told_from_words_and_numbers():
    assert commits('at d6e006d, 3a2a0017 and 1000000 effaced 0x80000001 facade') == ['d6e006d', '3a2a0017']
