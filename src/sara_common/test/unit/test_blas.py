"""numpy's BLAS in a node: one thread, unless the environment says how many."""

import os
import subprocess
import sys

import pytest

THREADS = """
import ctypes, os, numpy
from sara_common.ros.blas import OPENBLAS, use_one_blas_thread
try:
    openblas = ctypes.CDLL(OPENBLAS, mode=os.RTLD_NOLOAD | os.RTLD_LAZY)
except OSError:
    openblas = None
use_one_blas_thread()
print(openblas.openblas_get_num_threads() if openblas else 0)
"""


@pytest.mark.parametrize('asked, threads', ((None, 1), ('2', 2)))
def test_one_thread_unless_more_are_asked_for(asked, threads):
    env = {name: value for name, value in os.environ.items() if name not in ('OPENBLAS_NUM_THREADS', 'OMP_NUM_THREADS')}
    env |= {'OPENBLAS_NUM_THREADS': asked} if asked else {}
    answer = subprocess.run([sys.executable, '-c', THREADS], env=env, capture_output=True, text=True, check=True)
    found = int(answer.stdout)
    if not found:
        pytest.skip('numpy has another BLAS here')
    assert found == min(threads, os.cpu_count())
