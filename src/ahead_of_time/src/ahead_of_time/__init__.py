"""Functions compiled by numba at build time.

    from ahead_of_time import kernel

    @kernel
    def f(a, b): ...

`tools/build.sh` compiles them (build.py) for the types that their modules' `warm()` calls them with. A process that
finds the object
does not import numba at all: that saves a third of a second and a hundred megabytes. Where there is none, or where it
is older than the source, or for other types, numba compiles as it would have without.
"""

from .kernels import compilations, kernel, misses

__all__ = ['compilations', 'kernel', 'misses']
