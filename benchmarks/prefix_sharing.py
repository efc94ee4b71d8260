"""What sharing the frame prefix between the questions of one trajectory saves.

One run measures, on the same tiny Qwen2.5-VL, frames and questions:
  shared   our conversation: frames appended once, then append, reply, rewind per question;
  plain    the same with share_prefix=false: everything is encoded for every question, as a plain loop does;
  floor    transformers alone, written out: one chunked prefill of the frames into its own cache, then per question the
           question's tokens and the reply's. Nothing can be faster without another model.

    python benchmarks/prefix_sharing.py --frames 120 --questions 24
"""

import argparse
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image
from transformers import DynamicCache

from infthor_eval.formats.frames import FrameRef
from model_adapters import load

PROMPT = (
    "\nAnswer the question given the agent's views in time order. Do not include explanation or reasoning in the "
    "answer. Answer with a single word or words.\nQuestion: "
)
OBJECTS = ("mug", "plate", "apple", "pillow", "laptop", "candle", "bowl", "book")


Replies = list[tuple[int, ...]]
Timed = tuple[float, Replies]


def main() -> None:
    """Run the three ways and print seconds, factors and whether the replies are equal."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=120)
    parser.add_argument("--questions", type=int, default=24)
    parser.add_argument("--new-tokens", type=int, default=16)
    parser.add_argument("--repeats", type=int, default=3, help="runs of shared and floor; the best counts")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    torch.set_num_threads(options.threads)
    questions = [f"Did you see {number} {OBJECTS[number % 8]}s?" for number in range(options.questions)]
    with tempfile.TemporaryDirectory() as folder:
        frames = synthetic_trajectory(Path(folder), options.frames, options.seed)
        sharing, not_sharing = _tiny("true"), _tiny("false")
        conversation(sharing, frames[:1], questions[:1], 2)  # imports, threads and kernels warm up here
        sharing._features.clear()
        work = frames, questions, options.new_tokens
        shared, floor = [], []
        for _ in range(options.repeats):  # in turn, so that a busy machine is busy for both
            sharing._prefix.reset()
            sharing._features.clear()
            shared.append(_timed(lambda: conversation(sharing, *work)))
            floor.append(_timed(lambda: transformers_alone(sharing, *work)))
        plain = [_timed(lambda: conversation(not_sharing, *work))]
    report({"shared": shared, "plain": plain, "floor": floor}, options)


def report(measured: dict[str, list[Timed]], options: argparse.Namespace) -> None:
    """Print the best time of each way, the factors, and whether all replies are equal."""
    best = {name: min(seconds for seconds, _ in runs) for name, runs in measured.items()}
    replies = [reply for runs in measured.values() for _, reply in runs]
    print(f"{options.frames} frames, {options.questions} questions, {options.new_tokens} new tokens each")
    for name, seconds in best.items():
        print(f"{name:8s}{seconds:9.2f} s")
    print(f"plain / shared   {best['plain'] / best['shared']:6.2f}")
    print(f"shared / floor   {best['shared'] / best['floor']:6.2f}")
    print(f"replies equal    {'yes' if all(reply == replies[0] for reply in replies) else 'NO'}")


def synthetic_trajectory(folder: Path, n_frames: int, seed: int) -> list[FrameRef]:
    """Frames of 300x300 with coarse coloured noise, all different."""
    draw = np.random.default_rng(seed)
    refs = []
    for index in range(n_frames):
        path = folder / f"{index:09d}.png"
        coarse = draw.integers(0, 256, (10, 10, 3), dtype=np.uint8)
        Image.fromarray(coarse).resize((300, 300), Image.Resampling.BICUBIC).save(path)
        refs.append(FrameRef(path))
    return refs


def conversation(model: Any, frames: Sequence[FrameRef], questions: Sequence[str], new_tokens: int) -> Replies:
    """Answer all questions on one prefix, as the NIEH runner does."""
    talk = model.conversation()
    talk.append(*frames)
    start = talk.mark()
    replies = []
    for question in questions:
        talk.append(PROMPT + question)
        replies.append(talk.reply(new_tokens).token_ids)
        talk.rewind(start)
    return replies


@torch.inference_mode()
def transformers_alone(
    model: Any, frames: Sequence[FrameRef], questions: Sequence[str], new_tokens: int, chunk_frames: int = 8
) -> Replies:
    """The same answers with the bare model: what has to be computed, and nothing around it."""
    bare, tokenizer = model._loaded.model, model._loaded.tokenizer
    processor, pad = model._loaded.family._image_processor, bare.config.image_token_id
    content: list[dict[str, str]] = [{"type": "image"}] * len(frames) + [{"type": "text", "text": "@"}]
    text = tokenizer.apply_chat_template(
        [{"role": "user", "content": content}],
        chat_template=model._loaded.template,
        tokenize=False,
        add_generation_prompt=True,
    )
    head, tail = text.replace("<|image_pad|>", "<|image_pad|>" * 121).split("@")
    ids = torch.tensor([tokenizer(head)["input_ids"]])
    grids = torch.tensor([[1, 22, 22]] * len(frames))
    positions, _ = bare.model.get_rope_index(ids, (ids == pad).int(), image_grid_thw=grids)
    cache = DynamicCache()
    # Frames are cut behind their end marker; the first chunk also holds the template's opening.
    ends = [ids.shape[1] - 123 * left for left in range(len(frames) - 1, -1, -1)]
    for at in range(0, len(frames), chunk_frames):
        some = frames[at : at + chunk_frames]
        images = processor(images=[ref.load() for ref in some], return_tensors="pt")
        part = slice(cache.get_seq_length(), ends[at + len(some) - 1])
        bare(
            input_ids=ids[:, part],
            pixel_values=images["pixel_values"],
            image_grid_thw=images["image_grid_thw"],
            position_ids=positions[:, :, part],
            past_key_values=cache,
            logits_to_keep=1,
        )
    behind = int(positions.max()) + 1
    return [
        _decode(model, cache, tokenizer(PROMPT + question + tail)["input_ids"], behind, new_tokens)
        for question in questions
    ]


def _decode(model: Any, cache: DynamicCache, ids: list[int], position: int, new_tokens: int) -> tuple[int, ...]:
    bare, ends = model._loaded.model, model._loaded.generation.end_ids
    n_prefix = cache.get_seq_length()
    reply: list[int] = []
    feed = ids
    while True:
        positions = torch.arange(position, position + len(feed)).expand(3, 1, -1)
        output = bare(input_ids=torch.tensor([feed]), position_ids=positions, past_key_values=cache, logits_to_keep=1)
        position += len(feed)
        token = int(output.logits[0, -1].argmax())
        if token in ends:
            break
        reply.append(token)
        if len(reply) == new_tokens:
            break
        feed = [token]
    cache.crop(n_prefix - cache.get_seq_length())
    return tuple(reply)


def _tiny(share_prefix: str) -> Any:
    return load("qwen2.5-vl-tiny", {"share_prefix": share_prefix}, seed=0)


def _timed(run: Callable[[], Replies]) -> Timed:
    start = time.perf_counter()
    result = run()
    return time.perf_counter() - start, result


if __name__ == "__main__":
    main()
