"""What can be known of a GPU without one: half precision, another device, what is waited for,
memory that runs out."""

import ast
import weakref
from dataclasses import replace
from pathlib import Path

import pytest
import torch

import model_adapters
from infthor_eval.errors import ModelError
from model_adapters import load
from model_adapters.hf.cached.kv_cache import BufferedLayer

from ...helpers.refusals import read_one_line
from ..asking import up_to, user
from ..checkpoints import FAMILIES
from ..elsewhere import Seen, elsewhere, move

QUESTIONS = ("\nWhat?", "\nWhere was it?", "\nWho was there before that?")
MODES = {
    "shared": {"batch_size": "1"},
    "chunked": {"batch_size": "1", "chunk_tokens": "40"},
    "offloaded": {"kv_offload": "true"},
    "batched": {"batch_size": "3"},
}


def _asked(model, frames, new=5, **decoding):
    """Replies to all questions on some frames."""
    talk = model.conversation()
    talk.append(*frames)
    return [
        reply.token_ids
        for reply in talk.replies([[text] for text in QUESTIONS], up_to(new, **decoding))
    ]


def _tiny(family, options):
    return load(f"{family}-tiny", {"max_tokens": "0", **options}, seed=0)


def _forget(model):
    model._prefix.reset()
    model._embed.clear()


@pytest.mark.parametrize("mode", [*MODES, "mapped"])
@pytest.mark.parametrize("family", FAMILIES)
def test_half_precision_answers_the_same_every_time(family, mode, checkpoints, frames):
    options = MODES.get(mode, {"device_map": "auto"})
    settings = {"pretrained": str(checkpoints[family]), "dtype": "bfloat16", "max_tokens": "0"}
    model = load(family, settings | options, seed=0)
    assert torch.isfinite(model.encode(model.pieces(user(*frames[:2], QUESTIONS[0])))).all()
    _forget(model)
    first = _asked(model, frames[:2])
    assert {layer.keys.dtype for layer in model._prefix.cache.layers} == {torch.bfloat16}
    assert len(set(first)) > 1
    assert _asked(model, frames[:2]) == first  # with the frames still encoded
    _forget(model)
    assert _asked(model, frames[:2]) == first
    model.close()


def test_float32_is_not_rounded_on_a_gpu(monkeypatch):
    monkeypatch.setattr(torch.backends.cudnn, "allow_tf32", True)
    _tiny("qwen2.5-vl", {}).close()
    assert not torch.backends.cudnn.allow_tf32


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("family", FAMILIES)
def test_a_model_on_another_device_leaves_nothing_on_the_cpu(family, mode, frames):
    model = _tiny(family, {"chunk_tokens": "40"} | MODES[mode])
    here = _asked(model, frames[:2])
    _forget(model)
    seen = Seen()
    move(model._loaded.model, seen)
    with elsewhere(seen):
        assert _asked(model, frames[:2]) == here
    kept = {layer.keys.device.type for layer in model._prefix.cache.layers}
    assert kept == {"cpu" if mode == "offloaded" else "meta"}
    assert seen.brought.total() > 0


def _step(model, seen, frames, **decoding):
    """Of one decoded token on top of what is encoded: reads, tensors brought to the device, bytes
    allocated there."""
    few, more = 2, 8
    counts = []
    with elsewhere(seen):
        _asked(model, frames, 1)
        for new in (few, more):
            for counter in (seen.reads, seen.brought, seen.allocated):
                counter.clear()
            replies = _asked(model, frames, new, **decoding)
            assert {len(ids) for ids in replies} == {new}
            counts.append((seen.reads.total(), seen.brought.total(), seen.allocated.total()))
    n_steps = (more - few) * (1 if model.capabilities.batch_size > 1 else len(QUESTIONS))
    reads, brought, allocated = (
        (after - before) / n_steps for before, after in zip(*counts, strict=True)
    )
    return reads, brought, allocated


def _talkative(family, options, penalty=1.0):
    """A model on the device that never ends its turn by itself."""
    model, seen = _tiny(family, options), Seen()
    generation = replace(model._loaded.generation, end_ids=frozenset(), repetition_penalty=penalty)
    model._loaded = replace(model._loaded, generation=generation)
    move(model._loaded.model, seen)
    return model, seen


@pytest.mark.parametrize("family", FAMILIES)
def test_a_token_is_read_once_and_copies_nothing_of_the_context(family, frames):
    model, seen = _talkative(family, {"batch_size": "1"}, penalty=1.05)  # as Qwen2.5-VL's
    reads, brought, allocated = _step(model, seen, frames[:2])
    assert reads == 1
    assert brought <= 2  # the token and its position
    assert _step(model, seen, frames)[2] == pytest.approx(allocated, rel=0.01)


@pytest.mark.parametrize(
    ("options", "decoding"),
    [({}, {"temperature": 1.0}), ({}, {"stop": ("no such text",)}), ({"batch_size": "3"}, {})],
)
def test_a_drawn_token_one_that_may_end_the_reply_and_a_batch_are_read_once_too(
    options, decoding, frames
):
    model, seen = _talkative("qwen2.5-vl", options)
    assert _step(model, seen, frames[:2], **decoding)[0] == 1


def test_a_batch_copies_no_keys(frames):
    model, seen = _talkative("qwen2.5-vl", {"batch_size": "3"})
    small, large = (_step(model, seen, some)[2] for some in (frames[:2], frames))
    n_more = (model.tokens_per_frame(frames[0]) + 2) * (len(frames) - 2)
    # Keys and values would be 512 for each reply; what is left is a mask over the context, a number
    # for each.
    assert (large - small) / n_more < 3 * 5


def test_nothing_names_a_device_but_what_chooses_it():
    # resolve_device: auto is the GPU; the rehearsal is one of a GPU.
    allowed = {("checkpoint.py", "cuda"), ("usage.py", "cuda")}
    named = set()
    for path in Path(model_adapters.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Constant) and str(node.value).split(":")[0] in (
                "cuda",
                "mps",
                "xpu",
            ):
                named.add((path.name, node.value))
            if (
                isinstance(node, ast.Attribute)
                and isinstance(node.value, ast.Attribute)
                and node.value.attr == "cuda"
            ):
                assert node.attr in ("is_available", "empty_cache"), f"{path}:{node.lineno}"
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                assert node.func.attr not in ("cuda", "synchronize", "pin_memory"), (
                    f"{path}:{node.lineno}"
                )
    assert named == allowed


def _failing_after(function, n_calls):
    """The function, out of memory once it was called so often."""
    calls = []

    def failing(*args, **kwargs):
        calls.append(None)
        if len(calls) > n_calls:
            raise torch.OutOfMemoryError("CUDA out of memory. Tried to allocate 2.00 GiB.")
        return function(*args, **kwargs)

    return failing


@pytest.fixture
def buffers(monkeypatch):
    """The buffers of keys and values that are made from now on."""
    created = []
    grow = BufferedLayer._grow

    def noting(*args):
        buffer = grow(*args)
        created.append(weakref.ref(buffer))
        return buffer

    monkeypatch.setattr(BufferedLayer, "_grow", noting)
    return created


@pytest.mark.parametrize("batch_size", ["1", "3"])
@pytest.mark.parametrize("where", ["in a frame's features", "in a question", "in a reply"])
def test_memory_that_runs_out_is_free_for_the_next_request(
    where, batch_size, frames, buffers, monkeypatch
):
    model = _tiny("qwen2.5-vl", {"batch_size": batch_size, "chunk_tokens": "40"})
    _asked(model, frames[:4])
    of, name, n_calls = {
        "in a frame's features": (model._embed._features, "_compute_frames", 0),
        "in a question": (model._loaded.model, "forward", 2),
        "in a reply": (model._loaded.model, "forward", 5),
    }[where]
    with monkeypatch.context() as patched:
        patched.setattr(of, name, _failing_after(getattr(of, name), n_calls))
        with pytest.raises(
            ModelError, match=r"out of memory on a context of \d+ tokens .* kv_offload=true"
        ) as caught:
            _asked(model, frames)
    read_one_line(caught)
    assert len(buffers) > 0
    assert not any(created() is not None for created in buffers)  # though the error is still there
    assert _asked(model, frames) == _asked(_tiny("qwen2.5-vl", {}), frames)
