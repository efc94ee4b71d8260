"""Any image-text-to-text model, by its own processor and `generate`, encoding everything for every reply.

The slow way that is right for every architecture: what the shared machinery cannot run (attention in both directions
over images, vision features that enter at several layers), this does.
"""

from collections.abc import Sequence
from typing import Any

import torch
from PIL import Image
from transformers import StoppingCriteria, StoppingCriteriaList

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.backend import BackendConversation, OneByOne
from model_adapters.hf.decoding import cut_at_stop
from model_adapters.hf.loaded import Loaded
from model_adapters.hf.model import (
    check_limit,
    context_limit,
    identity,
    limit_before_extension,
    naming_memory_errors,
)
from model_adapters.hf.options import HfOptions
from model_adapters.hf.prompt import begins, render
from model_adapters.protocols import Part, Reply

__all__ = ["UncachedModel", "expanded", "image_token", "processed"]


def processed(processor: Any, template: str, parts: Sequence[Part]) -> Any:
    """What transformers' processor makes of one user turn, as tensors.

    Frames are given as a flat list: that is what published results come from.

    Raises:
        DataError: a frame cannot be read.
    """
    text = render(processor.tokenizer, template, parts, image_token(processor))
    images = [part.load() for part in parts if isinstance(part, FrameRef)]
    return processor(
        text=[text],
        images=images or None,
        add_special_tokens=not begins(processor.tokenizer, text),
        return_tensors="pt",
    )


def image_token(processor: Any) -> str:
    """The token that a chat template writes for an image and the processor expands.

    Raises:
        ModelError: the processor names none.
    """
    token = getattr(processor, "boi_token", None) or getattr(processor, "image_token", None)
    if not isinstance(token, str):
        raise ModelError(f"{type(processor).__name__} names no image token, so its frames cannot be counted")
    return token


def expanded(processor: Any, image: Image.Image) -> list[int]:
    """The ids that the processor expands the token of one image to."""
    inputs = processor(text=[image_token(processor)], images=[image], add_special_tokens=False, return_tensors="pt")
    ids: list[int] = inputs["input_ids"][0].tolist()
    return ids


class _StopAt(StoppingCriteria):
    """Ends generation as soon as the reply's text has a stop string."""

    def __init__(self, tokenizer: Any, n_context: int, stop: Sequence[str]) -> None:
        self._tokenizer = tokenizer
        self._n_context = n_context
        self._stop = stop

    def __call__(self, input_ids: torch.Tensor, scores: torch.Tensor, **kwargs: Any) -> torch.Tensor:
        text = self._tokenizer.decode(input_ids[0, self._n_context :], skip_special_tokens=True)
        done = cut_at_stop(text, self._stop) is not None
        return torch.tensor([done], device=input_ids.device)


class UncachedModel(OneByOne):
    """A loaded checkpoint behind the `Model` protocol, without any sharing.

    Args:
        name: the registry's name.
        loaded: the checkpoint.
        processor: its processor.
        options: how to run it.
    """

    def __init__(self, name: str, loaded: Loaded, processor: Any, options: HfOptions) -> None:
        self.name = name
        self._loaded = loaded
        self._processor = processor
        self._options = options

    @property
    def max_tokens(self) -> int | None:
        """The checkpoint's context limit, or the option's."""
        return context_limit(self._loaded, self._options)

    @property
    def max_tokens_before_extension(self) -> int | None:
        """The checkpoint's own limit where an option extends it."""
        return limit_before_extension(self._loaded, self._options)

    def identity(self) -> dict[str, Any]:
        """Checkpoint, precision, kernels, versions and generation settings, as JSON values."""
        return identity(self.name, self._loaded, self._options)

    def tokens_per_frame(self, frame: FrameRef) -> int:
        """How many tokens one frame becomes, as the checkpoint's processor has it."""
        return len(expanded(self._processor, frame.load()))

    def conversation(self) -> BackendConversation:
        """A new, empty conversation."""
        return BackendConversation(self)

    def close(self) -> None:
        """Free the weights."""
        del self._loaded, self._processor
        if torch.cuda.is_available():
            torch.cuda.empty_cache()

    def count(self, parts: Sequence[Part]) -> int:
        """Tokens that a reply to these parts would be made from."""
        return int(processed(self._processor, self._loaded.template, parts)["input_ids"].shape[1])

    @torch.inference_mode()
    def answer(self, parts: Sequence[Part], max_new_tokens: int, stop: Sequence[str]) -> Reply:
        """Answer one user turn; see `Conversation.reply`."""
        inputs = processed(self._processor, self._loaded.template, parts)
        n_context = int(inputs["input_ids"].shape[1])
        check_limit(self.name, n_context, max_new_tokens, self.max_tokens)
        model, tokenizer = self._loaded.model, self._loaded.tokenizer
        weight = model.get_input_embeddings().weight
        with naming_memory_errors(self.name, n_context):
            output = model.generate(
                **inputs.to(weight.device, model.dtype),
                do_sample=False,
                max_new_tokens=max_new_tokens,
                stopping_criteria=StoppingCriteriaList([_StopAt(tokenizer, n_context, stop)]),
            )
        ends = self._loaded.generation.end_ids
        ids = [token for token in output[0, n_context:].tolist() if token not in ends]
        text = tokenizer.decode(ids, skip_special_tokens=True)
        before_stop = cut_at_stop(text, stop)
        return Reply(text if before_stop is None else before_stop, tuple(ids), n_context, 0)
