"""The server's own certificate, made at the first start and kept."""

from __future__ import annotations

import datetime
import hashlib
import ipaddress
import ssl
from collections.abc import Iterable
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from sara_common.files import write_whole

VALID = datetime.timedelta(days=3650)


def make(names: Iterable[str], now: datetime.datetime) -> tuple[bytes, bytes]:
    """(certificate, private key) in PEM, for names and numbers of this computer, from a day before `now` on."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, 'SARA touch screen')])
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(days=1))
        .not_valid_after(now + VALID)
        .add_extension(x509.SubjectAlternativeName([_general(held) for held in names]), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .sign(key, hashes.SHA256())
    )
    pem = key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    return certificate.public_bytes(serialization.Encoding.PEM), pem


def _general(name):
    try:
        return x509.IPAddress(ipaddress.ip_address(name))
    except ValueError:
        return x509.DNSName(name)


def kept(folder: Path, names: Iterable[str], now: datetime.datetime) -> tuple[ssl.SSLContext, str]:
    """(the server's TLS context, the certificate's SHA-256 fingerprint); made in `folder` where none is there."""
    certificate, key = folder / 'certificate.pem', folder / 'key.pem'
    if not (certificate.is_file() and key.is_file()):
        made = make(names, now)
        write_secret(key, made[1])
        certificate.write_bytes(made[0])
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.load_cert_chain(certificate, key)
    return context, fingerprint(certificate.read_bytes())


def fingerprint(pem: bytes) -> str:
    """SHA-256 of a certificate, as browsers show it."""
    digest = hashlib.sha256(ssl.PEM_cert_to_DER_cert(pem.decode())).hexdigest().upper()
    return ':'.join(digest[k : k + 2] for k in range(0, len(digest), 2))


def write_secret(path: Path, data: bytes) -> None:
    """Write a file that its owner alone may read, in one go."""
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    write_whole(path, data, 0o600)
