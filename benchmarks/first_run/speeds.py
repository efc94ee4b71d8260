"""Steps that need no weights and no data: speed and memory of a model with random weights."""

import json
from typing import Any

from .machine import Machine
from .outcome import Outcome
from .work import Work

__all__ = ["measure_batches", "measure_chunks", "measure_speed", "offload", "run_out_of_memory"]

_CHUNKS = (512, 1024, 2048, 4096, 8192)
_BATCHES = (4, 8)
_ENOUGH = 0.95  # of the best rate
_KEPT_MIB = 64  # memory that may stay with torch's allocator and kernels after a lack of it
_NEAR_TIE = 0.1  # nats, less than explain's: at the scores of random weights bfloat16 steps by 0.03
_GIB = 21.0  # the 7B model's weights take 16 of them
_TOO_MANY = 1040  # frames, for the rest: 128K tokens take 7


def measure_speed(work: Work) -> Outcome:
    """Encode, decode and answer on one long trajectory with each attention kernel."""
    found = {
        name: _prefix_sharing(work, *words, "--machine", "--ways", "shared,batched,plain")
        for name, words in _kernels(work.machine).items()
    }
    texts = [
        f"{kernel}: {_speed(figures, work.machine.memory_gib)}" for kernel, figures in found.items()
    ]
    rates = {kernel: _points(figures)[-1]["rate"] for kernel, figures in found.items()}
    if "flash_attention_2" in rates:
        texts.append(f"flash is {rates['flash_attention_2'] / rates['sdpa']:.2f} times as fast")
    elif work.machine.device != "cpu":
        texts.append("flash_attention_2 not run: flash-attn is not installed")
    return Outcome(
        "; ".join(texts),
        all(map(_equal, found.values())),
        {kernel: _machine(figures) for kernel, figures in found.items()},
    )


def _kernels(machine: Machine) -> dict[str, tuple[str, ...]]:
    """Return the words that choose each kernel of attention, by its name in the page."""
    kernels = {kernel: ("--attention", kernel) for kernel in machine.kernels}
    if machine.device != "cpu":
        # cuDNN makes a plan for every new length, and a context has a new one with every token.
        kernels["sdpa without cuDNN"] = ("--attention", "sdpa", "--without-cudnn")
    return kernels


def _prefix_sharing(work: Work, *words: str) -> dict[str, Any]:
    """Return what `prefix_sharing.py` prints of a long trajectory and three questions."""
    shape = "tiny" if work.machine.tiny else "7b"
    done = work.benchmark(
        "prefix_sharing.py",
        *("--device", work.machine.device, "--model-size", shape),
        *("--frames", str(work.machine.frames)),
        *("--questions", "3", "--repeats", "1", "--margins", "--json", *words),
    )
    return json.loads(done.output)


def _machine(figures: dict[str, Any]) -> dict[str, Any]:
    (found,) = figures["machine"].values()
    return found


def _points(figures: dict[str, Any]) -> list[dict[str, Any]]:
    return _machine(figures)["prefill"]


def _speed(figures: dict[str, Any], memory_gib: float) -> str:
    short, long = _points(figures)
    texts = [
        f"{short['rate']:,.0f} tokens/s at {short['tokens']:,} tokens and {long['rate']:,.0f} at "
        f"{long['tokens']:,}",
        f"{_machine(figures)['decode']:.1f} decoded tokens/s",
        f"plain / shared {figures['plain / shared']:.1f}",
        _equality(figures),
    ]
    if long["peak_gib"] is not None:
        per_token = (long["peak_gib"] - short["peak_gib"]) / (long["tokens"] - short["tokens"])
        fits = long["tokens"] + (0.95 * memory_gib - long["peak_gib"]) / per_token
        texts.append(f"peak {long['peak_gib']:.1f} GiB, so about {fits:,.0f} tokens fit")
    return ", ".join(texts)


def _equal(figures: dict[str, Any]) -> bool:
    """Return whether all replies are equal, or part where two tokens are as likely."""
    margin = figures["parting margin"]
    return figures["replies equal"] or (margin is not None and margin <= _NEAR_TIE)


def _equality(figures: dict[str, Any]) -> str:
    if figures["replies equal"]:
        return "replies equal"
    margin = figures["parting margin"]
    by = "an unknown margin" if margin is None else f"{margin:.3f} nats"
    return f"replies {'part at a near tie' if _equal(figures) else 'DIFFER'}, by {by}"


def measure_chunks(work: Work) -> Outcome:
    """Encode a long trajectory in chunks of several sizes."""
    sizes = ",".join(map(str, _CHUNKS))
    found = _prefix_sharing(work, "--machine", "--ways", "shared", "--chunk-tokens", sizes)
    rates = {size: figures["prefill"][-1]["rate"] for size, figures in found["machine"].items()}
    best = max(rates.values())
    smallest = next(size for size, rate in rates.items() if rate >= _ENOUGH * best)
    listed = ", ".join(f"{size}: {rate:,.0f}" for size, rate in rates.items())
    return Outcome(
        f"tokens/s by chunk_tokens: {listed}; smallest within 5 % of the best: {smallest}"
    )


def measure_batches(work: Work) -> Outcome:
    """Answer questions on one long trajectory alone and together."""
    sizes = ",".join(map(str, _BATCHES))
    found = _prefix_sharing(
        work, "--ways", "shared,batched", "--batch-size", sizes, "--questions", "8"
    )
    listed = ", ".join(f"by {n}: {found[f'batched by {n}']:.2f} s" for n in _BATCHES)
    return Outcome(
        f"8 questions alone: {found['shared']:.2f} s; {listed}; {_equality(found)}", _equal(found)
    )


def _memory_limit(work: Work) -> dict[str, Any]:
    if work.machine.tiny:
        words = ("--pretend-at", "2000")
    else:
        words = ("--model-size", "7b", "--frames", str(_TOO_MANY), "--gib", str(_GIB))
    done = work.benchmark("memory_limit.py", "--device", work.machine.device, *words)
    return json.loads(done.output)


def run_out_of_memory(work: Work) -> Outcome:
    """Ask on a context that does not fit, then on one that does."""
    found = _memory_limit(work)
    failure = found["failure"] or "no failure: all frames fit"
    right = "out of memory on a context of" in failure and found["next answered"]
    return Outcome(
        f"{failure}; the next request is {'' if found['next answered'] else 'NOT '}answered; "
        f"{found['kept MiB']:.0f} MiB kept",
        right and found["kept MiB"] <= _KEPT_MIB,
        found,
    )


def offload(work: Work) -> Outcome:
    """Ask on the context that did not fit, with its keys and values in the machine's memory."""
    found = work.earlier.get("out of memory") or _memory_limit(work)
    if found["offload failure"] is not None:
        return Outcome(found["offload failure"], False)
    return Outcome(
        f"a context of {found['offload tokens']:,} tokens is answered with kv_offload=true, at "
        f"{found['offload rate']:,.0f} tokens/s",
        True,
    )
