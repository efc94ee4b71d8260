"""Measure what sharing the frame prefix between the questions of one trajectory saves.

One run measures, with the same Qwen2.5-VL with random weights and the same frames and questions:
  shared   our conversation: frames are appended once, then append, reply and rewind per question;
  batched  the same with all questions passed at once and answered --batch-size at a time;
  plain    as shared with share_prefix=false: everything is encoded for every question, as in a
           plain loop;
  limit    the arithmetic alone: the products of matrices and attention of one prefill of the
           frames and, per question, of the tokens of the question and the reply, each at the rate
           of this machine for its shapes (arithmetic.py). Nothing can be faster with the same model
           and kernels.

    python benchmarks/prefix_sharing.py --frames 120 --questions 24

The share of the limit in the time of a way tells how near it is, and --parts where the time of ours
goes.

With --margins it says, where replies differ, how near a tie the tokens were at which they part.

With --machine it also prints tokens per second in the form of published_evaluation.py, peak memory
and, with --largest, the largest context that fits. On a GPU, for random weights of the real shape:

    python benchmarks/prefix_sharing.py --device cuda --model-size 7b --machine --attention
    flash_attention_2

--chunk-tokens and --batch-size take several values, and --ways some of the ways: all are measured
with the same model.
"""

import argparse
import json
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import torch
from arithmetic import least_seconds, parts_of, record_products
from noise_set import question_texts, write_frames
from prefix_ways import (
    Replies,
    Timed,
    answer_in_batches,
    answer_one_by_one,
    answer_with_transformers,
    clear_cache,
    timed,
)
from transformers import Qwen2_5_VLConfig

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.report.differences import margin_of_difference
from model_adapters import Decoding
from model_adapters.hf.cached.model import TransformersModel
from model_adapters.options.checkpoints import HfOptions
from model_adapters.tiny.qwen2_5_vl import Qwen25VLTiny
from model_adapters.tiny.twin import TinyAdapter

WAYS = ("shared", "batched", "plain", "limit")
FACTORS = (
    "plain / batched",
    "plain / shared",
    "limit / batched",
    "limit / shared",
    "limit / plain",
)


def main() -> None:
    """Measure the ways, and print seconds, factors, whether the replies are equal, and speeds."""
    options = _arguments()
    torch.set_num_threads(options.threads)
    questions = question_texts(options.questions)
    with tempfile.TemporaryDirectory() as folder:
        frames = [
            FrameRef(path) for path in write_frames(Path(folder), options.frames, options.seed)
        ]
        model = build(options)
        # Warms up imports, threads and kernels.
        answer_one_by_one(model, frames[:1], questions[:1], 2)
        measured = measure(model, options, frames, questions)
        parts = {}
        if options.parts:
            clear_cache(model)
            run = partial(answer_one_by_one, model, frames, questions, options.new_tokens)
            parts = parts_of(model._loaded.model.model.visual, run)
        machine = {}
        if options.machine:
            for chunk_tokens in options.chunk_tokens:
                same = _with_options(model, chunk_tokens=chunk_tokens)
                machine[str(chunk_tokens)] = machine_figures(same, frames, options)
    if options.json:
        print(json.dumps({**figures(measured), "machine": machine}))
        return
    report(measured, options)
    for name, share in parts.items():
        print(f"{name:16s}{100 * share:7.1f} % of shared")
    for chunk_tokens, found in machine.items():
        report_machine(chunk_tokens, found)


def measure(
    model: TransformersModel,
    options: argparse.Namespace,
    frames: Sequence[FrameRef],
    questions: Sequence[str],
) -> dict[str, list[Timed]]:
    """Return seconds and replies of each run of each way."""
    work = frames, questions, options.new_tokens
    ways: dict[str, tuple[TransformersModel, Callable[..., Replies]]] = {
        "shared": (model, answer_one_by_one),
    }
    for batch_size in options.batch_size:
        name = "batched" if len(options.batch_size) == 1 else f"batched by {batch_size}"
        ways[name] = (_with_options(model, batch_size=batch_size), answer_in_batches)
    asked = {name: way for name, way in ways.items() if name.split()[0] in options.ways}
    measured: dict[str, list[Timed]] = {name: [] for name in asked}
    for _ in range(options.repeats):
        # Alternating, so that other work on the machine affects all alike.
        for name, (way_model, answer) in asked.items():
            clear_cache(way_model)
            measured[name].append(timed(partial(answer, way_model, *work)))
            clear_cache(way_model)  # its memory is the next one's
    if "plain" in options.ways:
        not_sharing = _with_options(model, share_prefix=False)
        measured["plain"] = [timed(partial(answer_one_by_one, not_sharing, *work))]
    if "limit" in options.ways:
        replies: list[Replies] = []
        products = record_products(lambda: replies.append(answer_with_transformers(model, *work)))
        measured["limit"] = [(least_seconds(products), replies[0])]
    return measured


def _with_options(model: TransformersModel, **changed: Any) -> TransformersModel:
    """Return a model with the same weights, and a cache of its own."""
    return TransformersModel(model.name, model._loaded, replace(model._options, **changed))


def _numbers(text: str) -> list[int]:
    return [int(number) for number in text.split(",")]


def _ways(text: str) -> list[str]:
    names = text.split(",")
    unknown = [name for name in names if name not in WAYS]
    if unknown:
        raise argparse.ArgumentTypeError(f"{unknown[0]} is not one of {', '.join(WAYS)}")
    return names


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=120)
    parser.add_argument("--questions", type=int, default=24)
    parser.add_argument("--new-tokens", type=int, default=16)
    parser.add_argument(
        "--repeats", type=int, default=3, help="runs of all ways but plain; the fastest is printed"
    )
    parser.add_argument("--ways", type=_ways, default=list(WAYS), help="ways, with commas")
    parser.add_argument("--batch-size", type=_numbers, default=[8], help="sizes, with commas")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--model-size", choices=("tiny", "7b"), default="tiny")
    parser.add_argument("--attention", default="sdpa", help="attn_implementation")
    parser.add_argument(
        "--chunk-tokens", type=_numbers, help="sizes, with commas; default that of the option"
    )
    parser.add_argument(
        "--without-cudnn", action="store_true", help="leave cuDNN's kernel out of sdpa's choice"
    )
    parser.add_argument(
        "--margins", action="store_true", help="record how near a tie each token was"
    )
    parser.add_argument("--parts", action="store_true", help="say where the time of ours goes")
    parser.add_argument("--machine", action="store_true", help="measure speeds and memory as well")
    parser.add_argument("--largest", action="store_true", help="find the largest context that fits")
    parser.add_argument(
        "--json", action="store_true", help="print seconds, factors and speeds as one JSON object"
    )
    options = parser.parse_args()
    if options.largest and not options.device.startswith("cuda"):
        parser.error("--largest needs --device cuda, as a CPU swaps memory and has no clear limit")
    options.machine = options.machine or options.largest
    options.chunk_tokens = options.chunk_tokens or [
        HfOptions().chunk_size(torch.device(options.device).type)
    ]
    if options.without_cudnn:
        torch.backends.cuda.enable_cudnn_sdp(False)
    return options


def build(options: argparse.Namespace) -> TransformersModel:
    """Build a Qwen2.5-VL with random weights, tiny in float32 or of the 7B model's shape in
    bfloat16."""
    twin, dtype = Qwen25VLTiny.twin, "float32"
    if options.model_size == "7b":
        twin, dtype = replace(twin, config=_real_shape), "bfloat16"
    adapter = type("Adapter", (TinyAdapter,), {"twin": twin})
    settings = HfOptions(
        device=options.device,
        dtype=dtype,
        attn_implementation=options.attention,
        chunk_tokens=options.chunk_tokens[0],
        batch_size=options.batch_size[0],
        threads=1,
        max_tokens=0,
        margins=options.margins,
    )
    # A GPU draws seven billion weights in a second, a processor in minutes.
    with torch.device(options.device):
        model = adapter.build(f"qwen2.5-vl-{options.model_size}", settings, options.seed)
    if options.device.startswith("cuda"):
        torch.cuda.empty_cache()  # of the weights as they were drawn, in float32
    return model


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


def machine_figures(
    model: TransformersModel, frames: Sequence[FrameRef], options: argparse.Namespace
) -> dict[str, Any]:
    """Return the speed of encoding and decoding, the peak memory of a GPU at two lengths, and the
    largest context that fits if it is asked for."""
    on_gpu = options.device.startswith("cuda")
    points = []
    for some in (frames[: max(1, len(frames) // 8)], frames):
        clear_cache(model)
        if on_gpu:
            torch.cuda.reset_peak_memory_stats()
        seconds, tokens = timed(partial(_prefill, model, some))
        peak = torch.cuda.max_memory_allocated() / 2**30 if on_gpu else None
        points.append({"tokens": tokens, "rate": tokens / seconds, "peak_gib": peak})
    largest = _largest(model, frames) if options.largest else None
    return {
        "prefill": points,
        "decode": _decoding_speed(model, frames[:1]),
        "largest": largest,
    }


def report_machine(chunk_tokens: str, found: Mapping[str, Any]) -> None:
    """Print the speeds and memory of one size of chunks."""
    points = ",".join(f"{point['tokens']}:{point['rate']:.0f}" for point in found["prefill"])
    print(f"prefill          {points} (tokens:tokens/s, chunks of {chunk_tokens})")
    print(f"decode           {found['decode']:.1f} tokens/s")
    peak = found["prefill"][-1]["peak_gib"]
    if peak is not None:
        print(f"peak memory      {peak:.1f} GiB")
    if found["largest"] is not None:
        print(f"largest context  {found['largest']} tokens (found by doubling)")


def _decoding_speed(
    model: TransformersModel, frames: Sequence[FrameRef], few: int = 2, more: int = 34
) -> float:
    """Return the tokens per second of a reply on a short context, from the difference of two
    replies."""
    times, lengths = [], []
    for new in (few, more):
        answer_one_by_one(model, frames, [""], new)
        seconds, replies = timed(lambda new=new: answer_one_by_one(model, frames, [""], new))
        times.append(seconds)
        lengths.append(len(replies[0].ids))
    return (lengths[1] - lengths[0]) / (times[1] - times[0])


def _prefill(model: TransformersModel, frames: Sequence[FrameRef]) -> int:
    talk = model.conversation()
    talk.append(*frames)
    return talk.reply(Decoding(max_new_tokens=1)).n_context_tokens or 0


def _largest(model: TransformersModel, frames: Sequence[FrameRef]) -> int:
    fits = 0
    repeated = list(frames)
    while True:
        clear_cache(model)
        try:
            fits = _prefill(model, repeated)
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
        print(f"{name:14s}{found[name]:9.2f} s")
    for name in FACTORS:
        if name in found:
            print(f"{name:16s}{found[name]:7.2f}")
    print(f"replies equal    {'yes' if found['replies equal'] else 'NO'}")
    if found["parting margin"] is not None:
        print(f"they part at     {found['parting margin']:.3f} nats")


def figures(measured: dict[str, list[Timed]]) -> dict[str, float | bool | None]:
    """Return the fastest seconds of each way, the factors of those that were measured, whether all
    replies are equal, and the largest margin at which one parts from another."""
    best = {name: min(seconds for seconds, _ in runs) for name, runs in measured.items()}
    first, *others = [replies for runs in measured.values() for _, replies in runs]
    pairs = {name: name.split(" / ") for name in FACTORS}
    factors = {
        name: best[slow] / best[fast]
        for name, (slow, fast) in pairs.items()
        if slow in best and fast in best
    }
    margins = [
        margin_of_difference(answer, other)
        for replies in others
        for answer, other in zip(first, replies, strict=True)
        if answer.ids != other.ids
    ]
    known = [margin for margin in margins if margin is not None]
    return {
        **best,
        **factors,
        "replies equal": not margins,
        "parting margin": max(known) if margins and len(known) == len(margins) else None,
    }


if __name__ == "__main__":
    main()
