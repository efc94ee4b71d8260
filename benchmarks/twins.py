"""Make twins of trajectories, and print what each kind of edit gives.

python benchmarks/twins.py TRAJECTORIES --out SET [--workers 2] [--seed 0]

It runs `infthor-eval twins`, and counts its drafts: edits proposed, kept and rejected by reason,
paired questions and the facts that they are about, by kind, by form and a trajectory. A guesser
that knows where things stand in the other rooms says which world of an exchange is the original.
"""

import argparse
import math
import subprocess
import sys
from collections import Counter
from itertools import islice
from pathlib import Path
from statistics import mean, median

import msgspec

from infthor_eval.formats.step_log import iter_object_states, read_steps
from infthor_eval.formats.twins import read_pairs
from infthor_eval.generation.twins.drafting import TwinDraft, is_flipped

# Kinds of which one world is the episode's own.
_EXCHANGES = {"swap", "swap-task", "swap-sliced", "move"}


def main() -> None:
    """Make the twins, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("trajectories", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--workers", default="2")
    parser.add_argument("--seed", default="0")
    parser.add_argument("--per-trajectory", default="12")
    options = parser.parse_args()
    command = ["twins", options.trajectories, "--out", options.out, "--workers", options.workers]
    command += ["--seed", options.seed, "--per-trajectory", options.per_trajectory]
    script = "from infthor_eval.cli import main; main()"
    subprocess.run([sys.executable, "-c", script, *map(str, command)], check=False)
    files = sorted(options.out.glob("drafts/*.draft"))
    drafts = [msgspec.json.decode(file.read_bytes(), type=TwinDraft) for file in files]
    print_tables(drafts)
    print_guesses(drafts, options.out)
    chosen = read_pairs(options.out)
    kinds = Counter(pair.kind for pair in chosen for _ in pair.questions)
    print(f"chosen: {kinds.total()} pairs: {dict(kinds.most_common())}")


def print_guesses(drafts: list[TwinDraft], out: Path) -> None:
    """Print how often the world with the commoner places of other rooms is the original."""
    places = {
        draft.rooms: Counter(_places(out, draft.pairs[0].traj_ids[0]).values())
        for draft in drafts
        if draft.pairs
    }
    right = 0.0
    n_pairs = 0
    for draft in drafts:
        others = Counter[tuple[str, str]]()
        for rooms, counts in places.items():
            others.update(counts if rooms != draft.rooms else {})
        for pair in draft.pairs:
            if pair.kind not in _EXCHANGES:
                continue
            n_pairs += 1
            likely = []
            for side, name in enumerate(pair.traj_ids):
                keys = [pair.ids.get(key, key) if side else key for key in pair.changed]
                world = _places(out, name)
                likely.append(sum(math.log(others[world[key]] + 0.5) for key in keys))
            original = int(is_flipped(pair.id))
            difference = likely[original] - likely[1 - original]
            right += 0.5 if difference == 0 else difference > 0
    print(f"the commoner places are the original's in {right:g} of {n_pairs} exchanges")


def _places(out: Path, name: str) -> dict[str, tuple[str, str]]:
    """Return the type of each object of a world at the start, and of what it is in or on."""
    (states,) = islice(iter_object_states(read_steps(out / "metadata" / name)), 1)
    return {
        key: (state.type, states[state.parents[0]].type if state.parents else "")
        for key, state in states.items()
        if not state.parents or state.parents[0] in states
    }


def print_tables(drafts: list[TwinDraft]) -> None:
    """Print the tables of some drafts."""
    print("| kind | proposed | kept | with questions | pairs | facts |\n|---|---|---|---|---|---|")
    for kind in sorted({name for draft in drafts for name in draft.proposed}):
        pairs = [pair for draft in drafts for pair in draft.pairs if pair.kind == kind]
        proposed = sum(draft.proposed.get(kind, 0) for draft in drafts)
        rejected = sum(sum(draft.rejected.get(kind, {}).values()) for draft in drafts)
        n_questions = sum(len(pair.questions) for pair in pairs)
        facts = {(pair.id, question.fact) for pair in pairs for question in pair.questions}
        print(
            f"| `{kind}` | {proposed} | {proposed - rejected} | {len(pairs)} | {n_questions} "
            f"| {len(facts)} |"
        )
    pairs = [pair for draft in drafts for pair in draft.pairs]
    counts = [sum(len(pair.questions) for pair in draft.pairs) for draft in drafts]
    same = [frame.same for pair in pairs for frame in pair.frames]
    print(f"pairs a trajectory: mean {mean(counts):.1f}, median {median(counts)}, {sorted(counts)}")
    print(f"frames that are equal: {sum(same) / len(same):.1%} of {len(same)}")
    reasons: Counter[str] = Counter()
    for draft in drafts:
        for rejected in draft.rejected.values():
            reasons.update(rejected)
    forms = Counter(question.form for pair in pairs for question in pair.questions)
    for title, counter in (("rejected", reasons), ("form", forms)):
        print(f"\n| {title} | |\n|---|---|")
        for name, count in counter.most_common():
            print(f"| {name} | {count} |")


if __name__ == "__main__":
    main()
