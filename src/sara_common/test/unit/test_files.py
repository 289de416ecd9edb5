"""Files are written whole or not at all."""

import os

import pytest

from sara_common.files import write_whole


@pytest.mark.parametrize('data', ('Größe: 1\n', b'\x00\xff'))
@pytest.mark.parametrize('mode', (0o600, 0o644))
def test_it_is_there_alone_with_its_permissions(tmp_path, data, mode):
    path = tmp_path / 'below' / 'file'
    for _ in range(2):  # a new one, and in the place of one
        write_whole(path, data, mode)
        assert path.read_bytes() == (data.encode() if isinstance(data, str) else data)
        assert path.stat().st_mode & 0o777 == mode and list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize('step', ('fsync', 'chmod', 'replace'))
def test_what_fails_leaves_what_was_there(tmp_path, monkeypatch, step):
    path = tmp_path / 'file'
    write_whole(path, 'old')

    def full(*_):
        raise OSError('no space')

    monkeypatch.setattr(os, step, full)
    with pytest.raises(OSError, match='no space'):
        write_whole(path, 'new')
    assert path.read_text() == 'old' and list(tmp_path.iterdir()) == [path]
