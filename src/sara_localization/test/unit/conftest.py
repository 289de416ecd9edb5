"""No test depends on how fast the machine is."""

from hypothesis import settings

settings.register_profile('sara', deadline=None)
settings.load_profile('sara')
