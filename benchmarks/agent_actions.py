"""Measure the cost of an action of a model agent, and its growth with the history.

The agent's conversation (goals, plans, actions and frames, as in training) gets a history of a
given length. Then the agent acts: it replies with some tokens, the true action and the frame after
it are appended, and so on. All ways use the same checkpoint (qwen2.5-vl-tiny, prompt=plain), the
same frames (all different) and greedy decoding:
  ours        one conversation, in which each frame and action is encoded once;
  per action  share_prefix=false: the whole history is encoded again for each action;
  per token   the whole history is encoded again for each token of an action, as in the
              published loop.

    python benchmarks/agent_actions.py [--steps 10 50 100 200] [--tokens 6]

The first table has the median seconds per action, in wall time and (in brackets) in processor time,
which other work on the machine changes less. The second table has the parts of our processor time.
"""

import argparse
import statistics
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple
from unittest import mock

import torch

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.object_ids import Words
from infthor_eval.household.sequence_text import ACT
from infthor_eval.storage.folders import packaged_folder
from infthor_eval.training.data import read_history, trajectory_names
from model_adapters import Decoding
from model_adapters.hf.cached.model import TransformersModel
from model_adapters.tiny.qwen2_5_vl import Qwen25VLTiny

Part = str | FrameRef
Tokens = tuple[int, ...]
Step = tuple[str, list[Part]]  # an action, and what is appended between it and the next
Act = Callable[[Any], Tokens]
_SHARES = {
    "frames": "their vision features, embeddings and positions",
    "model": "the language model's forward passes",
    "text": "rendering and tokenising the conversation",
    "comparing": "comparing with the encoded prefix",
}


@dataclass
class ActionTimes:
    """Times and replies of some actions."""

    wall: list[float] = field(default_factory=list)
    process: list[float] = field(default_factory=list)
    replies: list[Tokens] = field(default_factory=list)

    def add(self, other: "ActionTimes") -> None:
        """Add a repetition, which has the same replies."""
        self.wall += other.wall
        self.process += other.process
        self.replies = other.replies


class OurTimes(NamedTuple):
    """Times of our way, their parts (processor seconds per action), and the length of the first
    request."""

    times: ActionTimes
    shares: dict[str, float]
    n_tokens: int


def main() -> None:
    """Measure all ways at each length and print the tables."""
    options = _arguments()
    torch.set_num_threads(options.threads)
    opening, steps = read_bundled_steps(max(options.steps) + options.actions)
    model = Qwen25VLTiny.build(
        "qwen2.5-vl-tiny", Qwen25VLTiny.Options(prompt="plain", max_tokens=0), options.seed
    )
    acted = partial(reply, n_tokens=options.tokens)
    act_in_turn(
        start_conversation(model, opening, steps[:5]), steps[5:7], acted
    )  # imports, threads and kernels
    print(f"{options.tokens} tokens an action; seconds, in brackets processor time")
    print(
        f"{'steps':>6} {'tokens':>8}   {'ours':15} {'per action':17} {'per token':17} "
        f"{'ratios':>15}   replies equal"
    )
    counts = {"per action": options.per_action, "per token": options.per_token}
    rows = []
    for n_steps in options.steps:
        work = opening, steps[:n_steps], steps[n_steps : n_steps + options.actions], options.tokens
        rows.append((n_steps, measure_ours(model, *work, options.repeats)))
        show(*rows[-1], measure_slow_ways(model, *work, counts))
    show_shares(rows)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--steps", type=int, nargs="+", default=[10, 50, 100, 200], help="lengths of the history"
    )
    parser.add_argument("--tokens", type=int, default=6, help="tokens of each action")
    parser.add_argument("--actions", type=int, default=5, help="actions at each length")
    parser.add_argument("--repeats", type=int, default=5, help="repetitions of our way")
    parser.add_argument("--per-action", type=int, default=3, help="number of actions that way")
    parser.add_argument("--per-token", type=int, default=1, help="number of actions that way")
    parser.add_argument(
        "--threads", type=int, default=1, help="one is disturbed least by other work"
    )
    parser.add_argument("--seed", type=int, default=0)
    return parser.parse_args()


def read_bundled_steps(n_steps: int) -> tuple[list[Part], list[Step]]:
    """Return what precedes the first action, and this many steps, of the bundled trajectories in
    sequence."""
    opening: list[Part] = []
    steps: list[Step] = []
    data = NiehSet(packaged_folder("sets/nieh_mini"))
    for name in trajectory_names(data):
        for segment in read_history(data, name, Words.PUBLISHED)[1]:
            (steps[-1][1] if steps else opening).extend(segment.opening())
            steps += [(action, [frame]) for action, frame in segment.steps]
    if len(steps) < n_steps:
        raise SystemExit(
            f"the bundled trajectories have {len(steps)} steps; ask for at most that many"
        )
    return opening, steps[:n_steps]


def start_conversation(
    model: TransformersModel, opening: Sequence[Part], history: Sequence[Step]
) -> Any:
    """Return a conversation with a history, before an action."""
    talk = model.conversation()
    talk.append(*opening, ACT)
    for action, seen in history:
        talk.append(f"{action}{ACT}", *seen, ACT)
    return talk


def act_in_turn(talk: Any, steps: Sequence[Step], act: Act) -> ActionTimes:
    """Measure one action after the other; the time of each includes encoding what was appended
    since the last one."""
    times = ActionTimes()
    for action, seen in steps:
        wall, process = time.perf_counter(), time.process_time()
        times.replies.append(act(talk))
        times.wall.append(time.perf_counter() - wall)
        times.process.append(time.process_time() - process)
        talk.append(f"{action}{ACT}", *seen, ACT)
    return times


def reply(talk: Any, n_tokens: int) -> Tokens:
    """Reply with an action as the agent does."""
    ids: Tokens = talk.reply(Decoding(max_new_tokens=n_tokens, stop=(ACT,))).token_ids
    return ids


def token_by_token(model: TransformersModel, talk: Any, n_tokens: int) -> Tokens:
    """Reply with an action, encoding everything for every token."""
    pieces, ids = model.pieces(talk.turns), []
    while len(ids) < n_tokens:
        clear_cache(model)
        model._prefix.rewind_to(pieces)
        token = int(model._prefix.feed([*pieces, *ids]).argmax())
        if token in model._loaded.generation.end_ids:
            break
        ids.append(token)
    return tuple(ids)


def clear_cache(model: TransformersModel) -> None:
    """Clear the caches of a model."""
    model._prefix.reset()
    model._features.clear()


def measure_ours(
    model: TransformersModel,
    opening: Sequence[Part],
    history: Sequence[Step],
    behind: Sequence[Step],
    n_tokens: int,
    repeats: int,
) -> OurTimes:
    """Measure actions after a history that is already encoded."""
    times, shares, context = ActionTimes(), [], 0
    for _ in range(repeats):
        clear_cache(model)
        talk = start_conversation(model, opening, history[:-1])
        reply(talk, 1)  # encodes the history, which is not part of an action
        talk.append(f"{history[-1][0]}{ACT}", *history[-1][1], ACT)
        context = talk.n_tokens
        with measure_parts(model) as spent:
            times.add(act_in_turn(talk, behind, partial(reply, n_tokens=n_tokens)))
        shares.append({name: seconds / len(behind) for name, seconds in spent.items()})
    return OurTimes(
        times, {name: statistics.median(item[name] for item in shares) for name in _SHARES}, context
    )


def measure_slow_ways(
    model: TransformersModel,
    opening: Sequence[Part],
    history: Sequence[Step],
    behind: Sequence[Step],
    n_tokens: int,
    counts: Mapping[str, int],
) -> dict[str, ActionTimes]:
    """Measure the first of the same actions, with everything encoded again per action or per
    token."""
    plain = TransformersModel("plain", model._loaded, replace(model._options, share_prefix=False))
    ways: dict[str, Act] = {
        "per action": partial(reply, n_tokens=n_tokens),
        "per token": partial(token_by_token, plain, n_tokens=n_tokens),
    }
    return {
        name: act_in_turn(start_conversation(plain, opening, history), behind[: counts[name]], act)
        for name, act in ways.items()
        if counts[name]
    }


@contextmanager
def measure_parts(model: TransformersModel) -> Iterator[dict[str, float]]:
    """Measure the processor seconds of the parts of a model's replies, by `_SHARES`, within the
    context."""
    spent: dict[str, float] = defaultdict(float)
    places = {
        "frames": (model._prefix, "_embed"),
        "model": (model._prefix, "_model"),
        "text": (model._prompter, "pieces"),
        "comparing": (model._prefix, "rewind_to"),
    }
    with ExitStack() as stack:
        for name, (owner, function) in places.items():
            stack.enter_context(
                mock.patch.object(owner, function, _timing(getattr(owner, function), spent, name))
            )
        yield spent


def _timing(run: Callable[..., Any], spent: dict[str, float], name: str) -> Callable[..., Any]:
    def wrapper(*args: Any, **kwargs: Any) -> Any:
        start = time.process_time()
        try:
            return run(*args, **kwargs)
        finally:
            spent[name] += time.process_time() - start

    return wrapper


def show(n_steps: int, ours: OurTimes, slow: Mapping[str, ActionTimes]) -> None:
    """Print a line of the first table."""
    wall, process = statistics.median(ours.times.wall), statistics.median(ours.times.process)
    seconds = [
        (statistics.median(way.wall), statistics.median(way.process)) for way in slow.values()
    ]
    cells = f"{wall:6.3f} ({process:.3f}) " + "".join(f"{a:8.2f} ({b:6.2f})" for a, b in seconds)
    ratios = ", ".join(f"{a / wall:.0f}x ({b / process:.0f}x)" for a, b in seconds)
    equal = [
        (sum(map(tuple.__eq__, way.replies, ours.times.replies)), len(way.replies))
        for way in slow.values()
    ]
    equal_text = ", ".join(f"{number} of {every}" for number, every in equal)
    print(f"{n_steps:6} {ours.n_tokens:8}   {cells}   {ratios}   {equal_text}", flush=True)


def show_shares(rows: Sequence[tuple[int, OurTimes]]) -> None:
    """Print the second table, and the growth of our time."""
    print("\nours, processor milliseconds per action")
    print(
        f"{'steps':>6} "
        + "".join(f"{name:>11}" for name in (*_SHARES, "rest", "all", "all but model"))
    )
    beside = []
    for n_steps, (times, shares, _) in rows:
        every = statistics.median(times.process)
        beside.append((every, every - shares["model"]))
        values = [*shares.values(), every - sum(shares.values()), *beside[-1]]
        print(f"{n_steps:6} " + "".join(f"{1000 * value:11.1f}" for value in values))
    for name, about in _SHARES.items():
        print(f"  {name}: {about}")
    growth = [last / first for first, last in zip(beside[0], beside[-1], strict=True)]
    print(
        f"from {rows[0][0]} to {rows[-1][0]} steps: {growth[0]:.2f} times; without the model "
        f"{growth[1]:.2f} times"
    )


if __name__ == "__main__":
    main()
