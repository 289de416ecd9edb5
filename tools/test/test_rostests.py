"""The runner of the rostests finds every one, and no two share a name; what leaves no result counts as failed."""

from pathlib import Path

import count_tests
import rostests


def test_every_launch_file_of_a_test_is_run_by_name():
    found = rostests.find(rostests.ROOT / 'src')
    files = {test.package / test.file for test in found}
    assert files == set((rostests.ROOT / 'src').glob('*/test/ros/*.test'))
    assert len({test.name for test in found}) == len(found)
    assert 'sara_bringup.localization_localization_ukf' in {test.name for test in found}


def test_what_leaves_no_result_has_failed(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv('PATH', f'{tmp_path}:/usr/bin:/bin')
    command = tmp_path / 'rostest'
    command.write_text('#!/bin/sh\ntest -d "$ROS_HOME" || exit 9\necho "said to the log"\nexit 3\n')
    command.chmod(0o755)
    status, *_ = rostests.run(
        rostests.RosTest(Path('/none/package'), 'test/ros/a.test', ('x:=1',)), tmp_path / 'results'
    )
    assert status == 3
    assert (tmp_path / 'results/package/package.a_x_1.log').read_text() == 'said to the log\n'
    assert count_tests.main(tmp_path / 'results') == 1
    assert capsys.readouterr().out.splitlines()[-1] == '0 passed, 1 failed, 0 skipped'
