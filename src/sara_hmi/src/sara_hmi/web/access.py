"""Who may open a page or a WebSocket: by the names under which the server is called, and by the page's origin."""

from __future__ import annotations

import ipaddress
from collections.abc import Collection
from urllib.parse import urlsplit

from sara_hmi.config.config import NetworkConfig

HEADERS = {
    'Content-Security-Policy': (
        "default-src 'self'; img-src 'self' data: blob:; connect-src 'self'; object-src 'none'; base-uri 'none'; "
        "form-action 'none'; frame-ancestors 'none'"
    ),
    'X-Content-Type-Options': 'nosniff',
    'X-Frame-Options': 'DENY',
    'Referrer-Policy': 'no-referrer',
    'Cross-Origin-Opener-Policy': 'same-origin',
    'Cross-Origin-Resource-Policy': 'same-origin',
    'Permissions-Policy': 'camera=(), microphone=(), geolocation=()',
    'Cache-Control': 'no-cache',
}


def host_name(host: str) -> str:
    """The name in a Host header, without the port and in lower case; "" where it is none."""
    try:
        return (urlsplit(f'//{host}').hostname or '').lower()
    except ValueError:
        return ''


def names(network: NetworkConfig, url: str) -> set[str]:
    """The names, in lower case, that the server answers to; url: of the page in the network."""
    known = 'localhost', *network.host_names, network.address, host_name(urlsplit(url).netloc)
    return {name.lower() for name in known if name}


def may_call(host: str, names: Collection[str]) -> bool:
    """Whether the server answers to this Host: one of its names, or any number.

    A page of a foreign host whose name was bent to this computer's number (DNS rebinding) calls it by that name.
    """
    name = host_name(host)
    if name in names:
        return True
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def same_origin(origin: str | None, scheme: str, host: str) -> bool:
    """Whether a request comes from a page of ours, or from no page at all (Origin is missing)."""
    return origin is None or origin.lower() == f'{scheme}://{host}'.lower()


def is_local(peer: str | None) -> bool:
    """Whether the other end is this computer."""
    try:
        return peer is not None and ipaddress.ip_address(peer.split('%')[0]).is_loopback
    except ValueError:
        return False
