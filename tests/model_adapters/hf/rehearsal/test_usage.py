"""What a rehearsal says of tiny models is what they take where they run."""

import weakref
from contextlib import contextmanager

import pytest
import torch
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_leaves

from infthor_eval.errors import ModelError, UsageError
from model_adapters import load
from model_adapters.hf.cached.prefix import Prefix
from model_adapters.hf.prompting.ahead import Ahead
from model_adapters.hf.rehearsal.model import load_shapes
from model_adapters.hf.rehearsal.usage import Rehearsal
from model_adapters.options.families import HfVlmOptions

CONTEXT = 3000
CHUNK = 64
MODELS = ("qwen2.5-vl", "llava-onevision", "deepseek-vl", "pixtral", "llava", "gemma3")


class _Counting(TorchDispatchMode):
    """Counts the memory of tensors that real operations make."""

    def __init__(self):
        super().__init__()
        self.allocated = self.peak = 0
        self._known = weakref.WeakSet()

    def __torch_dispatch__(self, func, types, args=(), kwargs=None):
        given = {
            leaf.untyped_storage()
            for leaf in tree_leaves((args, kwargs))
            if isinstance(leaf, torch.Tensor)
        }
        out = func(*args, **(kwargs or {}))
        for leaf in tree_leaves(out):
            if isinstance(leaf, torch.Tensor) and leaf.untyped_storage() not in given:
                self._take(leaf.untyped_storage())
        return out

    def _take(self, storage):
        if storage in self._known:
            return
        self._known.add(storage)
        self.allocated += storage.nbytes()
        self.peak = max(self.peak, self.allocated)
        weakref.finalize(storage, self._free, storage.nbytes())

    def _free(self, n_bytes):
        self.allocated -= n_bytes


@contextmanager
def counting():
    with torch.inference_mode(), _Counting() as counted:
        yield counted


def options(folder, **settings):
    given = {"device": "cpu", "dtype": "float32", "chunk_tokens": CHUNK, "max_tokens": 0}
    return HfVlmOptions(pretrained=str(folder), **(given | settings))


@pytest.mark.parametrize("name", MODELS)
def test_parameters_and_cache_are_those_of_the_real_model(name, checkpoints, frames):
    settings = {"dtype": "float32", "device": "cpu", "max_tokens": "0"}
    real = load("hf-vlm", {"pretrained": str(checkpoints[name]), **settings}, seed=0)
    rehearsed = load_shapes(options(checkpoints[name]))
    loaded = real.loaded.model
    assert rehearsed.problem == ""
    assert rehearsed.model.num_parameters() == loaded.num_parameters()
    tensors = {id(tensor): tensor.nbytes for tensor in (*loaded.parameters(), *loaded.buffers())}
    assert rehearsed.weights == sum(tensors.values())
    usage = Rehearsal(rehearsed, frames).usage(CONTEXT)
    prefix, _ = _fed(real, [0] * (CONTEXT // 2), CONTEXT)
    held = sum(buffer.nbytes for layer in prefix.cache.layers for buffer in layer._buffers)
    assert usage.cache == held
    real.close()


def _fed(real, pieces, n_context):
    """A real model's sequence of so many pieces, with room for so many tokens."""
    embed = real.loaded.family.make_embed(0, Ahead(n_threads=0))
    prefix = Prefix(real.loaded.model, real.loaded.family, embed, chunk_tokens=CHUNK)
    prefix.feed(pieces, reserve=n_context - len(pieces))
    return prefix, embed


# With the kernel that consists of operations, so that all memory is seen in both.
@pytest.mark.parametrize("name", ["qwen2.5-vl", "deepseek-vl"])
def test_the_most_memory_at_a_time_is_what_the_real_model_allocates(name, checkpoints, frames):
    settings = {"attn_implementation": "eager", "feature_cache_mb": 0}
    usage = Rehearsal(load_shapes(options(checkpoints[name], **settings)), frames).usage(CONTEXT)
    texts = {key: str(value) for key, value in settings.items()}
    texts |= {"dtype": "float32", "device": "cpu", "max_tokens": "0"}
    real = load("hf-vlm", {"pretrained": str(checkpoints[name]), **texts}, seed=0)
    rehearsal = Rehearsal(load_shapes(options(checkpoints[name], **settings)), frames)
    with counting() as counted:
        prefix, _ = _fed(real, [0], CONTEXT)
        prefix.lengthen(CONTEXT - 1 - len(rehearsal.parts["a question"]) - 1 - _width(rehearsal))
        cache = counted.allocated
        counted.peak = cache
        for pieces in rehearsal.parts.values():
            prefix.feed(pieces)
    assert usage.activations == pytest.approx(counted.peak - cache, rel=0.02)
    real.close()


def _width(rehearsal):
    return sum(
        1 if isinstance(piece, int) else len(piece.ids) for piece in rehearsal.parts["frames"]
    )


def test_a_context_takes_memory_in_proportion_and_the_largest_fits(checkpoints, frames):
    rehearsal = Rehearsal(load_shapes(options(checkpoints["qwen2.5-vl"])), frames)
    small, large = rehearsal.usage(16_384), rehearsal.usage(65_536)
    assert large.cache == 4 * small.cache
    assert large.total > small.total > small.weights
    budget = rehearsal.usage(50_000).total
    largest = rehearsal.largest(budget, 1024)
    assert largest % 1024 == 0
    assert rehearsal.usage(largest).total <= budget < rehearsal.usage(largest + 3 * 1024).total
    assert rehearsal.largest(small.weights, 1024) == 0


def test_a_chunk_has_a_mask_and_a_token_has_none(checkpoints, frames):
    rehearsed = load_shapes(options(checkpoints["qwen2.5-vl"], dtype="bfloat16"))
    kernels = Rehearsal(rehearsed, frames).usage(CONTEXT).kernels
    assert set(kernels["frames"]) == {("memory-efficient", True, 32)}
    assert set(kernels["a token of a reply"]) == {("flash", False, 32)}
    assert set(kernels["questions together"]) == {("memory-efficient", True, 32)}
    with_flash = Rehearsal(rehearsed, frames, flash=True).usage(CONTEXT)
    assert set(with_flash.kernels["frames"]) == {("flash_attention_2", False, 32)}
    assert with_flash.cache == Rehearsal(rehearsed, frames).usage(CONTEXT).cache


def test_a_model_that_sees_ahead_in_a_frame_has_no_flash(checkpoints, frames):
    rehearsal = Rehearsal(load_shapes(options(checkpoints["gemma3"])), frames)
    assert "both directions" in rehearsal.flash_problem
    assert Rehearsal(load_shapes(options(checkpoints["llava"])), frames).flash_problem == ""


def test_the_work_of_a_frame_is_that_of_its_tokens(checkpoints, frames):
    rehearsed = load_shapes(options(checkpoints["qwen2.5-vl"]))
    rehearsal = Rehearsal(rehearsed, frames)
    work = rehearsal.frame_work(CONTEXT)
    decoder = rehearsed.model.get_decoder()
    matrices = sum(weight.numel() for weight in decoder.layers.parameters() if weight.dim() == 2)
    # Below: what the tower and the last layer's logits add.
    assert work.n_tokens * matrices * 2 < work.flop < work.n_tokens * matrices * 2 * 3
    assert rehearsal.frame_work(2 * CONTEXT).attention > 1.9 * work.attention


def test_what_would_be_counted_wrongly_is_refused(checkpoints):
    for wrong in ({"kv_offload": True}, {"quantization": "bnb4"}):
        with pytest.raises(UsageError, match="cannot be rehearsed"):
            load_shapes(options(checkpoints["llava"], **wrong))
    with pytest.raises(UsageError, match=r"hf download x/y --include .* name one of Qwen/"):
        load_shapes(HfVlmOptions(pretrained="x/y"))


def test_a_model_whose_code_needs_numbers_is_one_line(checkpoints, frames, monkeypatch):
    rehearsed = load_shapes(options(checkpoints["llava"]))
    forward = rehearsed.model.forward

    def looking(*args, **kwargs):
        output = forward(*args, **kwargs)
        return output if float(output.logits.max()) > 0 else None

    monkeypatch.setattr(rehearsed.model, "forward", looking)
    with pytest.raises(ModelError, match="llava cannot be rehearsed"):
        Rehearsal(rehearsed, frames)
