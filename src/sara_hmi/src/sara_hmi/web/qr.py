"""QR codes, for a terminal and for the page."""

from __future__ import annotations

import io


def terminal(text: str) -> str:
    """In half blocks, dark on light as seen on a dark terminal."""
    held = io.StringIO()
    _code(text).print_ascii(out=held, invert=True)
    return held.getvalue()


def svg(text: str) -> str:
    """As an SVG picture of black squares on white."""
    rows = _code(text).get_matrix()
    squares = ''.join(f'M{x} {y}h1v1h-1z' for y, row in enumerate(rows) for x, dark in enumerate(row) if dark)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {len(rows)} {len(rows)}">'
        f'<rect width="100%" height="100%" fill="#fff"/><path d="{squares}"/></svg>'
    )


def _code(text):
    import qrcode  # 4 MB, which a chair without a network does not need

    code = qrcode.QRCode(border=2)
    code.add_data(text)
    code.make(fit=True)
    return code
