"""Any image-text-to-text model, by its own processor and `generate`, encoding everything for every reply.

The slow way that is right for every architecture: what the shared machinery cannot run (attention in both directions
over images, vision features that enter at several layers), this does.
"""

from collections.abc import Sequence
from typing import Any

import torch
from PIL import Image
from transformers import LogitsProcessor, LogitsProcessorList, StoppingCriteria, StoppingCriteriaList

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.backend import BackendConversation
from model_adapters.hf.decoding import ReplyState, extend_replies
from model_adapters.hf.description import capabilities, identity
from model_adapters.hf.limits import check_limit, naming_memory_errors, naming_model_errors
from model_adapters.hf.loaded import Loaded
from model_adapters.hf.rendering import begins, render
from model_adapters.hf.replies import begin_reply, end_reply
from model_adapters.options.checkpoints import HfOptions
from model_adapters.protocols import Capabilities, Decoding, Reply, Turn

__all__ = ["UncachedModel", "expanded", "image_token", "processed"]


def processed(processor: Any, template: str, turns: Sequence[Turn]) -> Any:
    """What transformers' processor makes of a conversation, as tensors.

    Frames are given as a flat list: that is what published results come from.

    Raises:
        DataError: a frame cannot be read.
        ModelError: the template refuses the turns.
    """
    text = render(processor.tokenizer, template, turns, image_token(processor))
    images = [part.load() for turn in turns for part in turn.parts if isinstance(part, FrameRef)]
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


class _Dictate(LogitsProcessor):
    """Has `generate` take the tokens that a reply chooses."""

    def __init__(self, reply: ReplyState) -> None:
        self._reply = reply

    def __call__(self, input_ids: torch.LongTensor, scores: torch.FloatTensor) -> torch.FloatTensor:
        extend_replies([(self._reply, scores[0])])
        if not self._reply.done:
            scores[0, self._reply.ids[-1]] = torch.inf
        return scores


class _Done(StoppingCriteria):
    """Ends `generate` with the reply."""

    def __init__(self, reply: ReplyState) -> None:
        self._reply = reply

    def __call__(self, input_ids: torch.Tensor, scores: torch.Tensor, **kwargs: Any) -> torch.Tensor:
        return torch.tensor([self._reply.done], device=input_ids.device)


class UncachedModel:
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
    def capabilities(self) -> Capabilities:
        """Sampling and choices, one request at a time."""
        return capabilities(self._loaded, self._options, batch_size=1)

    def identity(self) -> dict[str, Any]:
        """Checkpoint, precision, kernels, versions and generation settings, as JSON values."""
        return identity(self.name, self._loaded, self._options)

    def tokens_per_frame(self, frame: FrameRef) -> int:
        """How many tokens one frame becomes, as the checkpoint's processor has it."""
        with naming_model_errors(self.name):
            return len(expanded(self._processor, frame.load()))

    def conversation(self) -> BackendConversation:
        """A new, empty conversation."""
        return BackendConversation(self)

    def close(self) -> None:
        """Free the weights."""
        del self._loaded, self._processor
        if torch.cuda.is_available():
            torch.cuda.empty_cache()

    def count(self, turns: Sequence[Turn]) -> int:
        """Tokens that a reply to these turns would be made from."""
        with naming_model_errors(self.name):
            return int(processed(self._processor, self._loaded.template, turns)["input_ids"].shape[1])

    def answer_each(self, conversations: Sequence[Sequence[Turn]], decoding: Decoding) -> list[Reply]:
        """Answer several conversations, one after the other; see `Conversation.replies`."""
        return [self.answer(turns, decoding) for turns in conversations]

    @torch.inference_mode()
    def answer(self, turns: Sequence[Turn], decoding: Decoding) -> Reply:
        """Answer a conversation; see `Conversation.reply`."""
        with naming_model_errors(self.name):
            inputs = processed(self._processor, self._loaded.template, turns)
        n_context = int(inputs["input_ids"].shape[1])
        check_limit(self.name, n_context, decoding.max_new_tokens, self.capabilities.max_tokens)
        reply = begin_reply(self._loaded, decoding, inputs["input_ids"][0].tolist())
        weight = self._loaded.model.get_input_embeddings().weight
        with naming_model_errors(self.name), naming_memory_errors(self.name, n_context):
            self._loaded.model.generate(
                **inputs.to(weight.device, self._loaded.model.dtype),
                do_sample=False,
                repetition_penalty=1.0,
                max_new_tokens=decoding.max_new_tokens,
                logits_processor=LogitsProcessorList([_Dictate(reply)]),
                stopping_criteria=StoppingCriteriaList([_Done(reply)]),
            )
        return end_reply(self._loaded, reply, n_context, n_cached=0)
