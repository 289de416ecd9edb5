"""No test depends on how fast the machine is; the tests' robot can be imported."""

import sys
from pathlib import Path

from hypothesis import settings

settings.register_profile('sara', deadline=None)
settings.load_profile('sara')
sys.path.append(str(Path(__file__).resolve().parent))
