"""How far the questions of a set can be trusted: a second opinion on all of them, and what can be had without looking.

python benchmarks/question_checks.py SET [--per-trajectory 25] [--seed 0] [--further]

The checker answers every question that the rules can make, from the log, by another way than the rules; then once from
the entries of the clue frames alone, and once with each clue left out. The baselines are those of the chosen questions.
"""

import argparse
import random
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from infthor_eval.formats.step_log import read_steps
from infthor_eval.generation.questions.checker import Checker
from infthor_eval.generation.questions.generate import candidates_of, further_candidates_of, generate_questions
from infthor_eval.generation.questions.history import DEFAULT_SHARE, TrajectoryHistory
from infthor_eval.nieh.baselines import BASELINES, Predict
from infthor_eval.nieh.contexts import Sample
from infthor_eval.nieh.scoring import score

_YES_NO = {"yes", "no"}


def main() -> None:
    """Print the checker's verdicts and the baselines."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("set", type=Path)
    parser.add_argument("--per-trajectory", type=int, default=25)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--further", action="store_true", help="choose among the further forms too")
    chosen = parser.parse_args()
    check_all(chosen.set)
    made = generate_questions(
        chosen.set, seed=chosen.seed, per_trajectory=chosen.per_trajectory, further=chosen.further
    )
    print(f"chosen: {len(made.questions)}, by number of clues {made.by_clues()}, by type {made.by_type()}")
    asked = [Sample(question, question.clues) for question in made.questions]
    yes_no = [item for item in asked if item.question.answers[0] in _YES_NO]
    for name in ("oracle", "blind", "blind-count"):
        predict = BASELINES[name](0).fit(asked)
        print(f"{name}, strict: {mean(predict, asked):.3f}; yes/no alone {mean(predict, yes_no):.3f}")


def check_all(folder: Path) -> None:
    """Print how often the checker agrees with every candidate, and why not."""
    histories = [TrajectoryHistory(path.name, read_steps(path)) for path in sorted((folder / "metadata").iterdir())]
    vocabulary = frozenset[str]().union(*(history.all_object_types for history in histories))
    found: Counter[str] = Counter()
    for history in histories:
        checker = Checker(history.steps, DEFAULT_SHARE)
        rng = random.Random(history.traj_id)
        for candidate in (*candidates_of(history, vocabulary, rng), *further_candidates_of(history, rng)):
            question = candidate.question(history.traj_id)
            verdict = checker.verdict(question)
            found.update(["all", *(name for name in ("right", "sufficient", "minimal") if getattr(verdict, name))])
            if not verdict.sound:
                print(f"  {question.traj_id}: {question.text} {question.answers} {question.clues}: {verdict}")
    shares = ", ".join(f"{name} {found[name]}" for name in ("right", "sufficient", "minimal"))
    print(f"{len(histories)} trajectories, {found['all']} candidates: {shares}")


def mean(predict: Predict, samples: Sequence[Sample]) -> float:
    """A baseline's mean under the strict scorer."""
    return sum(score(predict(item), item.question.answers, "strict") for item in samples) / len(samples)


if __name__ == "__main__":
    main()
