"""Ways of answering questions on one trajectory, for benchmarks: ours, and transformers' alone."""

import time
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import torch
from transformers import DynamicCache

from infthor_eval.formats.frames import FrameRef
from infthor_eval.report.presenter import ReplyTokens
from model_adapters import Decoding, Reply
from model_adapters.hf.cached.model import TransformersModel

__all__ = [
    "Replies",
    "Timed",
    "answer_in_batches",
    "answer_one_by_one",
    "answer_with_transformers",
    "clear_cache",
    "timed",
]

PROMPT = (
    "\nAnswer the question given the agent's views in time order. Do not include explanation or "
    "reasoning in the answer. Answer with a single word or words.\nQuestion: "
)
Replies = list[ReplyTokens]
Timed = tuple[float, Replies]
T = TypeVar("T")


def clear_cache(model: TransformersModel) -> None:
    """Clear the caches of a model."""
    model._prefix.reset()
    model._embed.clear()


def answer_one_by_one(
    model: Any, frames: Sequence[FrameRef], questions: Sequence[str], new_tokens: int
) -> Replies:
    """Answer all questions on one prefix, as the NIEH runner does."""
    talk = model.conversation()
    talk.append(*frames)
    start = talk.mark()
    replies = []
    for question in questions:
        talk.append(PROMPT + question)
        replies.append(_answer(talk.reply(Decoding(max_new_tokens=new_tokens))))
        talk.rewind(start)
    return replies


def answer_in_batches(
    model: Any, frames: Sequence[FrameRef], questions: Sequence[str], new_tokens: int
) -> Replies:
    """Answer all questions on one prefix, several at a time."""
    talk, decoding = model.conversation(), Decoding(max_new_tokens=new_tokens)
    talk.append(*frames)
    return [
        _answer(reply) for reply in talk.replies([[PROMPT + text] for text in questions], decoding)
    ]


def _answer(reply: Reply) -> ReplyTokens:
    return ReplyTokens(reply.token_ids, reply.margins or ())


@torch.inference_mode()
def answer_with_transformers(
    model: Any,
    frames: Sequence[FrameRef],
    questions: Sequence[str],
    new_tokens: int,
    chunk_frames: int = 8,
) -> Replies:
    """Answer all questions with the bare model, computing only what is necessary."""
    bare, tokenizer = model._loaded.model, model._loaded.tokenizer
    processor, pad = model._loaded.family._image_processor, bare.config.image_token_id
    content: list[dict[str, str]] = [{"type": "image"}] * len(frames) + [
        {"type": "text", "text": "@"}
    ]
    text = tokenizer.apply_chat_template(
        [{"role": "user", "content": content}],
        chat_template=model._loaded.template,
        tokenize=False,
        add_generation_prompt=True,
    )
    head, tail = text.replace("<|image_pad|>", "<|image_pad|>" * 121).split("@")
    device = bare.device
    ids = torch.tensor([tokenizer(head)["input_ids"]], device=device)
    grids = torch.tensor([[1, 22, 22]] * len(frames))
    positions, _ = bare.model.get_rope_index(ids, (ids == pad).int(), image_grid_thw=grids)
    cache = DynamicCache()
    # Chunks end after the end marker of a frame; the first chunk also has the start of the
    # template.
    ends = [ids.shape[1] - 123 * left for left in range(len(frames) - 1, -1, -1)]
    for at in range(0, len(frames), chunk_frames):
        some = frames[at : at + chunk_frames]
        images = processor(images=[ref.load() for ref in some], return_tensors="pt")
        part = slice(cache.get_seq_length(), ends[at + len(some) - 1])
        bare(
            input_ids=ids[:, part],
            pixel_values=images["pixel_values"].to(device),
            image_grid_thw=images["image_grid_thw"].to(device),
            position_ids=positions[:, :, part],
            past_key_values=cache,
            logits_to_keep=1,
        )
    behind = int(positions.max()) + 1
    return [
        _decode(model, cache, tokenizer(PROMPT + question + tail)["input_ids"], behind, new_tokens)
        for question in questions
    ]


def _decode(
    model: Any, cache: DynamicCache, ids: list[int], position: int, new_tokens: int
) -> ReplyTokens:
    bare, ends = model._loaded.model, model._loaded.generation.end_ids
    device = bare.device
    n_prefix = cache.get_seq_length()
    reply: list[int] = []
    feed = ids
    while True:
        positions = torch.arange(position, position + len(feed), device=device).expand(3, 1, -1)
        ids_fed = torch.tensor([feed], device=device)
        output = bare(
            input_ids=ids_fed, position_ids=positions, past_key_values=cache, logits_to_keep=1
        )
        position += len(feed)
        token = int(output.logits[0, -1].argmax())
        if token in ends:
            break
        reply.append(token)
        if len(reply) == new_tokens:
            break
        feed = [token]
    cache.crop(n_prefix - cache.get_seq_length())
    return ReplyTokens(tuple(reply), ())


def timed(run: Callable[[], T]) -> tuple[float, T]:
    """Return the seconds that it took, and its result."""
    start = time.perf_counter()
    result = run()
    return time.perf_counter() - start, result
