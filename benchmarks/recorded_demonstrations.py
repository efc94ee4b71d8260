"""Does the embedded simulator accept what people's experts did in AI2-THOR? Replay ALFRED's
demonstrations.

    python benchmarks/recorded_demonstrations.py --data FOLDER [--split valid_seen] [--every 1]
    [--per-floor-plan N]

It replays the recorded actions of FOLDER/alfred/<split>.jsonl.gz on the recorded floor plans,
without frames, and prints how many moves and interactions are accepted, how many demonstrations are
whole, the shares of puts by receptacle, and what was refused and why. Each of these actions
succeeded in AI2-THOR.
"""

import argparse
import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from infthor_eval.formats.trajectory import LowAction, Trajectory
from infthor_eval.generation.replay_set import select
from infthor_eval.thor.grounding import Grounding
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.recorded import MissingObjectError, translate
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.supplement import supplement_file

_MOVES = frozenset({"MoveAhead", "RotateLeft", "RotateRight", "LookUp", "LookDown"})
_SHOWN = 12  # kinds of refusals that are printed


@dataclass
class Counts:
    """What became of the demonstrations.

    Attributes:
        whole: demonstrations without a refused action.
        demonstrations: all that were replayed.
        accepted, tried: actions by kind ("move", "interaction").
        puts: accepted and refused puts by type of receptacle.
        refusals: refused actions by name, type of object, type of receptacle and message.
    """

    whole: int = 0
    demonstrations: int = 0
    accepted: Counter[str] = field(default_factory=Counter)
    tried: Counter[str] = field(default_factory=Counter)
    puts: dict[str, Counter[bool]] = field(default_factory=dict)
    refusals: Counter[str] = field(default_factory=Counter)

    def add(self, low: LowAction, error: str | None) -> None:
        """Count one action; `error` is None if it was accepted."""
        kind = "move" if low.api_action.action in _MOVES else "interaction"
        self.tried[kind] += 1
        self.accepted[kind] += error is None
        if low.api_action.action == "PutObject":
            receptacle = _type_of(low.api_action.receptacle_id)
            self.puts.setdefault(receptacle, Counter())[error is None] += 1
        if error is not None:
            self.refusals[_describe(low, error)] += 1

    def share(self, kind: str) -> float:
        """Return the accepted share of a kind of action."""
        return self.accepted[kind] / self.tried[kind] if self.tried[kind] else float("nan")

    def document(self) -> dict[str, object]:
        """Return the numbers as they are printed with --json."""
        refused = {name: counts[False] for name, counts in self.puts.items() if counts[False]}
        return {
            "demonstrations": self.demonstrations,
            "whole": self.whole,
            "moves": self.share("move"),
            "interactions": self.share("interaction"),
            "tried": dict(self.tried),
            "puts": {name: sum(counts.values()) for name, counts in sorted(self.puts.items())},
            "puts_refused": refused,
            "refusals": dict(self.refusals.most_common()),
        }


def replay_demonstrations(data: Path, trajectories: Iterable[Trajectory]) -> Counts:
    """Replay demonstrations on the recorded floor plans of a folder, and return what was
    accepted."""
    listed, counts = list(trajectories), Counts()
    with (
        supplement_file(listed) as supplement,
        Simulator(embedded_launch(data, supplement), image=False, instances=False) as simulator,
    ):
        for trajectory in listed:
            errors = list(_replay(trajectory, simulator))
            for low, error in zip(trajectory.plan.low_actions, errors, strict=True):
                counts.add(low, error)
            counts.demonstrations += 1
            counts.whole += not any(errors)
    return counts


def _replay(trajectory: Trajectory, simulator: Simulator) -> Iterator[str | None]:
    """Yield for each action of a demonstration None, or why it was refused; go on after a refusal,
    as ALFRED does."""
    restore(simulator, trajectory.scene)
    grounding = Grounding(simulator.view)
    for low in trajectory.plan.low_actions:
        try:
            call = translate(low, grounding, simulator.view)
        except MissingObjectError as missing:
            yield str(missing)
            continue
        after = simulator.step(**call)
        yield None if after.success else after.error or "refused without a message"


def demonstrations(
    path: Path, every: int = 1, per_floor_plan: int | None = None
) -> list[Trajectory]:
    """Return every so-maniest demonstration of a file, at most some of each floor plan."""
    selection = select([path], per_floor_plan=per_floor_plan)
    for failure in selection.failures:
        print(f"not read: {failure.message}")
    return [trajectory for _, trajectory in selection.items[::every]]


def _type_of(object_id: str | None) -> str:
    return (object_id or "").partition("|")[0]


def _describe(low: LowAction, error: str) -> str:
    """Return a refusal without ids and numbers, so that equal ones are counted together."""
    action = low.api_action
    words = [action.action, _type_of(action.object_id), _type_of(action.receptacle_id)]
    return f"{' '.join(filter(None, words))}: {re.sub(r'[|][-+|.0-9A-Za-z_]+', '', error)}"


def main() -> None:
    """Replay the chosen demonstrations and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--data", type=Path, required=True, help="folder with alfred/ and thor_scenes/"
    )
    parser.add_argument("--split", default="valid_seen", help="valid_seen or train")
    parser.add_argument("--every", type=int, default=1, help="take every so-maniest demonstration")
    parser.add_argument(
        "--per-floor-plan", type=int, help="demonstrations of one floor plan, at most"
    )
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    path = options.data / "alfred" / f"{options.split}.jsonl.gz"
    counts = replay_demonstrations(
        options.data, demonstrations(path, options.every, options.per_floor_plan)
    )
    if options.json:
        print(json.dumps(counts.document()))
        return
    print(f"{counts.whole} of {counts.demonstrations} demonstrations whole")
    for kind in sorted(counts.tried):
        print(
            f"{kind}s: {counts.accepted[kind]} of {counts.tried[kind]} accepted, "
            f"{counts.share(kind):.2%}"
        )
    for receptacle, results in sorted(counts.puts.items(), key=lambda item: -item[1][False]):
        if results[False]:
            print(f"  puts refused, {receptacle}: {results[False]} of {sum(results.values())}")
    for text, number in counts.refusals.most_common(_SHOWN):
        print(f"  {number} x {text}")


if __name__ == "__main__":
    main()
