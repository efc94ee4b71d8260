import pytest

from infthor_eval.errors import UsageError
from model_adapters.options import parse
from model_adapters.options.checkpoints import HfOptions


def test_a_gpu_gets_larger_chunks_unless_their_size_is_given():
    assert {kind: HfOptions().chunk_size(kind) for kind in ("cpu", "cuda", "xpu")} == {
        "cpu": 1024,
        "cuda": 4096,
        "xpu": 4096,
    }
    assert HfOptions(chunk_tokens=10).chunk_size("cuda") == 10


def test_a_chunk_has_a_token_at_least():
    with pytest.raises(UsageError, match="m: chunk_tokens=0: give a whole number from 1;"):
        parse("m", HfOptions, {"chunk_tokens": "0"})
