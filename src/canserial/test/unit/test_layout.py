"""What is kept of a DBC file is what cantools reads in it, for those bytes and no others; with it cantools is not even
imported.
"""

import shutil
import subprocess
import sys

import cantools
import pytest

from canserial.dbc import layout
from canserial.dbc.bus import DBC_FOLDER, PACKAGED, BusDescription


@pytest.fixture(params=PACKAGED)
def file(request, tmp_path):
    """A packaged DBC file in a folder of its own, its bytes and what cantools reads."""
    path = tmp_path / f'{request.param}.dbc'
    shutil.copy(DBC_FOLDER / path.name, path)
    return path, path.read_bytes(), layout.Layout.of(cantools.database.load_file(str(path)))


def test_what_is_kept_is_what_was_read(file):
    path, content, read = file
    assert layout.kept(path, content) is None
    layout.keep(path, content, read)
    assert layout.kept(path, content) == read
    assert layout.kept(path, content + b' ') is None


@pytest.mark.parametrize('text', ['', '[]', '{}', '{"format": 0}', 'null', '{"format": 1, "digest": "x"}'])
def test_what_cannot_be_read_is_not_there(file, text):
    path, content, read = file
    layout.keep(path, content, read)
    next((path.parent / '__pycache__').iterdir()).write_text(text)
    assert layout.kept(path, content) is None


def test_a_folder_that_cannot_be_written_does_no_harm(file):
    path, content, read = file
    (path.parent / '__pycache__').write_text('not a folder')
    layout.keep(path, content, read)
    assert layout.kept(path, content) is None


def test_frames_pass_without_cantools():
    bus = BusDescription(DBC_FOLDER / 'sara.dbc')  # it is kept from here on, at the latest
    done = subprocess.run(
        [
            sys.executable,
            '-c',
            'import sys\nfrom canserial.dbc.bus import BusDescription\nbus = BusDescription.default()\n'
            'name, values = bus.decode(bus.encode(bus.names[0], 1.0, **{s: 0.0 for s in bus.signals(bus.names[0])}))\n'
            'print(name, "cantools" in sys.modules, bus.comment, bus.nodes, len(bus.messages), "cantools" in sys.modules)',
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == f'{bus.names[0]} False {bus.comment} {bus.nodes} {len(bus.messages)} True'
