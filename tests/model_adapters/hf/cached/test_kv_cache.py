import torch
from hypothesis import given
from hypothesis import strategies as st
from transformers import DynamicCache, LlamaConfig, Qwen3NextConfig

from model_adapters.hf.cached.kv_cache import BufferedCache

HEADS, SIZE = 2, 4
# Positive: append so many tokens to each of two layers; negative: cut so many.
OPERATIONS = st.lists(st.integers(-40, 40), max_size=20)


def _states(n_tokens, generator):
    keys, values = torch.randn(2, 1, HEADS, n_tokens, SIZE, generator=generator)
    return keys, values


@given(OPERATIONS)
def test_holds_what_a_dynamic_cache_holds(operations):
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


def test_neither_a_cut_nor_a_refill_moves_memory():
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


def test_grows_beyond_what_was_reserved():
    generator = torch.Generator().manual_seed(0)
    cache = BufferedCache(LlamaConfig())
    cache.reserve(10)
    first, _ = _states(1000, generator)
    cache.update(first, first, 0)
    second, _ = _states(1000, generator)
    keys, _ = cache.update(second, second, 0)
    assert torch.equal(keys, torch.cat([first, second], dim=-2))


# A layer with one state for all tokens, then one that attends.
HYBRID = Qwen3NextConfig(num_hidden_layers=2, layer_types=["linear_attention", "full_attention"])


def _read(cache, n_tokens):
    """Let the first layer's state be the number of tokens that it has read."""
    old = cache.get_seq_length()
    state = torch.full((1, 1, 2, 2), float(old + n_tokens))
    cache.update_conv_state(state[0], 0)
    cache.update_recurrent_state(state, 0)
    states = _states(n_tokens, torch.Generator())
    cache.update(*states, 1)


def _state(cache):
    return float(cache.layers[0].recurrent_states[0].max())


def test_a_layer_with_one_state_goes_back_to_the_last_mark():
    cache = BufferedCache(HYBRID)
    assert cache.needs_marks
    _read(cache, 5)
    cache.mark()
    _read(cache, 3)
    assert [cache.cut_before(n) for n in (8, 7, 5, 4)] == [8, 5, 5, 0]
    for _ in range(2):  # a mark stays
        cache.truncate(cache.cut_before(6))
        assert (cache.get_seq_length(), _state(cache)) == (5, 5.0)
        _read(cache, 2)
        assert _state(cache) == 7.0
    cache.truncate(0)
    assert (cache.get_seq_length(), cache.cut_before(5)) == (0, 0)
    assert not cache.has_previous_state(0)


def test_few_marks_are_kept_and_those_that_are_used():
    cache = BufferedCache(HYBRID)
    _read(cache, 1)
    cache.mark()
    for _ in range(6):
        _read(cache, 1)
        cache.mark()
    assert cache.cut_before(3) == 0
    assert cache.cut_before(6) == 6


def test_a_cache_whose_layers_all_attend_can_be_cut_anywhere():
    cache = BufferedCache(LlamaConfig())
    assert not cache.needs_marks
    cache.mark()
    cache.update(*_states(9, torch.Generator()), 0)
    assert [cache.cut_before(n) for n in (9, 4, 0)] == [9, 4, 0]
