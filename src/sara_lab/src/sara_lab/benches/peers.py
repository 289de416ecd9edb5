"""The C++ peers' figures (data/peers_speed.json)."""

import json
from functools import lru_cache
from typing import Any

from sara_bringup.paths import share


@lru_cache(maxsize=1)
def peers() -> dict[str, Any]:
    """As the file has them: ms, us, per second; `yardstick_ms` of the machine they were taken on."""
    return json.loads((share('sara_lab') / 'data' / 'peers_speed.json').read_text())
