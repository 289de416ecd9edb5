"""Parameters: those of the C++ node are read or explained; what cannot work is refused in words."""

from pathlib import Path

import pytest
import yaml

from sara_common.config import ConfigError
from sara_slam.mapping import check_config
from sara_slam.mapping.slam_config import NO_EFFECT, SlamConfig

FILE = Path(__file__).resolve().parents[2] / 'config' / 'slam_gmapping.yaml'
PEERS = (
    'inverted_laser',
    'throttle_scans',
    'base_frame',
    'map_frame',
    'odom_frame',
    'map_update_interval',
    'maxUrange',
    'maxRange',
    'sigma',
    'kernelSize',
    'lstep',
    'astep',
    'iterations',
    'lsigma',
    'ogain',
    'lskip',
    'minimumScore',
    'srr',
    'srt',
    'str',
    'stt',
    'linearUpdate',
    'angularUpdate',
    'temporalUpdate',
    'resampleThreshold',
    'particles',
    'xmin',
    'ymin',
    'xmax',
    'ymax',
    'delta',
    'llsamplerange',
    'llsamplestep',
    'lasamplerange',
    'lasamplestep',
    'transform_publish_period',
    'occ_thresh',
    'tf_delay',
)
"""Of slam_gmapping 1.4 (wiki.ros.org/gmapping)."""


def faults(**params):
    with pytest.raises(ConfigError) as refused:
        SlamConfig.from_params(params)
    return refused.value.faults


def test_the_file_of_all_parameters_holds_their_defaults():
    text = FILE.read_text()
    assert repr(SlamConfig.from_params(yaml.safe_load(text))) == repr(SlamConfig())
    assert [name for name in SlamConfig.__dataclass_fields__ if f'{name}:' not in text] == ['warnings']
    assert check_config.check(yaml.safe_load(text)) == ([], [])


@pytest.mark.parametrize('name', PEERS)
def test_each_parameter_of_the_peer_is_read_or_explained(name):
    read = name in SlamConfig.__dataclass_fields__
    assert read != (name in NO_EFFECT)
    if not read:
        (warning,) = SlamConfig.from_params({name: 1.0}).warnings
        assert warning.startswith(f'{name} has no effect: ') and NO_EFFECT[name] in warning


def test_unknown_names_are_told_and_ignored():
    assert SlamConfig.from_params({'maxurange': 8.0}).warnings == (
        'maxurange is no parameter of slam_gmapping: ignored.',
    )


@pytest.mark.parametrize(
    'params, named',
    [
        ({'delta': 0.0}, 'delta'),
        ({'delta': float('nan')}, 'delta'),
        ({'delta': True}, 'delta'),
        ({'occ_thresh': 1.5}, 'occ_thresh'),
        ({'throttle_scans': 0}, 'throttle_scans'),
        ({'throttle_scans': 1.5}, 'throttle_scans'),
        ({'lskip': -1}, 'lskip'),
        ({'linearUpdate': 'far'}, 'linearUpdate'),
        ({'linearUpdate': float('inf')}, 'linearUpdate'),
        ({'map_frame': ''}, 'map_frame'),
        ({'map_frame': 'odom'}, 'map_frame'),
        ({'xmin': 3.0}, 'xmin'),
        ({'xmin': -1e6, 'xmax': 1e6, 'ymin': -1e6, 'ymax': 1e6}, 'xmin'),
        ({'maxRange': 5.0, 'maxUrange': 8.0}, 'maxUrange'),
        ({'loop_closing': 'perhaps'}, 'loop_closing'),
        ({'transform_publish_period': -0.1}, 'transform_publish_period'),
        ({'tf_delay': float('nan')}, 'tf_delay'),
    ],
)
def test_what_cannot_work_is_refused_in_words(params, named):
    (sentence,) = faults(**params)
    assert named in sentence and ('allowed' in sentence or 'must' in sentence or 'more than' in sentence)


def test_every_fault_is_told_at_once():
    assert len(faults(delta=-1.0, srr=-1.0, loop_together=0)) == 3


def test_frames_lose_their_slash_and_the_delay_follows_the_period():
    config = SlamConfig.from_params({'map_frame': '/map', 'transform_publish_period': 0.2})
    assert (config.map_frame, config.delay) == ('map', 0.2)
    assert SlamConfig.from_params({'tf_delay': 0.5}).delay == 0.5


@pytest.mark.parametrize(
    'params, word',
    [
        ({'linearUpdate': 2.0}, 'share little'),
        ({'angularUpdate': 0.0}, 'at rest'),
        ({'transform_publish_period': 0.0}, 'not published'),
        ({'sigma': 0.02}, 'between the cells'),
        ({'minimumScore': 50.0}, 'minimum_response'),
        ({'particles': 30}, 'no particles'),
    ],
)
def test_what_is_doubtful_is_warned_of(params, word):
    errors, warnings = check_config.check(params)
    assert errors == [] and len(warnings) == 1 and word in warnings[0]


def test_the_command_prints_errors_first_and_gives_a_status(tmp_path, capsys):
    path = tmp_path / 'mine.yaml'
    for text, status, first in (
        ('slam_gmapping: {delta: 0.05}', 0, 'nothing to mend was found'),
        ('{delta: -1, particles: 30}', 1, 'error: delta is -1'),
        ('{particles: 30}', 0, 'warning: particles has no effect'),
    ):
        path.write_text(text)
        with pytest.raises(SystemExit) as ended:
            check_config.main([str(path)])
        assert ended.value.code == status and capsys.readouterr().out.startswith(first)
    for text in ('- 1', 'a: [', ''):
        path.write_text(text)
        with pytest.raises(SystemExit) as ended:
            check_config.main([str(path)])
        assert ended.value.code == 2 and 'check_config: ' in capsys.readouterr().err
