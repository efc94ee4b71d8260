"""What is tried when a checkpoint without code of its own is loaded, so that it is refused instead
of giving wrong results.

- Token ids and logits of a sample are those of the processor and the plain model.
- Continuations that are answered together have the logits that they have alone, on a context that
  is longer than every window of the model.
- Without shared prefixes, `generate` gives a reply of the tokens that are chosen here.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image

from infthor_eval.errors import ModelError, in_one_line, wrap_errors
from infthor_eval.formats.frames import FrameRef
from infthor_eval.storage.scratch import ScratchFolder
from model_adapters.hf.adapter import wrap_mismatch_errors
from model_adapters.hf.cached.model import TransformersModel
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.prompting.prompt import Piece, Prompter, n_tokens, token_ids
from model_adapters.hf.uncached import UncachedModel, process_turns
from model_adapters.protocols import Part, Turn

# Relative to the largest logit; more in half precision.
_TOLERANCE = {torch.float32: 1e-3, torch.float64: 1e-3}
_HALF_TOLERANCE = 0.1
# Settings that transformers' mask functions read; in tokens.
_WINDOWS = ("sliding_window", "attention_chunk_size")
_WIDEST = 128  # tokens of the widest window that a sample is made longer than


def check_loaded(model: TransformersModel | UncachedModel, processor: Any, pretrained: str) -> None:
    """Try a checkpoint on samples.

    Args:
        model: the checkpoint, as it is going to be run.
        processor: the checkpoint's processor of images and text.
        pretrained: name of the checkpoint, for messages.
    """
    with ScratchFolder() as folder:
        turns = [Turn("user", _sample(folder))]
        if isinstance(model, TransformersModel):
            _check_shared(model, turns, processor, pretrained)
            _check_together(model, turns[0].parts[1], pretrained)
        else:
            _plain_logits(
                model.loaded, _inputs(model.loaded, turns, processor, pretrained), pretrained
            )
            model.try_generate(turns)


@torch.inference_mode()
def check_text(model: TransformersModel, pretrained: str) -> None:
    """Try a checkpoint that reads text alone, likewise."""
    kind = model.loaded.model.config.model_type
    pieces = model.pieces([Turn("user", ("The first view:\nRotateLeft\nWhat do you see?",))])
    device = model.loaded.model.get_input_embeddings().weight.device
    inputs = {"input_ids": torch.tensor([[*token_ids(pieces)]], device=device)}
    _compare_logits(model, pieces, inputs, pretrained, f"{kind} needs code of its own")
    _check_together(model, "The first view:\n", pretrained)
    model.forget()  # requests begin as they do without samples


def require_same_ids(loaded: LoadedCheckpoint, processor: Any, pretrained: str, hint: str) -> None:
    """Refuse a checkpoint whose processor makes other token ids of a sample than the parts of a
    conversation have.
    """
    prompter = Prompter(loaded.tokenizer, loaded.template, loaded.family)
    with ScratchFolder() as folder, wrap_mismatch_errors(pretrained):
        turns = [Turn("user", _sample(folder))]
        _compare_ids(prompter.pieces(turns), process_turns(processor, loaded.template, turns), hint)


@torch.inference_mode()
def _check_shared(
    model: TransformersModel, turns: list[Turn], processor: Any, pretrained: str
) -> None:
    """Raise `ModelError` unless a sample has the processor's ids and the plain model's logits."""
    loaded = model.loaded
    kind = loaded.model.config.model_type
    hint = "use share_prefix=false"
    problem = f"{pretrained}: {kind} cannot be run with shared prefixes"
    with wrap_errors(problem, hint, catch=Exception, raise_as=ModelError):
        pieces = model.pieces(turns)
    inputs = _inputs(loaded, turns, processor, pretrained)
    _compare_ids(pieces, inputs, f"{kind} cannot be run with shared prefixes; {hint}")
    _compare_logits(model, pieces, inputs, pretrained, hint)


def _compare_logits(
    model: TransformersModel, pieces: list[Piece], inputs: Any, pretrained: str, hint: str
) -> None:
    """Raise `ModelError` unless pieces have the logits of the plain model on the inputs."""
    loaded = model.loaded
    kind = loaded.model.config.model_type
    problem = f"{pretrained}: {kind} cannot be run with shared prefixes"
    # First the plain model: if it fails, too, the parts do not belong together.
    plain = _plain_logits(loaded, inputs, pretrained)
    try:
        shared = model.encode(pieces)
    # Any error is possible, ours too: the model's own code runs on inputs that it was not made for.
    except Exception as error:
        raise ModelError(f"{problem} ({in_one_line(error)}); {hint}") from error
    if _differ(shared, plain):
        raise ModelError(
            f"logits differ from the plain model's: {kind} cannot be run with shared prefixes; "
            f"{hint}"
        )


@torch.inference_mode()
def _check_together(model: TransformersModel, frame: Part, pretrained: str) -> None:
    """Raise `ModelError` unless continuations answered together have the logits they have alone."""
    problem = f"{pretrained}: {model.loaded.model.config.model_type} cannot be asked in batches"
    hint = "use batch_size=1"
    # Any error is possible, as with shared prefixes.
    with wrap_errors(problem, hint, catch=Exception, raise_as=ModelError):
        if model.capabilities.batch_size == 1:
            return
        prompts = _long_prompts(model, frame, max(model.windows or (), default=0))
        with _narrow_windows(model.loaded.model.get_decoder().config):
            together = model.encode_together(prompts)
            alone = torch.stack([model.encode(prompt) for prompt in prompts])
        model.forget()  # what was encoded with other windows
    if _differ(together, alone):
        raise ModelError(
            f"{problem} (logits of continuations together differ from those alone); {hint}"
        )


@contextmanager
def _narrow_windows(config: Any) -> Iterator[None]:
    """Make the widest windows of a decoder so narrow within the context that a short sample is
    longer: masks are made anew for every pass.

    A sample of thousands of tokens would take longer than loading. A kernel that has the windows
    from the layers instead of a mask (flash attention) is replaced by torch's, which has not.
    """
    wide = {
        name: size
        for name in _WINDOWS
        if isinstance(size := getattr(config, name, None), int) and size > _WIDEST
    }
    kernel = config._attn_implementation
    if wide:
        config._attn_implementation = "sdpa"
    try:
        for name in wide:
            setattr(config, name, _WIDEST)
        yield
    finally:
        for name, size in wide.items():
            setattr(config, name, size)
        config._attn_implementation = kernel


def _long_prompts(model: TransformersModel, frame: Part, window: int) -> list[list[Piece]]:
    """Return two prompts that share more text than the widest window; one goes on for another."""

    def written(*texts: str) -> list[Piece]:
        return model.pieces([Turn("user", (frame, "".join(texts)))])

    sentence = "The mug was on the table. "
    n = 2
    while n_tokens(written(sentence * n)) - n_tokens(written(sentence)) <= min(window, _WIDEST):
        n *= 2
    endings = ("Is it there?", sentence * n + "And now?")
    return [written(sentence * n, ending) for ending in endings]


def _inputs(loaded: LoadedCheckpoint, turns: list[Turn], processor: Any, pretrained: str) -> Any:
    """Return what the processor makes of a sample, on the model's device."""
    with wrap_mismatch_errors(pretrained):
        inputs = process_turns(processor, loaded.template, turns)
        weight = loaded.model.get_input_embeddings().weight
        return inputs.to(weight.device, loaded.model.dtype)


@torch.inference_mode()
def _plain_logits(loaded: LoadedCheckpoint, inputs: Any, pretrained: str) -> torch.Tensor:
    """Return the next token's logits, (vocabulary,), by the whole model in one pass."""
    with wrap_mismatch_errors(pretrained):
        logits: torch.Tensor = loaded.model(**inputs).logits[0, -1]
    return logits


def _differ(logits: torch.Tensor, expected: torch.Tensor) -> bool:
    tolerance = _TOLERANCE.get(expected.dtype, _HALF_TOLERANCE) * expected.abs().max()
    return bool((logits - expected).abs().max() > tolerance)


def _compare_ids(pieces: Iterable[Piece], inputs: Any, hint: str) -> None:
    if list(token_ids(pieces)) != inputs["input_ids"][0].tolist():
        raise ModelError(f"token ids differ from the processor's: {hint}")


def _sample(folder: Path) -> tuple[Part, ...]:
    draw = np.random.default_rng(0)
    frames = []
    for number, (height, width) in enumerate([(300, 300), (200, 280)]):
        path = folder / f"{number}.png"
        Image.fromarray(draw.integers(0, 256, (height, width, 3), dtype=np.uint8)).save(path)
        frames.append(FrameRef(path))
    return "The first view:\n", frames[0], "RotateLeft", frames[1], frames[0], "\nWhat do you see?"
