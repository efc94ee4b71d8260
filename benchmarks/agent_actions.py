"""What an action costs a model agent, and how that grows with the history.

The agent's conversation (goals, plans, actions and frames, as models are trained on them) is brought to a history of so
many steps; then it acts: a reply of some tokens, the true action and the frame after it appended, and so on. On the
same checkpoint (qwen2.5-vl-tiny, prompt=plain), the same frames, all different, and greedily:
  ours        one conversation: each frame and action is encoded once;
  per action  the same with share_prefix=false: the whole history is encoded again for each action;
  per token   the whole history is encoded again for each token of an action, as the published loop does.

    python benchmarks/agent_actions.py [--steps 10 50 100 200] [--tokens 6]

The first table has seconds per action, medians, of wall time and (in brackets) of the process's own, which a busy
machine lengthens less. The second tells where ours goes, in time of the process.
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
from infthor_eval.formats.packaged import packaged_folder
from infthor_eval.household.sequence_text import ACT
from infthor_eval.training.data import read_history, trajectory_names
from model_adapters import Decoding
from model_adapters.hf.model import TransformersModel
from model_adapters.tiny.qwen2_5_vl import Qwen25VLTiny

Part = str | FrameRef
Tokens = tuple[int, ...]
Step = tuple[str, list[Part]]  # an action, and what an agent sees between it and the next
Act = Callable[[Any], Tokens]
_SHARES = {
    "frames": "their vision features, embeddings and positions",
    "model": "the language model's forward passes",
    "text": "writing the conversation and tokenising it",
    "comparing": "with what is encoded already",
}


@dataclass
class Taken:
    """What some actions took, each, and what was replied."""

    wall: list[float] = field(default_factory=list)
    process: list[float] = field(default_factory=list)
    replies: list[Tokens] = field(default_factory=list)

    def add(self, other: "Taken") -> None:
        """Take a repetition; its replies are the same."""
        self.wall += other.wall
        self.process += other.process
        self.replies = other.replies


class Ours(NamedTuple):
    """What ours took, where its time went (seconds of the process, an action), and how long its first request was."""

    taken: Taken
    shares: dict[str, float]
    n_tokens: int


def main() -> None:
    """Act all ways at each length and print the tables."""
    options = _arguments()
    torch.set_num_threads(options.threads)
    opening, steps = told(max(options.steps) + options.actions)
    model = Qwen25VLTiny.build("qwen2.5-vl-tiny", Qwen25VLTiny.Options(prompt="plain", max_tokens=0), options.seed)
    acted = partial(reply, n_tokens=options.tokens)
    acting(begun(model, opening, steps[:5]), steps[5:7], acted)  # imports, threads and kernels
    print(f"{options.tokens} tokens an action; seconds, in brackets of the process")
    print(f"{'steps':>6} {'tokens':>8}   {'ours':15} {'per action':17} {'per token':17} {'ratios':>15}   replies equal")
    counts = {"per action": options.per_action, "per token": options.per_token}
    rows = []
    for n_steps in options.steps:
        work = opening, steps[:n_steps], steps[n_steps : n_steps + options.actions], options.tokens
        rows.append((n_steps, ours(model, *work, options.repeats)))
        show(*rows[-1], slow_ways(model, *work, counts))
    show_shares(rows)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, nargs="+", default=[10, 50, 100, 200], help="lengths of the history")
    parser.add_argument("--tokens", type=int, default=6, help="of each action")
    parser.add_argument("--actions", type=int, default=5, help="in a row at each length")
    parser.add_argument("--repeats", type=int, default=5, help="of ours")
    parser.add_argument("--per-action", type=int, default=3, help="how many of the actions that way")
    parser.add_argument("--per-token", type=int, default=1, help="how many of the actions that way")
    parser.add_argument("--threads", type=int, default=1, help="one is least disturbed by other work")
    parser.add_argument("--seed", type=int, default=0)
    return parser.parse_args()


def told(n_steps: int) -> tuple[list[Part], list[Step]]:
    """What stands before the first action, and so many steps, out of the bundled trajectories one after the other."""
    opening: list[Part] = []
    steps: list[Step] = []
    data = NiehSet(packaged_folder("sets/nieh_mini"))
    for name in trajectory_names(data):
        for segment in read_history(data, name)[1]:
            (steps[-1][1] if steps else opening).extend(segment.opening())
            steps += [(action, [frame]) for action, frame in segment.steps]
    if len(steps) < n_steps:
        raise SystemExit(f"the bundled trajectories have {len(steps)} steps; ask for at most that many")
    return opening, steps[:n_steps]


def begun(model: TransformersModel, opening: Sequence[Part], history: Sequence[Step]) -> Any:
    """A conversation with a history, before an action."""
    talk = model.conversation()
    talk.append(*opening, ACT)
    for action, seen in history:
        talk.append(f"{action}{ACT}", *seen, ACT)
    return talk


def acting(talk: Any, steps: Sequence[Step], act: Act) -> Taken:
    """An action after the other, the true ones appended; each takes what is appended behind the one before."""
    taken = Taken()
    for action, seen in steps:
        wall, process = time.perf_counter(), time.process_time()
        taken.replies.append(act(talk))
        taken.wall.append(time.perf_counter() - wall)
        taken.process.append(time.process_time() - process)
        talk.append(f"{action}{ACT}", *seen, ACT)
    return taken


def reply(talk: Any, n_tokens: int) -> Tokens:
    """An action as the agent asks for it."""
    ids: Tokens = talk.reply(Decoding(max_new_tokens=n_tokens, stop=(ACT,))).token_ids
    return ids


def token_by_token(model: TransformersModel, talk: Any, n_tokens: int) -> Tokens:
    """The same, everything encoded for every token."""
    pieces, ids = model.pieces(talk.turns), []
    while len(ids) < n_tokens:
        forget(model)
        model._prefix.rewind_to(pieces)
        token = int(model._prefix.feed([*pieces, *ids]).argmax())
        if token in model._loaded.generation.end_ids:
            break
        ids.append(token)
    return tuple(ids)


def forget(model: TransformersModel) -> None:
    """Have the model start from nothing."""
    model._prefix.reset()
    model._features.clear()


def ours(
    model: TransformersModel,
    opening: Sequence[Part],
    history: Sequence[Step],
    behind: Sequence[Step],
    n_tokens: int,
    repeats: int,
) -> Ours:
    """Actions behind a history that is encoded already."""
    taken, shares, context = Taken(), [], 0
    for _ in range(repeats):
        forget(model)
        talk = begun(model, opening, history[:-1])
        reply(talk, 1)  # the history is encoded here; what follows is what an action costs
        talk.append(f"{history[-1][0]}{ACT}", *history[-1][1], ACT)
        context = talk.n_tokens
        with watched(model) as spent:
            taken.add(acting(talk, behind, partial(reply, n_tokens=n_tokens)))
        shares.append({name: seconds / len(behind) for name, seconds in spent.items()})
    return Ours(taken, {name: statistics.median(item[name] for item in shares) for name in _SHARES}, context)


def slow_ways(
    model: TransformersModel,
    opening: Sequence[Part],
    history: Sequence[Step],
    behind: Sequence[Step],
    n_tokens: int,
    counts: Mapping[str, int],
) -> dict[str, Taken]:
    """The same actions, as many of them as asked for, with all encoded again for each or for each token."""
    plain = TransformersModel("plain", model._loaded, replace(model._options, share_prefix=False))
    ways: dict[str, Act] = {
        "per action": partial(reply, n_tokens=n_tokens),
        "per token": partial(token_by_token, plain, n_tokens=n_tokens),
    }
    return {
        name: acting(begun(plain, opening, history), behind[: counts[name]], act)
        for name, act in ways.items()
        if counts[name]
    }


@contextmanager
def watched(model: TransformersModel) -> Iterator[dict[str, float]]:
    """Seconds of the process that the parts of a model's replies take meanwhile, by `_SHARES`."""
    spent: dict[str, float] = defaultdict(float)
    places = {
        "frames": (model._prefix, "_embed"),
        "model": (model._prefix, "_model"),
        "text": (model._prompter, "pieces"),
        "comparing": (model._prefix, "rewind_to"),
    }
    with ExitStack() as stack:
        for name, (owner, function) in places.items():
            stack.enter_context(mock.patch.object(owner, function, _timing(getattr(owner, function), spent, name)))
        yield spent


def _timing(run: Callable[..., Any], spent: dict[str, float], name: str) -> Callable[..., Any]:
    def timed(*args: Any, **kwargs: Any) -> Any:
        start = time.process_time()
        try:
            return run(*args, **kwargs)
        finally:
            spent[name] += time.process_time() - start

    return timed


def show(n_steps: int, found: Ours, slow: Mapping[str, Taken]) -> None:
    """Print a line of the first table."""
    wall, process = statistics.median(found.taken.wall), statistics.median(found.taken.process)
    seconds = [(statistics.median(way.wall), statistics.median(way.process)) for way in slow.values()]
    cells = f"{wall:6.3f} ({process:.3f}) " + "".join(f"{a:8.2f} ({b:6.2f})" for a, b in seconds)
    ratios = ", ".join(f"{a / wall:.0f}x ({b / process:.0f}x)" for a, b in seconds)
    equal = [(sum(map(tuple.__eq__, way.replies, found.taken.replies)), len(way.replies)) for way in slow.values()]
    told_equal = ", ".join(f"{number} of {every}" for number, every in equal)
    print(f"{n_steps:6} {found.n_tokens:8}   {cells}   {ratios}   {told_equal}", flush=True)


def show_shares(rows: Sequence[tuple[int, Ours]]) -> None:
    """Print the second table, and how much ours grew."""
    print("\nours, milliseconds of the process for an action")
    print(f"{'steps':>6} " + "".join(f"{name:>11}" for name in (*_SHARES, "rest", "all", "but model")))
    beside = []
    for n_steps, (taken, shares, _) in rows:
        every = statistics.median(taken.process)
        beside.append((every, every - shares["model"]))
        values = [*shares.values(), every - sum(shares.values()), *beside[-1]]
        print(f"{n_steps:6} " + "".join(f"{1000 * value:11.1f}" for value in values))
    for name, about in _SHARES.items():
        print(f"  {name}: {about}")
    grew = [last / first for first, last in zip(beside[0], beside[-1], strict=True)]
    print(f"from {rows[0][0]} to {rows[-1][0]} steps: {grew[0]:.2f} times; but for the model {grew[1]:.2f} times")


if __name__ == "__main__":
    main()
