"""Settings of the adapter: what python-can is told, and every refusal by name."""

import can
import pytest

from canserial.adapter.adapter_config import LISTEN_ONLY, NO_BITRATE, AdapterConfig, Filter
from sara_common.config import ConfigError


def refused(sentence, **settings):
    with pytest.raises(ConfigError, match=sentence):
        AdapterConfig(**settings)


def test_faults_are_named_all_at_once():
    refused(
        "interface is 'usb'.*port is ''.*bitrate is -1.*transmit_queue is 0.*transmit_max_age is nan.*"
        'listen_only is 1.*filters is 3',
        interface='usb',
        port='',
        bitrate=-1,
        transmit_queue=0,
        transmit_max_age=float('nan'),
        listen_only=1,
        filters=3,
    )


@pytest.mark.parametrize(
    'sentence, settings',
    [
        ('bitrate is 123, allowed with slcan are 10000', {'bitrate': 123}),
        (
            'tty_baudrate is 9600, allowed with slcan only, not with virtual',
            {'interface': 'virtual', 'tty_baudrate': 9600},
        ),
        ('tty_baudrate is 0', {'tty_baudrate': 0}),
        (
            'listen_only is True, allowed with .*slcan.*, not with socketcan: set it with "ip link',
            {'interface': 'socketcan', 'listen_only': True},
        ),
        ('listen_only is True, allowed with .*, not with gs_usb', {'interface': 'gs_usb', 'listen_only': True}),
        (r"filters\[0\] is \{'id': 1\}, allowed are can_id, can_mask", {'filters': [{'id': 1}]}),
        (
            r'filters\[1\].can_id is 2048, allowed are whole numbers of 0 to 0x7FF',
            {'filters': [{'can_id': 1, 'can_mask': 1}, {'can_id': 0x800, 'can_mask': 0, 'extended': False}]},
        ),
        (r"filters\[0\].can_mask is '1'", {'filters': [{'can_id': 1, 'can_mask': '1'}]}),
        (r"filters\[0\].extended is 'no'", {'filters': [{'can_id': 1, 'can_mask': 1, 'extended': 'no'}]}),
        ("options holds 'channel', allowed is the parameter port instead", {'options': {'channel': 'x'}}),
        ("options holds 'bitrat', allowed with slcan are .*rtscts", {'options': {'bitrat': 1}}),
        (
            "options holds 'hop_limt', allowed with udp_multicast are .*hop_limit",
            {'interface': 'udp_multicast', 'options': {'hop_limt': 1}},
        ),
        ('options is 3', {'options': 3}),
    ],
)
def test_what_the_interface_cannot_do_is_refused_by_name(sentence, settings):
    refused(sentence, **settings)


def test_what_python_can_is_told():
    config = AdapterConfig(
        bitrate=800000, listen_only=True, filters=({'can_id': 0x100, 'can_mask': 0x700},), options={'rtscts': True}
    )
    assert config.filters == (Filter(0x100, 0x700),)
    keywords = config.keywords()
    assert (
        keywords['bitrate'] == 750000
        and keywords['tty_baudrate'] == 115200
        and keywords['listen_only']
        and keywords['rtscts']
    )
    assert keywords['can_filters'] == [{'can_id': 0x100, 'can_mask': 0x700}]
    cantact = AdapterConfig(interface='cantact', port=0, listen_only=True).keywords()
    assert cantact['monitor'] is True and cantact['channel'] == '0'


def test_a_bit_rate_that_the_interface_does_not_set_is_said():
    assert AdapterConfig().remarks == ()
    for name in NO_BITRATE:
        config = AdapterConfig(interface=name, port='x')
        assert f'which {name} does not set' in config.remarks[0] and 'bitrate' not in config.keywords()


def test_the_tables_name_interfaces_that_exist():
    assert (LISTEN_ONLY.keys() | NO_BITRATE.keys()) <= can.VALID_INTERFACES
