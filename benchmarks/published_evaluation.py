"""Simulate a full published evaluation on 1, 8 and 64 GPUs: requests, hours, cost, and savings by
sharing.

225 trajectories with questions are sampled from the seed. Four models answer them in every mode, as
the harness does: a group is a trajectory, its contexts are sorted by their common prefixes, and a
request encodes only what the one before did not. Workers take the longest groups first; a worker
has as many GPUs as its longest context requires.

    python benchmarks/published_evaluation.py python benchmarks/published_evaluation.py --prefill
    qwen2.5-vl=8000:9000,128000:5000 --decode qwen2.5-vl=35

The second command uses measurements on a GPU (benchmarks/gpu.md): tokens/s of encoding at two
lengths, and tokens/s of decoding at a short one. Rates without measurements are estimated from the
machine's numbers. docs/cost.md has the formulae.
"""

import argparse
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile

import numpy as np
from evaluation_costs import (
    MODELS,
    Machine,
    Rates,
    Request,
    Shape,
    estimate_rates,
    gpus_for,
    largest_context,
    makespan,
    rates_from_prefill,
    seconds,
)

from infthor_eval.nieh.contexts.haystack import _window

GPUS = (1, 8, 64)


@dataclass(frozen=True)
class Trajectory:
    """The parts of a trajectory that determine costs.

    Attributes:
        n_frames: number of frames and steps.
        questions: positions of the clues of each question.
    """

    n_frames: int
    questions: tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Mode:
    """A mode of evaluation.

    Attributes:
        name: name of the task.
        contexts: returns the contexts of a trajectory, as positions of frames, and the number of
            impossible ones; None for plans.
        step_seconds: seconds in the simulator per reply.
    """

    name: str
    contexts: Callable[[Trajectory, Shape], tuple[list[tuple[int, ...]], int]] | None
    step_seconds: float = 0.0


@dataclass(frozen=True)
class Run:
    """One model in one mode.

    Attributes:
        mode: name of the mode.
        model: shape of the model.
        n_requests: number of answered requests.
        n_skipped: numbers of requests without a context, with a too long one, and with one that
            exceeds the memory.
        tokens: tokens of all contexts.
        encoded: tokens that were not in the cache.
        largest: tokens of the longest context.
        n_gpus: GPUs of one worker; 0 without requests.
        jobs: seconds of each group, with and without sharing.
    """

    mode: str
    model: Shape
    n_requests: int
    n_skipped: tuple[int, int, int]
    tokens: int
    encoded: int
    largest: int
    n_gpus: int
    jobs: tuple[tuple[float, ...], tuple[float, ...]]

    def hours(self, n_gpus: int, load: float, reuse: bool = True) -> float | None:
        """Return the hours on a number of GPUs, or None if they are too few for one worker."""
        if not self.n_gpus:
            return 0.0
        if n_gpus < self.n_gpus:
            return None
        return (load + makespan(self.jobs[0 if reuse else 1], n_gpus // self.n_gpus)) / 3600


def main() -> None:
    """Print the set, a line per run, and sums."""
    options = _arguments()
    machine = machine_of(options)
    trajectories = draw(options)
    n_frames = sum(trajectory.n_frames for trajectory in trajectories)
    n_questions = sum(len(trajectory.questions) for trajectory in trajectories)
    print(
        f"{len(trajectories)} trajectories, {n_frames} frames, {n_questions} questions, seed "
        f"{options.seed}"
    )
    print(
        f"attention {machine.attention}, {machine.parallel} over a worker's GPUs, "
        f"{options.price:.2f} USD a GPU-hour"
    )
    runs = [
        run(mode, shape, trajectories, rates_of(shape, machine, options), machine, options)
        for mode in modes(options)
        for shape in MODELS
    ]
    print(f"{work_table(runs)}\n\n{cost_table(runs, machine.load_seconds, options.price)}")
    print("\nlargest context by memory, in 1,000 tokens, on 1, 2, 4, 8 GPUs")
    for shape in MODELS:
        fitting = [f"{largest_context(shape, machine, n) / 1000:8,.0f}" for n in (1, 2, 4, 8)]
        print(
            f"{shape.name:17s}{''.join(fitting)}{shape.kv_bytes / 1e9 * 1e6:10.0f} GB of keys and "
            "values a million"
        )


def _arguments(given: Sequence[str] | None = None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0], formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    work = parser.add_argument_group("the work")
    work.add_argument("--trajectories", type=int, default=225, help="published")
    work.add_argument(
        "--frames", type=float, default=600, help="mean frames of a trajectory; assumed"
    )
    work.add_argument(
        "--frames-spread", type=float, default=350, help="standard deviation of the frames; assumed"
    )
    work.add_argument(
        "--frames-least",
        type=int,
        default=300,
        help="minimum frames; published: steps of a generated trajectory",
    )
    work.add_argument(
        "--frames-most",
        type=int,
        default=2287,
        help="maximum frames; published: the longest trajectory",
    )
    work.add_argument(
        "--questions",
        type=float,
        default=24,
        help="mean questions of a trajectory; as in our sets, 475/20",
    )
    work.add_argument(
        "--one-clue",
        type=float,
        default=0.635,
        help="share of questions; from the published totals",
    )
    work.add_argument(
        "--two-clues",
        type=float,
        default=0.165,
        help="share of questions; from the published totals",
    )
    work.add_argument(
        "--puts",
        type=float,
        default=0.5,
        help="share of two-clue questions with successive clues; assumed",
    )
    work.add_argument(
        "--most-clues", type=int, default=6, help="maximum clues of a question; assumed"
    )
    work.add_argument(
        "--text-tokens",
        type=int,
        default=60,
        help="tokens of a question with its instruction; assumed",
    )
    work.add_argument(
        "--reply-tokens", type=int, default=6, help="mean tokens of a reply, at most 50; assumed"
    )
    work.add_argument(
        "--step-tokens",
        type=int,
        default=20,
        help="tokens of a plan's step beside its frame; assumed",
    )
    work.add_argument(
        "--step-seconds",
        type=float,
        default=0.024,
        help="seconds of a step in the simulator; measured, benchmarks/plans.md",
    )
    work.add_argument(
        "--haystack",
        default="8,32,128,512,1000",
        help="sizes in kilo-tokens, as in tasks/nieh/contexts",
    )
    work.add_argument(
        "--max-context",
        type=int,
        default=1_010_000,
        help="longer contexts are refused; with extended RoPE",
    )
    work.add_argument("--seed", type=int, default=0, help="seed of the sampling")
    _machine_arguments(parser.add_argument_group("the machine, one GPU of it"))
    return parser.parse_args(given)


def _machine_arguments(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--tflops", type=float, default=400, help="in products; assumed, 40%% of an H100's 989"
    )
    group.add_argument("--attention-tflops", type=float, default=200, help="in attention; assumed")
    group.add_argument(
        "--bandwidth", type=float, default=2.0, help="TB/s reached; assumed, 60%% of an H100's 3.35"
    )
    group.add_argument(
        "--step-overhead",
        type=float,
        default=0.02,
        help="seconds a token; assumed, eager transformers",
    )
    group.add_argument(
        "--frame-seconds", type=float, help="CPU's work on a frame; else each model's own, measured"
    )
    group.add_argument("--memory-gb", type=float, default=80, help="of a GPU: an H100's")
    group.add_argument("--usable", type=float, default=0.9, help="share of it; assumed")
    group.add_argument("--gpus-per-node", type=int, default=8, help="most of one worker")
    group.add_argument(
        "--attention", choices=("sdpa", "flash_attention_2"), default="sdpa", help="for memory"
    )
    group.add_argument("--chunk-tokens", type=int, default=4096, help="the option of that name")
    group.add_argument(
        "--parallel", choices=("layers", "tensor"), default="layers", help="layers is device_map"
    )
    group.add_argument(
        "--tensor-efficiency", type=float, default=0.8, help="of tensor parallelism; assumed"
    )
    group.add_argument(
        "--load-seconds", type=float, default=120, help="until a worker has its model; assumed"
    )
    group.add_argument("--price", type=float, default=3.0, help="USD a GPU-hour; assumed")
    group.add_argument(
        "--prefill", action="append", default=[], metavar="MODEL=N:RATE,N:RATE", help="measured"
    )
    group.add_argument(
        "--decode", action="append", default=[], metavar="MODEL=RATE", help="measured, tokens/s"
    )


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


def draw(options: argparse.Namespace) -> list[Trajectory]:
    """Sample trajectories of different lengths (log-normal, clipped), with the clues of their
    questions."""
    rng = np.random.default_rng(options.seed)
    spread = np.log1p((options.frames_spread / options.frames) ** 2)
    lengths = rng.lognormal(
        np.log(options.frames) - spread / 2, np.sqrt(spread), options.trajectories
    )
    trajectories = []
    for n_frames in lengths.clip(options.frames_least, options.frames_most).astype(int).tolist():
        n_questions = max(1, int(rng.poisson(options.questions)))
        trajectories.append(
            Trajectory(n_frames, tuple(_clues(n_frames, rng, options) for _ in range(n_questions)))
        )
    return trajectories


def _clues(n_frames: int, rng: np.random.Generator, options: argparse.Namespace) -> tuple[int, ...]:
    kind = rng.random()
    if kind < options.one_clue:
        return (int(rng.integers(n_frames)),)
    if kind < options.one_clue + options.two_clues:
        if rng.random() < options.puts:
            first = int(rng.integers(n_frames - 1))
            return (first, first + 1)
        n_clues = 2
    else:
        n_clues = int(rng.integers(3, options.most_clues + 1))
    return tuple(sorted(rng.choice(n_frames, n_clues, replace=False).tolist()))


def modes(options: argparse.Namespace) -> list[Mode]:
    """Return all modes."""
    sizes = [int(size) for size in options.haystack.split(",")]
    return [
        Mode("nieh_gt", lambda trajectory, _: (list(trajectory.questions), 0)),
        Mode(
            "nieh_full",
            lambda trajectory, _: (
                [tuple(range(trajectory.n_frames))] * len(trajectory.questions),
                0,
            ),
        ),
        *[Mode(f"nieh_haystack {size}k", _haystack_of(size, options.seed)) for size in sizes],
        Mode("infthor_plans", None, options.step_seconds),
    ]


def _haystack_of(
    size: int, seed: int
) -> Callable[[Trajectory, Shape], tuple[list[tuple[int, ...]], int]]:
    def contexts(trajectory: Trajectory, shape: Shape) -> tuple[list[tuple[int, ...]], int]:
        rng = random.Random(seed)
        n = size * 1000 // shape.frame_tokens
        windows = [
            _window(clues, trajectory.n_frames, n, depth, rng)
            for clues in trajectory.questions
            for depth in range(5)
        ]
        possible = [window for window in windows if not isinstance(window, str)]
        return possible, len(windows) - len(possible)

    return contexts


def requests(
    trajectory: Trajectory, mode: Mode, shape: Shape, options: argparse.Namespace
) -> tuple[list[Request], int]:
    """Return the requests of a group, and the number of impossible contexts."""
    if mode.contexts is None:
        return list(_plan_requests(trajectory, shape, options)), 0
    contexts, n_missing = mode.contexts(trajectory, shape)
    result, before = [], ()
    for frames in sorted(contexts):
        n_shared = len(frames) if frames == before else _n_common(frames, before)
        tokens = len(frames) * shape.frame_tokens + options.text_tokens
        result.append(Request(tokens, n_shared * shape.frame_tokens, options.reply_tokens))
        before = frames
    return result, n_missing


def _n_common(one: Sequence[int], other: Sequence[int]) -> int:
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(one, other, strict=False)))


def _plan_requests(
    trajectory: Trajectory, shape: Shape, options: argparse.Namespace
) -> Iterator[Request]:
    """Yield the requests of an agent: for each step the whole history, which grows by a frame and
    an action."""
    step = shape.frame_tokens + options.step_tokens
    for number in range(1, trajectory.n_frames + 1):
        yield Request(number * step, (number - 1) * step, options.reply_tokens)


def run(
    mode: Mode,
    shape: Shape,
    trajectories: Sequence[Trajectory],
    rates: Rates,
    machine: Machine,
    options: argparse.Namespace,
) -> Run:
    """Simulate one model in one mode."""
    n_absent = n_long = n_large = 0
    groups: list[list[Request]] = []
    for trajectory in trajectories:
        group, n_missing = requests(trajectory, mode, shape, options)
        short = [request for request in group if request.context <= options.max_context]
        fitting = [
            request for request in short if gpus_for(shape, machine, request.context) is not None
        ]
        n_absent, n_long = n_absent + n_missing, n_long + len(group) - len(short)
        n_large += len(short) - len(fitting)
        if fitting:
            groups.append(fitting)
    answered = [request for group in groups for request in group]
    largest = max((request.context for request in answered), default=0)
    n_gpus = (gpus_for(shape, machine, largest) or 0) if answered else 0
    jobs = [
        tuple(
            sum(
                seconds(request, rates, reuse) / machine.speed(n_gpus) + mode.step_seconds
                for request in group
            )
            for group in groups
        )
        for reuse in (True, False)
    ]
    return Run(
        mode.name,
        shape,
        len(answered),
        (n_absent, n_long, n_large),
        sum(request.context for request in answered),
        sum(request.context - request.cached for request in answered),
        largest,
        n_gpus,
        (jobs[0], jobs[1]),
    )


_NAMES = f"{'mode':20s}{'model':17s}"
_WORK = (
    f"{_NAMES}{'requests':>9s}{'no window':>10s}{'too long':>9s}{'no memory':>10s}"
    f"{'Mtokens':>9s}{'encoded':>9s}{'longest':>9s}{'RoPE':>6s}"
)
_COST = (
    f"{_NAMES}{'GPUs':>5s}{'h on 1':>9s}{'on 8':>9s}{'on 64':>8s}{'USD 8':>9s}{'USD 64':>9s}"
    f"{'h on 8, not shared':>20s}{'saved':>8s}"
)


def work_table(runs: Sequence[Run]) -> str:
    """Return a line for each run: its requests and their tokens."""
    lines = [_WORK]
    for one in runs:
        extension = one.largest / one.model.limit
        lines.append(
            f"{one.mode:20s}{one.model.name:17s}{one.n_requests:9d}"
            f"{one.n_skipped[0]:10d}{one.n_skipped[1]:9d}{one.n_skipped[2]:10d}"
            f"{one.tokens / 1e6:9.0f}{one.encoded / 1e6:9.0f}{one.largest:9d}"
            f"{f'x{extension:.1f}' if extension > 1 else '-':>6s}"
        )
    return "\n".join(lines)


def cost_table(runs: Sequence[Run], load: float, price: float) -> str:
    """Return a line for each run, one for the sum of each model, and one for the sum of all: hours
    and cost."""
    lines = [_COST]
    for one in runs:
        lines.append(
            f"{one.mode:20s}{one.model.name:17s}{one.n_gpus or '-':>5}" + _times([one], load, price)
        )
    for name in dict.fromkeys(one.model.name for one in runs):
        of_model = [one for one in runs if one.model.name == name]
        lines.append(f"{'all':20s}{name:17s}{'':5s}" + _times(of_model, load, price))
    lines.append(f"{'all':20s}{'all':17s}{'':5s}" + _times(runs, load, price))
    return "\n".join(lines)


def _times(runs: Sequence[Run], load: float, price: float) -> str:
    """Return hours, cost and saving of successive runs, with a dash if one of them needs more
    GPUs."""
    hours = {n: _sum([one.hours(n, load) for one in runs]) for n in GPUS}
    without = _sum([one.hours(8, load, reuse=False) for one in runs])
    shown = f"{_number(hours[1], 9)}{_number(hours[8], 9)}{_number(hours[64], 8)}"
    shown += "".join(
        _number(None if (time := hours[n]) is None else price * n * time, 9, 0) for n in (8, 64)
    )
    saved = None if without is None or not hours[8] else without / hours[8]
    return shown + _number(without, 20) + _number(saved, 8)


def _sum(hours: Sequence[float | None]) -> float | None:
    known = [time for time in hours if time is not None]
    return sum(known) if len(known) == len(hours) else None


def _number(value: float | None, width: int, digits: int = 1) -> str:
    return "-".rjust(width) if value is None else f"{value:{width},.{digits}f}"


if __name__ == "__main__":
    main()
