"""Any image-text-to-text model, run by its processor and `generate`, with no cache for replies.

It is slow and correct for every architecture, including those that cannot share prefixes: attention
in both directions over images, or vision features that enter at several layers.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import torch
from PIL import Image
from transformers import (
    LogitsProcessor,
    LogitsProcessorList,
    StoppingCriteria,
    StoppingCriteriaList,
)

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.hf.cached.decoding import ReplyState, extend_replies
from model_adapters.hf.cached.replies import begin_reply, end_reply
from model_adapters.hf.checkpoint_model import HfModel
from model_adapters.hf.global_settings import torch_threads
from model_adapters.hf.limits import check_limit, wrap_memory_errors, wrap_model_errors
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.prompting.hashing import hash_frame, hash_frames, split_frames
from model_adapters.hf.prompting.rendering import Marks, render, starts_with_bos
from model_adapters.options.checkpoints import HfOptions
from model_adapters.protocols import Capabilities, Decoding, Reply, Turn


def process_turns(processor: Any, template: str, turns: Sequence[Turn]) -> Any:
    """Return the tensors that transformers' processor makes of a conversation.

    Frames are passed as a flat list, as in the published results.
    """
    text = render(processor.tokenizer, template, turns, Marks(image_token(processor)))
    images = [part.load() for turn in turns for part in turn.parts if isinstance(part, FrameRef)]
    return processor(
        text=[text],
        images=images or None,
        add_special_tokens=not starts_with_bos(processor.tokenizer, text),
        return_tensors="pt",
    )


def image_token(processor: Any) -> str:
    """Return the image token of chat templates, which the processor expands.

    Processors look for their `image_token`. Most that have a `boi_token`, too, write it around what
    they expand that to (Gemma 4, Cohere 2 Vision); the first ones have nothing else (Kosmos 2).
    """
    token = getattr(processor, "image_token", None) or getattr(processor, "boi_token", None)
    if not isinstance(token, str):
        raise ModelError(
            f"{type(processor).__name__} names no image token, so its frames cannot be counted"
        )
    return token


def n_image_tokens(processor: Any, image: Image.Image) -> int:
    """Return the tokens of one more image in a prompt.

    What the processor writes once around a whole prompt, or between two images for both, is not one
    image's.
    """
    one, two = (expand_image_tokens(processor, [image] * n)["input_ids"].shape[1] for n in (1, 2))
    return int(two - one)


def expand_image_tokens(processor: Any, images: Sequence[Image.Image]) -> Any:
    """Return the tensors that the processor makes of image tokens and their images, with what it
    writes around every prompt."""
    return processor(
        text=[image_token(processor) * len(images)],
        images=[*images],
        add_special_tokens=False,
        return_tensors="pt",
    )


class _ForceReplyTokens(LogitsProcessor):
    """Makes `generate` emit the tokens that a `ReplyState` chooses, so that decoding is the same as
    with a cache."""

    def __init__(self, reply: ReplyState) -> None:
        self._reply = reply

    def __call__(self, input_ids: torch.LongTensor, scores: torch.FloatTensor) -> torch.FloatTensor:
        n_before = len(self._reply.ids)
        extend_replies([(self._reply, scores[0])])
        if len(self._reply.ids) > n_before:  # it did not end before this token
            scores[0, self._reply.ids[-1]] = torch.inf
        return scores


class _StopWithReply(StoppingCriteria):
    """Ends `generate` when the reply is done."""

    def __init__(self, reply: ReplyState) -> None:
        self._reply = reply

    def __call__(
        self, input_ids: torch.Tensor, scores: torch.Tensor, **kwargs: Any
    ) -> torch.Tensor:
        return torch.tensor([self._reply.done], device=input_ids.device)


class UncachedModel(HfModel):
    """A loaded checkpoint behind the `Model` protocol, without a shared prefix."""

    def __init__(
        self, name: str, loaded: LoadedCheckpoint, processor: Any, options: HfOptions
    ) -> None:
        super().__init__(name, loaded, options)
        self._processor = processor

    def tokens_per_frame(self, frame: FrameRef) -> int:
        """Return the tokens of one more frame, as the checkpoint's processor expands it."""
        with wrap_model_errors(self.name):
            return n_image_tokens(self._processor, frame.load())

    @property
    def capabilities(self) -> Capabilities:
        """Those of `HfModel` without a video input: the processor would need torchvision for it."""
        return replace(super().capabilities, video_input=False)

    def close(self) -> None:
        """Free the weights."""
        del self._processor
        super().close()

    def count(self, turns: Sequence[Turn]) -> int:
        """Return the context size of a reply to these turns, in tokens."""
        return int(self._inputs(turns)["input_ids"].shape[1])

    def answer_each(
        self, conversations: Sequence[Sequence[Turn]], decoding: Decoding
    ) -> list[Reply]:
        """Answer several conversations, one after the other; see `Conversation.replies`."""
        with torch_threads(self._threads):
            return [self._answer(turns, decoding) for turns in conversations]

    def _inputs(self, turns: Sequence[Turn]) -> Any:
        with wrap_model_errors(self.name):
            return process_turns(self._processor, self._loaded.template, turns)

    def try_generate(self, turns: Sequence[Turn]) -> None:
        """Have `generate` reply with two tokens, whatever the context limit is."""
        with torch_threads(self._threads):
            self._generate(self._inputs(turns), 0, Decoding(max_new_tokens=2))

    def _answer(self, turns: Sequence[Turn], decoding: Decoding) -> Reply:
        inputs = self._inputs(turns)
        n_context = int(inputs["input_ids"].shape[1])
        check_limit(self.name, n_context, decoding.max_new_tokens, self.capabilities.max_tokens)
        n_frames = sum(isinstance(part, FrameRef) for turn in turns for part in turn.parts)
        return self._generate(inputs, n_frames, decoding)

    @torch.inference_mode()
    def _generate(self, inputs: Any, n_frames: int, decoding: Decoding) -> Reply:
        """Reply to what the processor made of a conversation with so many frames."""
        frames = [hash_frame(pixels) for pixels in split_frames(inputs, n_frames)]
        context: list[int] = inputs["input_ids"][0].tolist()
        margins = self._options.margins
        reply = begin_reply(self._loaded, decoding, context, keep_margins=margins)
        weight = self._loaded.model.get_input_embeddings().weight
        with wrap_model_errors(self.name), wrap_memory_errors(self.name, len(context)):
            output = self._loaded.model.generate(
                **inputs.to(weight.device, self._loaded.model.dtype),
                do_sample=False,
                repetition_penalty=1.0,
                max_new_tokens=decoding.max_new_tokens,
                logits_processor=LogitsProcessorList([_ForceReplyTokens(reply)]),
                stopping_criteria=StoppingCriteriaList([_StopWithReply(reply)]),
            )
        self._check_generated(output, context, reply)
        frames_hash = hash_frames(frames) if len(frames) == n_frames else None
        return end_reply(self._loaded, reply, context, frames_hash, n_cached=0)

    def _check_generated(self, output: Any, context: list[int], reply: ReplyState) -> None:
        """Raise `ModelError` unless `generate` returned the reply's tokens, with or without an end
        token: some models have their own `generate`, which ignores what chooses the tokens."""
        # Settings of a checkpoint can make it an object with more.
        ids = getattr(output, "sequences", output)[0].tolist()
        if self._loaded.model.config.is_encoder_decoder:
            ids = ids[1:]  # the token that a decoder starts with
        elif ids[: len(context)] == context:
            ids = ids[len(context) :]
        n = len(reply.ids)
        if not reply.done or ids[:n] != reply.ids or len(ids) > n + 1:
            kind = type(self._loaded.model).__name__
            raise ModelError(
                f"{kind}.generate returns other tokens than were chosen ({len(ids)} and {n}): it "
                "cannot be run without shared prefixes; use share_prefix=true"
            )
