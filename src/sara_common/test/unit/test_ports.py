"""Ports for programs that are started for a while."""

import socket

from sara_common import ports


def test_a_port_is_free_and_none_that_the_kernel_gives_away_and_no_two_are_alike():
    found = [ports.free_port() for _ in range(4)]
    assert len(set(found)) == 4 and all(1024 < port < 32768 for port in found)
    for port in found:
        with socket.socket() as probe:
            probe.bind(('', port))


def test_a_port_on_which_somebody_listens_is_passed_over(monkeypatch):
    with socket.socket() as other:
        taken = ports.free_port()
        other.bind(('', taken))
        other.listen()
        monkeypatch.setattr(ports, '_PORTS', iter((taken, free := ports.free_port())))
        assert ports.free_port() == free
