"""Freed memory is used again, and not requested from the system again."""

import os
import platform
import subprocess
import sys

import pytest

_FAULTS = """
import resource, numpy as np
from infthor_eval.process_settings import tune_malloc
if {kept}:
    tune_malloc()

def use():
    pieces = [np.ones(10 * 2**20, np.uint8) for _ in range(4)]
    return sum(int(piece[0]) for piece in pieces)

use()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    use()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def page_faults(kept):
    code = _FAULTS.format(kept=kept)
    env = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=env)
    return int(done.stdout)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc has such settings")
def test_freed_memory_is_not_asked_for_anew():
    assert page_faults(kept=True) < page_faults(kept=False) / 10
