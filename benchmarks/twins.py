"""Make twins of trajectories, and print what each kind of edit gives.

python benchmarks/twins.py TRAJECTORIES --out SET [--workers 2] [--seed 0]

It runs `infthor-eval twins`, and counts its drafts: edits proposed, kept and rejected by reason,
paired questions and the facts that they are about, by kind, by form and a trajectory. A learner
that sees both worlds guesses which one is the original (`twins_original.py`).
"""

import argparse
import subprocess
import sys
from collections import Counter
from pathlib import Path
from statistics import mean, median

import msgspec
from twins_original import print_guesses, read_examples

from infthor_eval.formats.twins import read_pairs
from infthor_eval.generation.twins.drafting import TwinDraft


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
    print_guesses(read_examples([options.out]))
    chosen = read_pairs(options.out)
    kinds = Counter(pair.kind for pair in chosen for _ in pair.questions)
    print(f"chosen: {kinds.total()} pairs: {dict(kinds.most_common())}")


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
