"""The gain of a simulated chair's gyro, as E6's full turns find it, remembered in a folder: finding it takes a second
or more, and many trials need it.
"""

import json
from pathlib import Path

from sara_common.files import write_whole
from sara_lab.experiments.sensor_experiments import full_turns


def gain_of(seed: int, folder: Path | str) -> float:
    """The gain of the chair `seed`; `folder`: a Path, where gain_SEED.json is kept."""
    path = Path(folder) / f'gain_{seed}.json'
    if not path.exists():
        write_whole(path, json.dumps(full_turns(seed).gain.gain))
    return json.loads(path.read_text())
