import torch
from hypothesis import given
from hypothesis import strategies as st
from transformers import DynamicCache, LlamaConfig

from model_adapters.hf.cached.kv_cache import BufferedCache

HEADS, SIZE = 2, 4
# Positive: append so many tokens to each of two layers; negative: cut so many.
OPERATIONS = st.lists(st.integers(-40, 40), max_size=20)


def _states(n_tokens: int, generator: torch.Generator) -> tuple[torch.Tensor, torch.Tensor]:
    keys, values = torch.randn(2, 1, HEADS, n_tokens, SIZE, generator=generator)
    return keys, values


@given(OPERATIONS)
def test_holds_what_a_dynamic_cache_holds(operations: list[int]) -> None:
    generator = torch.Generator().manual_seed(0)
    ours, theirs = BufferedCache(LlamaConfig()), DynamicCache()
    for count in operations:
        length = ours.get_seq_length()
        if count > 0:
            if count % 3 == 0:
                ours.reserve(length + count + 5)
            for layer in range(2):
                states = _states(count, generator)
                kept, expected = ours.update(*states, layer), theirs.update(*states, layer)
                assert all(torch.equal(a, b) for a, b in zip(kept, expected, strict=True))
        elif -length <= count < 0:
            ours.truncate(length + count)
            theirs.crop(count)
        assert ours.get_seq_length() == theirs.get_seq_length()


def test_neither_a_cut_nor_a_refill_moves_memory() -> None:
    generator = torch.Generator().manual_seed(0)
    cache = BufferedCache(LlamaConfig())
    cache.reserve(100)
    cache.update(*_states(60, generator), 0)
    layer = cache.layers[0]
    assert layer.keys is not None
    address = layer.keys.data_ptr()
    for _ in range(3):
        cache.truncate(50)
        cache.update(*_states(40, generator), 0)
        assert layer.keys.data_ptr() == address
        assert layer.keys.shape == (1, HEADS, 90, SIZE)


def test_grows_beyond_what_was_reserved() -> None:
    generator = torch.Generator().manual_seed(0)
    cache = BufferedCache(LlamaConfig())
    cache.reserve(10)
    first, _ = _states(1000, generator)
    cache.update(first, first, 0)
    second, _ = _states(1000, generator)
    keys, _ = cache.update(second, second, 0)
    assert torch.equal(keys, torch.cat([first, second], dim=-2))
