"""The decorator `kernel`: machine code made at build time where it is there and fresh, numba where it is not."""

from collections.abc import Callable
from functools import lru_cache

from . import library

_kernels = []  # those that run machine code made at build time


def kernel(function: Callable | None = None, **options) -> Callable:
    """Like numba.njit(cache=True, **options), with the machine code made by build.py where it is fresh."""
    if function is None:
        return lambda function: kernel(function, **options)
    if library.recorder is not None:
        return library.recorder.record(function, options)
    variants = library.variants(function)
    if variants is None:
        if library.has_index():
            teach_numba()  # it may call kernels of other modules that are fresh
        return compiled(function, options)
    result = library.dispatch().Kernel(variants, Late(function, options), function)
    _kernels.append(result)
    return result


def compiled(function: Callable, options: dict) -> Callable:
    """numba's own dispatcher of the function."""
    from numba import njit

    return njit(cache=True, **options)(function)


class Late:
    """numba's dispatcher, made when it is first needed: for types that nothing was compiled for at build time."""

    def __init__(self, function: Callable, options: dict):
        self._function, self._options, self._dispatcher = function, options, None

    @property
    def dispatcher(self) -> Callable:
        """numba's dispatcher of the function. Kernels that it calls may have been compiled at build time themselves."""
        if self._dispatcher is None:
            teach_numba()
            self._dispatcher = compiled(self._function, self._options)
        return self._dispatcher

    @property
    def signatures(self) -> list:
        """Those that numba compiled here."""
        return self._dispatcher.signatures if self._dispatcher else []

    def __call__(self, *arguments, **keywords):
        return self.dispatcher(*arguments, **keywords)


@lru_cache(None)
def teach_numba() -> None:
    """Tell numba's typing what a Kernel is where one compiled function calls another."""
    from numba.core import types
    from numba.extending import typeof_impl

    @typeof_impl.register(library.dispatch().Kernel)
    def _typeof(value, _context):
        return types.Dispatcher(value.late.dispatcher)


def misses() -> dict[str, int]:
    """{name of a kernel: how often it was called with types that nothing was compiled for at build time}, where there
    were any.
    """
    return {f'{k.__wrapped__.__module__}.{k.__wrapped__.__name__}': k.missed for k in _kernels if k.missed}


def compilations(function: Callable) -> int:
    """For how many sets of types numba compiled a kernel in this process, or loaded it from its own cache."""
    return len(getattr(function, 'late', function).signatures)
