"""Check the questions on a set: the independent checker on all candidates, and baselines that do
not see frames.

python benchmarks/question_checks.py SET [--per-trajectory 25] [--seed 0] [--further] [--moments N]

The checker answers every candidate of the rules in another way: from the whole log, from the
entries of the clue frames, and with each clue left out. The baselines answer the questions that are
chosen from the candidates. With --moments both are of logs that end at so many moments, drawn, of
each trajectory.
"""

import argparse
import random
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from statistics import fmean

from infthor_eval.formats.step_log import read_steps
from infthor_eval.generation.questions.checker import Checker
from infthor_eval.generation.questions.generate import (
    candidates_of,
    further_candidates_of,
    generate_questions,
)
from infthor_eval.generation.questions.history import DEFAULT_SHARE, TrajectoryHistory
from infthor_eval.nieh.contexts import QuestionVariant
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.guessing.blind import visible_knowledge
from infthor_eval.nieh.guessing.guessers import blind_guesser
from infthor_eval.nieh.scoring import score

_YES_NO = {"yes", "no"}


def main() -> None:
    """Print the checker's verdicts and the baselines."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("set", type=Path)
    parser.add_argument("--per-trajectory", type=int, default=25)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--further", action="store_true", help="choose among the further forms too")
    parser.add_argument("--moments", type=int, default=0, help="moments of each trajectory")
    options = parser.parse_args()
    check_all(options.set, options.moments)
    generated = generate_questions(
        options.set,
        seed=options.seed,
        per_trajectory=options.per_trajectory,
        further=options.further,
        moments=options.moments,
    )
    print(
        f"chosen: {len(generated.questions)}, by number of clues {generated.by_clues()}, by type "
        f"{generated.by_type()}"
    )
    samples = [QuestionVariant(question, question.clues) for question in generated.questions]
    keys = [doc_target(question) for question in generated.questions]
    guesses = blind_guesser(visible_knowledge("clues")).guess(samples)
    for name, replies in (("oracle", keys), ("blind", guesses)):
        scores = [
            (score(reply, item.question.answers, "strict"), item.question.answers[0] in _YES_NO)
            for item, reply in zip(samples, replies, strict=True)
        ]
        yes_no = [right for right, is_yes_no in scores if is_yes_no]
        print(
            f"{name}, strict: {fmean(right for right, _ in scores):.3f}; yes/no alone "
            f"{fmean(yes_no):.3f}"
        )


def histories_of(folder: Path, n_moments: int) -> Iterator[TrajectoryHistory]:
    """Yield what has happened in each trajectory, up to its end or to so many moments."""
    for path in sorted((folder / "metadata").iterdir()):
        steps = read_steps(path)
        draw = random.Random(path.name)
        moments = draw.sample(range(len(steps)), min(n_moments, len(steps)))
        for moment in sorted(moments) or [len(steps) - 1]:
            yield TrajectoryHistory(path.name, steps[: moment + 1])


def check_all(folder: Path, n_moments: int) -> None:
    """Print how many candidates the checker confirms, and those that it does not."""
    histories = list(histories_of(folder, n_moments))
    vocabulary = frozenset[str]().union(*(history.all_object_types for history in histories))
    counts: Counter[str] = Counter()
    for history in histories:
        checker = Checker(history.steps, DEFAULT_SHARE)
        rng = random.Random(history.traj_id)
        for candidate in (
            *candidates_of(history, vocabulary, rng),
            *further_candidates_of(history, rng),
        ):
            question = candidate.question(history.traj_id)
            verdict = checker.verdict(question)
            counts.update(
                [
                    "all",
                    *(
                        name
                        for name in ("right", "sufficient", "minimal")
                        if getattr(verdict, name)
                    ),
                ]
            )
            if not verdict.sound:
                print(
                    f"  {question.traj_id}: {question.text} {question.answers} {question.clues}: "
                    f"{verdict}"
                )
    shares = ", ".join(f"{name} {counts[name]}" for name in ("right", "sufficient", "minimal"))
    print(f"{len(histories)} logs, {counts['all']} candidates: {shares}")


if __name__ == "__main__":
    main()
