"""How many threads numpy's BLAS uses in a node."""

from __future__ import annotations

import contextlib
import ctypes
import os

OPENBLAS = 'libopenblas.so.0'


def use_one_blas_thread() -> None:
    """OpenBLAS, where numpy has it, works in the thread that asks, unless OPENBLAS_NUM_THREADS says otherwise.

    Its threads wait for work in a loop: with them slam_gmapping takes five times the CPU.
    """
    if 'OPENBLAS_NUM_THREADS' in os.environ:
        return
    with contextlib.suppress(OSError, AttributeError):  # another BLAS
        ctypes.CDLL(OPENBLAS, mode=os.RTLD_NOLOAD | os.RTLD_LAZY).openblas_set_num_threads(1)
