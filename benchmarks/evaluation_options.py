"""Options of the simulation of a full evaluation: the work, and one GPU of the machine."""

import argparse
from collections.abc import Sequence
from dataclasses import replace

from evaluation_costs import Machine, Rates, Shape, estimate_rates, rates_from_prefill

__all__ = ["machine_of", "rates_of", "read_arguments"]

# Name, default (whose type a value has), and what it is.
_WORK: tuple[tuple[str, int | float | str, str], ...] = (
    ("trajectories", 225, "published"),
    ("frames", 600.0, "mean frames of a trajectory; assumed"),
    ("frames-spread", 350.0, "standard deviation of the frames; assumed"),
    ("frames-least", 300, "minimum frames; published: steps of a generated trajectory"),
    ("frames-most", 2287, "maximum frames; published: the longest trajectory"),
    ("questions", 24.0, "mean questions of a trajectory; as in our sets, 475/20"),
    ("one-clue", 0.635, "share of questions; from the published totals"),
    ("two-clues", 0.165, "share of questions; from the published totals"),
    ("puts", 0.5, "share of two-clue questions with successive clues; assumed"),
    ("most-clues", 6, "maximum clues of a question; assumed"),
    ("text-tokens", 60, "tokens of a question with its instruction; assumed"),
    ("reply-tokens", 6, "mean tokens of a reply, at most 50; assumed"),
    ("step-tokens", 20, "tokens of a plan's step beside its frame; assumed"),
    ("step-seconds", 0.024, "seconds of a step in the simulator; measured, benchmarks/plans.md"),
    ("haystack", "8,32,128,512,1000", "sizes in kilo-tokens, as in tasks/nieh/contexts"),
    ("max-context", 1_010_000, "longer contexts are refused; with extended RoPE"),
    ("seed", 0, "seed of the sampling"),
)
_MACHINE: tuple[tuple[str, int | float, str], ...] = (
    ("tflops", 400.0, "in products; assumed, 40%% of an H100's 989"),
    ("attention-tflops", 200.0, "in attention; assumed"),
    ("bandwidth", 2.0, "TB/s reached; assumed, 60%% of an H100's 3.35"),
    ("step-overhead", 0.02, "seconds a token; assumed, eager transformers"),
    ("memory-gb", 80.0, "of a GPU: an H100's"),
    ("usable", 0.9, "share of it; assumed"),
    ("gpus-per-node", 8, "most of one worker"),
    ("chunk-tokens", 4096, "the option of that name"),
    ("tensor-efficiency", 0.8, "of tensor parallelism; assumed"),
    ("load-seconds", 120.0, "until a worker has its model; assumed"),
    ("price", 3.0, "USD a GPU-hour; assumed"),
)


def read_arguments(title: str, given: Sequence[str] | None = None) -> argparse.Namespace:
    """Return the options of a command line; `title` is the first line of its help."""
    parser = argparse.ArgumentParser(
        description=title, formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    work = parser.add_argument_group("the work")
    machine = parser.add_argument_group("the machine, one GPU of it")
    for group, options in ((work, _WORK), (machine, _MACHINE)):
        for name, default, text in options:
            group.add_argument(f"--{name}", type=type(default), default=default, help=text)
    machine.add_argument(
        "--frame-seconds", type=float, help="CPU's work on a frame; else each model's own, measured"
    )
    machine.add_argument(
        "--attention", choices=("sdpa", "flash_attention_2"), default="sdpa", help="for memory"
    )
    machine.add_argument(
        "--parallel", choices=("layers", "tensor"), default="layers", help="layers is device_map"
    )
    machine.add_argument(
        "--prefill", action="append", default=[], metavar="MODEL=N:RATE,N:RATE", help="measured"
    )
    machine.add_argument(
        "--decode", action="append", default=[], metavar="MODEL=RATE", help="measured, tokens/s"
    )
    return parser.parse_args(given)


def machine_of(options: argparse.Namespace) -> Machine:
    """Return the machine of the options."""
    return Machine(
        tflops=options.tflops,
        attention_tflops=options.attention_tflops,
        bandwidth=options.bandwidth * 1e12,
        step_overhead=options.step_overhead,
        memory=options.memory_gb * 1e9,
        usable=options.usable,
        gpus_per_node=options.gpus_per_node,
        attention=options.attention,
        chunk_tokens=options.chunk_tokens,
        parallel=options.parallel,
        tensor_efficiency=options.tensor_efficiency,
        load_seconds=options.load_seconds,
    )


def rates_of(shape: Shape, machine: Machine, options: argparse.Namespace) -> Rates:
    """Return a model's rates, measured ones if they are given, else estimated."""
    if options.frame_seconds is not None:
        shape = replace(shape, frame_seconds=options.frame_seconds)
    rates = estimate_rates(shape, machine)
    for name, _, text in (given.partition("=") for given in options.prefill):
        if name == shape.name:
            short, long = (point.split(":") for point in text.split(","))
            rates = rates_from_prefill(
                rates, (int(short[0]), float(short[1])), (int(long[0]), float(long[1]))
            )
    for name, _, text in (given.partition("=") for given in options.decode):
        if name == shape.name:
            rates = replace(rates, step=1 / float(text))
    return rates
