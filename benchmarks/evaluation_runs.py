"""The requests of a full evaluation, and how long they take; trajectories are drawn from a seed."""

import argparse
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import takewhile

import numpy as np
from evaluation_costs import Machine, Rates, Request, Shape, gpus_for, makespan, seconds

from infthor_eval.nieh.contexts.haystack import _window

__all__ = ["Mode", "Run", "Trajectory", "draw", "modes", "requests", "run"]


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
