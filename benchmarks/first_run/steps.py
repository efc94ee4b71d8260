"""The steps of a first run, the cheapest first."""

from collections.abc import Callable
from dataclasses import dataclass

from .evaluations import (
    ask_on_clues,
    ask_on_trajectories,
    compare_with_cpu,
    count_questions,
    estimate_costs,
    run_tiny_models,
    spread_model,
    use_workers,
)
from .machine import CHECKPOINT, Machine
from .outcome import Outcome
from .policies import compare_policies
from .speeds import (
    measure_batches,
    measure_chunks,
    measure_speed,
    offload,
    run_out_of_memory,
)
from .work import Work

__all__ = ["STEPS", "Step"]


def _nothing(machine: Machine) -> str | None:  # noqa: ARG001 - the form of all needs
    return None


def _weights(machine: Machine) -> str | None:
    if machine.tiny or machine.checkpoint:
        return None
    return f"no weights of {CHECKPOINT} here; give --checkpoint FOLDER, or --download"


def _weights_and_data(machine: Machine) -> str | None:
    if machine.tiny or machine.data or not machine.checkpoint:
        return _weights(machine)
    return "the published set is not here; give --data FOLDER, or --download"


def _several_devices(machine: Machine) -> str | None:
    if machine.device == "cpu" or machine.gpus > 1:
        return None
    return f"needs 2 GPUs, and there is {machine.gpus}"


def _old_libraries(machine: Machine) -> str | None:
    if machine.old_libraries:
        return None
    return "needs the libraries of the policies' publication; give --old-libraries FOLDER"


@dataclass(frozen=True)
class Step:
    """A step.

    Attributes:
        name: in a word or two, unique.
        purpose: the question that it answers.
        expected: what is expected of an H100 of 80 GB, by the formulae of benchmarks/cost.md.
        seconds: what it takes there, loading included.
        missing: says what a machine lacks for it, or None.
        run: does it.
    """

    name: str
    purpose: str
    expected: str
    seconds: int
    missing: Callable[[Machine], str | None]
    run: Callable[[Work], Outcome]


STEPS = (
    Step(
        "tiny models",
        "Does it run at all?",
        f"4 models, {count_questions()} questions each, 0 failed, exit code 0",
        160,
        _nothing,
        run_tiny_models,
    ),
    Step(
        "as on a CPU",
        "Are the results those of a processor? If many replies differ, and with "
        "`attn_implementation=eager` they do not, it is the kernel.",
        "replies equal, or they part at a near tie, as two tokens of random weights often are",
        120,
        _nothing,
        compare_with_cpu,
    ),
    Step(
        "speed",
        "Are the estimates right, and which kernel is the default? `flash_attention_2` if replies "
        "are equal and it is 1.2 times as fast at 128K.",
        "with SDPA 7,400 tokens/s at 16K, 4,000 at 128K, 35 decoded, peak 26 GB (24 with flash), "
        "660,000 tokens fit; replies equal but for near ties",
        560,
        _nothing,
        measure_speed,
    ),
    Step(
        "chunks",
        "The default of `chunk_tokens`: the smallest within 5 % of the best.",
        "4096 is within 5 % of the best",
        300,
        _nothing,
        measure_chunks,
    ),
    Step(
        "batches",
        "The default of `batch_size` on a GPU.",
        "together faster than alone; replies equal, or they part at a near tie",
        240,
        _nothing,
        measure_batches,
    ),
    Step(
        "the real model",
        "Do published weights give the published accuracy, in each precision?",
        "near Table 4 (82.2 %) three times, 0 failed",
        540,
        _weights_and_data,
        ask_on_clues,
    ),
    Step(
        "whole trajectories",
        "Is a trajectory encoded once?",
        "under a second a question, 95 % of the tokens of later ones cached, 0 failed",
        240,
        _weights,
        ask_on_trajectories,
    ),
    Step(
        "out of memory",
        "Does a context that does not fit cost itself alone?",
        "one line, `out of memory on a context of N tokens`; the next request is answered; no "
        "memory is kept",
        150,
        _nothing,
        run_out_of_memory,
    ),
    Step(
        "offload",
        "Is that context answered with `kv_offload=true`, and how fast? If far slower than the "
        "speed above, buffers should be pinned.",
        "answered",
        10,
        _nothing,
        offload,
    ),
    Step(
        "one model on several GPUs",
        "Do layers on several GPUs give the same replies, and what do they cost?",
        "replies equal; as fast as one GPU, as one computes at a time",
        240,
        _several_devices,
        spread_model,
    ),
    Step(
        "workers",
        "Do two processes give the same results, in half the time where each has a GPU?",
        "all replies equal; half the time with 2 GPUs",
        200,
        _nothing,
        use_workers,
    ),
    Step(
        "policies",
        "Are the actions of both policies those of their publication's libraries?",
        "both equal",
        120,
        _old_libraries,
        compare_policies,
    ),
    Step(
        "cost",
        "Is the whole evaluation to be run here?",
        "7 h on 8 GPUs for this model (benchmarks/cost.md)",
        420,
        _weights_and_data,
        estimate_costs,
    ),
)
