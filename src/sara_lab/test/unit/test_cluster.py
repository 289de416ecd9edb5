"""Work shared out among a cluster's workers: where it may be asked, whose workers do it, and what comes back."""

import functools
import sys
from concurrent.futures import CancelledError

import distributed
import pytest

from sara_lab.campaign import campaign
from sara_lab.workers import cluster, faults
from sara_lab.workers.cluster import Cluster, ClusterError, check
from sara_lab.workers.cluster_command import key, main
from sara_lab.workers.processes import each


@pytest.mark.parametrize(
    ('address', 'said'),
    [
        ('tcp://192.168.1.5:8786', 'can run anything'),
        ('tcp://0.0.0.0:8786', 'can run anything'),
        ('tcp://example.org:8786', 'can run anything'),
        ('127.0.0.1:8786', 'is no address'),
        ('tcp://127.0.0.1', 'is no address'),
        ('tcp://127.0.0.1:many', 'is no address'),
        ('ucx://127.0.0.1:8786', 'is no address'),
        ('tls://192.168.1.5:8786', 'certificate.pem and key.pem'),
    ],
)
def test_an_address_that_is_none_or_not_safe_is_refused(address, said, capsys, monkeypatch):
    with pytest.raises(ClusterError, match=said):
        Cluster(address, 'sara_abc')
    with pytest.raises(SystemExit) as status:
        main(['worker', address])
    assert status.value.code == 2 and capsys.readouterr().err.startswith('cluster: ')
    monkeypatch.setattr(sys, 'argv', ['campaign', 'square', '--cluster', address])
    with pytest.raises(SystemExit) as status:
        campaign.main()
    assert status.value.code == 2 and 'campaign: error: ' in capsys.readouterr().err


def test_this_machine_and_tls_with_its_folder_are_allowed(tmp_path):
    for address in ('tcp://127.0.0.1:1', 'tcp://127.3.2.1:1', 'tcp://[::1]:1', 'tcp://localhost:1'):
        check(address)
    with pytest.raises(ClusterError, match='not encrypted'):
        check('tcp://127.0.0.1:1', tmp_path)
    main(['keys', str(tmp_path)])
    check('tls://192.168.1.5:1', tmp_path)
    assert (tmp_path / 'key.pem').stat().st_mode & 0o777 == 0o600


def test_a_scheduler_that_never_answers_is_an_error(monkeypatch):
    monkeypatch.setattr(cluster, 'WAIT_S', 0.0)
    monkeypatch.setattr(cluster, 'CONNECT_S', 0.2)
    with pytest.raises(ClusterError, match='no scheduler answers'):
        list(Cluster('tcp://127.0.0.1:9', 'sara_abc').each(str, [1]))


def test_a_scheduler_that_answers_slowly_is_waited_for(monkeypatch):
    def client(_, timeout, **__):
        if timeout < 15.0:
            raise TimeoutError
        return timeout

    monkeypatch.setattr(distributed, 'Client', client)
    monkeypatch.setattr(cluster, '_POLL_S', 0.0)
    assert Cluster('tcp://127.0.0.1:9', 'sara_abc')._client() == 20.0


def test_work_is_lost_in_vain_only_so_often(monkeypatch, capsys):
    made = Cluster('tcp://127.0.0.1:9', 'sara_abc')
    monkeypatch.setattr(Cluster, '_until_lost', lambda self, work, left: iter(()))
    with pytest.raises(ClusterError, match='lost 5 times in a row'):
        list(made.each(str, [1, 2]))
    assert capsys.readouterr().err.count('was lost; 2 are left') == 4


def test_a_batch_whose_result_is_gone_gives_nothing_and_one_that_fails_says_so():
    class Given:
        status = 'finished'

        def __init__(self, error):
            self.error = error

        def result(self, timeout):
            raise self.error

    class Running:
        status = 'running'

    for error in (CancelledError(), OSError('gone'), TimeoutError()):
        assert cluster._results(Given(error), Running()) == []
    with pytest.raises(ValueError, match='of the work'):
        cluster._results(Given(ValueError('of the work')), Running())


def test_by_tls_workers_of_the_same_sources_do_a_campaign_and_no_others(tmp_path, monkeypatch, capfd):
    keys = tmp_path / 'keys'
    main(['keys', str(keys)])
    with faults.Parties(tmp_path, 1, keys) as parties:
        asked = Cluster(parties.address, key(), keys)
        work = functools.partial(faults.work, 3)
        assert dict(each(work, range(7), asked)) == {item: work(item) for item in range(7)}
        with pytest.raises(TypeError):
            list(each(len, [1], asked))
        made = []
        for name, words in (('here', ['--workers', '1']), ('there', ['--cluster', asked.address, '--tls', str(keys)])):
            out = tmp_path / name
            words = ['campaign', 'obstacle', '--seeds', '2', '--out', str(out), *words]
            monkeypatch.setattr(sys, 'argv', words)
            with pytest.raises(SystemExit) as status:
                campaign.main()
            assert status.value.code == 0
            made.append({path.name: path.read_bytes() for path in out.rglob('*.json')})
        assert made[0] == made[1] and len(made[0]) == 2
        monkeypatch.setattr(cluster, 'WAIT_S', 0.0)
        monkeypatch.setattr(cluster, 'CONNECT_S', 120.0)  # its only try, on a machine however slow
        with pytest.raises(ClusterError, match=rf'no worker of sara_other .*there are: {key()}'):
            list(each(work, [1], Cluster(parties.address, 'sara_other', keys)))


def test_what_was_lost_or_doubled_is_told(tmp_path):
    for item in range(3):
        (tmp_path / f'{item}.txt').write_text(faults.work(2, item))
    (tmp_path / 'log').write_text('0\n1\n2\n')
    assert faults.faults(tmp_path, 3, 2, 0) == []
    (tmp_path / 'log').write_text('0\n1\n1\n2\n')
    (tmp_path / '2.txt').write_text('other')
    assert faults.faults(tmp_path, 4, 2, 0) == ['2 of 4 are missing or other, 2 first', '1 were written twice']
    (tmp_path / 'log').write_text('0\n')
    assert '2 are not in the log' in faults.faults(tmp_path, 3, 2, 0)
