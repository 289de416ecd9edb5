"""Functions of this package compiled as they stand, for kernels of other packages to call.

Python code calls the plain functions, so that a process without kernels does not load machine code.
"""

from types import FunctionType

from ahead_of_time import kernel
from sara_common import planar


def _compiled(function, **called):
    """A kernel of a plain function. It is made of a copy that belongs to this module, where the build looks for it.
    called: {name: kernel} of the functions that it calls.
    """
    copy = FunctionType(function.__code__, {**function.__globals__, **called}, function.__name__)
    copy.__module__ = __name__
    return kernel(copy)


wrap = _compiled(planar.wrap)
wrap_exact = _compiled(planar.wrap_exact)
advanced = _compiled(planar.advanced, wrap=wrap)


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    wrap(0.0)
    wrap_exact(0.0)
    advanced(0.0, 0.0, 0.0, 0.1, 0.1, 1.0)
