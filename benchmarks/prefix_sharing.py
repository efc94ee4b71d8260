"""Measure what sharing the frame prefix between the questions of one trajectory saves.

One run measures, with the same Qwen2.5-VL with random weights and the same frames and questions:
  shared   our conversation: frames are appended once, then append, reply and rewind per question;
  batched  the same with all questions passed at once and answered --batch-size at a time;
  plain    as shared with share_prefix=false: everything is encoded for every question, as in a
           plain loop;
  floor    transformers alone: one chunked prefill of the frames into its own cache, then per
           question the tokens of the question and the reply. Nothing can be faster with the same
           model.

    python benchmarks/prefix_sharing.py --frames 120 --questions 24

On a machine with a GPU it also prints tokens per second in the form of published_evaluation.py,
peak memory and the largest context that fits, for random weights of the real shape:

    python benchmarks/prefix_sharing.py --device cuda --model-size 7b --largest --attention
    flash_attention_2
"""

import argparse
import json
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from noise_set import question_texts, write_frames
from transformers import DynamicCache, Qwen2_5_VLConfig

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters import Decoding
from model_adapters.hf.cached.model import TransformersModel
from model_adapters.options.tiny import TinyOptions
from model_adapters.tiny.qwen2_5_vl import Qwen25VLTiny
from model_adapters.tiny.twin import TinyAdapter

PROMPT = (
    "\nAnswer the question given the agent's views in time order. Do not include explanation or "
    "reasoning in the answer. Answer with a single word or words.\nQuestion: "
)
Replies = list[tuple[int, ...]]
Timed = tuple[float, Replies]


def main() -> None:
    """Run the four ways, and print seconds, factors and whether the replies are equal."""
    options = _arguments()
    torch.set_num_threads(options.threads)
    questions = question_texts(options.questions)
    with tempfile.TemporaryDirectory() as folder:
        frames = [
            FrameRef(path) for path in write_frames(Path(folder), options.frames, options.seed)
        ]
        sharing = build(options)
        not_sharing = TransformersModel(
            "plain", sharing._loaded, replace(sharing._options, share_prefix=False)
        )
        answer_one_by_one(
            sharing, frames[:1], questions[:1], 2
        )  # warms up imports, threads and kernels
        ways = {
            "shared": lambda: answer_one_by_one(sharing, *work),
            "batched": lambda: answer_in_batches(sharing, *work),
            "floor": lambda: answer_with_transformers(sharing, *work),
        }
        work = frames, questions, options.new_tokens
        measured: dict[str, list[Timed]] = {name: [] for name in ways}
        for _ in range(options.repeats):
            for (
                name,
                way,
            ) in ways.items():  # alternating, so that other work on the machine affects all alike
                clear_cache(sharing)
                measured[name].append(_time(way))
        measured["plain"] = [_time(lambda: answer_one_by_one(not_sharing, *work))]
        if options.json:
            print(json.dumps(figures(measured)))
            return
        report(measured, options)
        machine_report(sharing, frames, options)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=120)
    parser.add_argument("--questions", type=int, default=24)
    parser.add_argument("--new-tokens", type=int, default=16)
    parser.add_argument(
        "--repeats", type=int, default=3, help="runs of all ways but plain; the fastest is printed"
    )
    parser.add_argument("--batch-size", type=int, default=8)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--model-size", choices=("tiny", "7b"), default="tiny")
    parser.add_argument("--attention", default="sdpa", help="attn_implementation")
    parser.add_argument("--chunk-tokens", type=int, default=1024)
    parser.add_argument("--largest", action="store_true", help="find the largest context that fits")
    parser.add_argument(
        "--json", action="store_true", help="print seconds and factors as one JSON object"
    )
    options = parser.parse_args()
    if options.largest and not options.device.startswith("cuda"):
        parser.error("--largest needs --device cuda, as a CPU swaps memory and has no clear limit")
    return options


def build(options: argparse.Namespace) -> TransformersModel:
    """Build a Qwen2.5-VL with random weights, tiny in float32 or of the 7B model's shape in
    bfloat16."""
    twin, dtype = Qwen25VLTiny.twin, "float32"
    if options.model_size == "7b":
        twin, dtype = replace(twin, config=_real_shape), "bfloat16"
    adapter = type("Adapter", (TinyAdapter,), {"twin": twin})
    settings = TinyOptions(
        device=options.device,
        dtype=dtype,
        attn_implementation=options.attention,
        chunk_tokens=options.chunk_tokens,
        batch_size=options.batch_size,
        max_tokens=0,
    )
    return adapter.build(f"qwen2.5-vl-{options.model_size}", settings, options.seed)


def _real_shape(ids: Mapping[str, int], vocab_size: int) -> Qwen2_5_VLConfig:  # noqa: ARG001 - the real vocabulary
    config: Qwen2_5_VLConfig = Qwen25VLTiny.twin.config(ids, 152_064)
    text, vision = config.text_config, config.vision_config
    text.hidden_size, text.intermediate_size, text.num_hidden_layers = 3584, 18_944, 28
    text.num_attention_heads, text.num_key_value_heads, text.layer_types = (
        28,
        4,
        ["full_attention"] * 28,
    )
    text.rope_parameters["mrope_section"] = [16, 24, 24]
    vision.depth, vision.hidden_size, vision.intermediate_size, vision.num_heads = (
        32,
        1280,
        3420,
        16,
    )
    vision.out_hidden_size, vision.fullatt_block_indexes = 3584, [7, 15, 23, 31]
    text.initializer_range = vision.initializer_range = 0.02
    return config


def clear_cache(model: TransformersModel) -> None:
    """Clear the caches of a model."""
    model._prefix.reset()
    model._features.clear()


def machine_report(
    model: TransformersModel, frames: Sequence[FrameRef], options: argparse.Namespace
) -> None:
    """Print the speed of encoding and decoding, the peak memory of a GPU, and the largest context
    that fits."""
    on_gpu = options.device.startswith("cuda")
    if on_gpu:
        torch.cuda.reset_peak_memory_stats()
    points = []
    for some in (frames[: max(1, len(frames) // 8)], frames):
        clear_cache(model)
        seconds, replies = _time(lambda some=some: [_prefill(model, some)])
        points.append(f"{replies[0][0]}:{replies[0][0] / seconds:.0f}")
    print(f"prefill          {','.join(points)} (tokens:tokens/s)")
    print(f"decode           {_decoding_speed(model, frames[:1]):.1f} tokens/s")
    if on_gpu:
        print(f"peak memory      {torch.cuda.max_memory_allocated() / 2**30:.1f} GiB")
    if options.largest:
        print(f"largest context  {_largest(model, frames)} tokens (found by doubling)")


def _decoding_speed(
    model: TransformersModel, frames: Sequence[FrameRef], few: int = 2, more: int = 34
) -> float:
    """Return the tokens per second of a reply on a short context, from the difference of two
    replies."""
    times, lengths = [], []
    for new in (few, more):
        answer_one_by_one(model, frames, [""], new)
        seconds, replies = _time(lambda new=new: answer_one_by_one(model, frames, [""], new))
        times.append(seconds)
        lengths.append(len(replies[0]))
    return (lengths[1] - lengths[0]) / (times[1] - times[0])


def _prefill(model: TransformersModel, frames: Sequence[FrameRef]) -> tuple[int, ...]:
    talk = model.conversation()
    talk.append(*frames)
    return (talk.reply(Decoding(max_new_tokens=1)).n_context_tokens or 0,)


def _largest(model: TransformersModel, frames: Sequence[FrameRef]) -> int:
    fits = 0
    repeated = list(frames)
    while True:
        clear_cache(model)
        try:
            fits = _prefill(model, repeated)[0]
        except ModelError:
            return fits
        repeated *= 2


def report(measured: dict[str, list[Timed]], options: argparse.Namespace) -> None:
    """Print the fastest time of each way, the factors, and whether all replies are equal."""
    found = figures(measured)
    print(
        f"{options.frames} frames, {options.questions} questions, {options.new_tokens} new tokens "
        "each"
    )
    for name in measured:
        print(f"{name:8s}{found[name]:9.2f} s")
    for name in ("plain / batched", "plain / shared", "shared / floor"):
        print(f"{name:16s}{found[name]:7.2f}")
    print(f"replies equal    {'yes' if found['replies equal'] else 'NO'}")


def figures(measured: dict[str, list[Timed]]) -> dict[str, float | bool]:
    """Return the fastest seconds of each way, the factors, and whether all replies are equal."""
    best = {name: min(seconds for seconds, _ in runs) for name, runs in measured.items()}
    replies = [reply for runs in measured.values() for _, reply in runs]
    return {
        **best,
        "plain / batched": best["plain"] / best["batched"],
        "plain / shared": best["plain"] / best["shared"],
        "shared / floor": best["shared"] / best["floor"],
        "replies equal": all(reply == replies[0] for reply in replies),
    }


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
        replies.append(talk.reply(Decoding(max_new_tokens=new_tokens)).token_ids)
        talk.rewind(start)
    return replies


def answer_in_batches(
    model: Any, frames: Sequence[FrameRef], questions: Sequence[str], new_tokens: int
) -> Replies:
    """Answer all questions on one prefix, several at a time."""
    talk, decoding = model.conversation(), Decoding(max_new_tokens=new_tokens)
    talk.append(*frames)
    return [
        reply.token_ids for reply in talk.replies([[PROMPT + text] for text in questions], decoding)
    ]


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
) -> tuple[int, ...]:
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
    return tuple(reply)


def _time(run: Callable[[], Replies]) -> Timed:
    start = time.perf_counter()
    result = run()
    return time.perf_counter() - start, result


if __name__ == "__main__":
    main()
