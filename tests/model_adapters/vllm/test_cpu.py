"""What vLLM's CPU back end finds in the modules that are loaded beside it."""

import numba  # noqa: F401 - imports llvmlite, as scaling frames does
from llvmlite.binding import ffi

from model_adapters.vllm.cpu import readable_globals


def test_no_value_claims_to_have_what_it_has_not():
    assert hasattr(ffi.lib, "__dict__")  # vLLM would read a dictionary from it
    with readable_globals():
        assert not hasattr(ffi.lib, "__dict__")
        assert callable(ffi.lib.LLVMPY_GetVersionInfo)
    assert hasattr(ffi.lib, "__dict__")
