"""Pairs of moments: the same words with two answers, and how far time alone tells which is which.

python benchmarks/moment_pairs.py SET [SET ...] [--mirrored] [--every 25] [--older 30] [--least 12]

Each trajectory of the sets is asked at moments; a pair are two moments at which one question has
two answers, each wrong at the other moment, its evidence older than so many frames at both. Of
pairs on the same events one is kept. With --mirrored the pairs are those that
`infthor-eval moments` makes.

A learner is trained on the other scenes. It knows the form, the words, both answers and both
moments, and no frame: which number is larger, which list is longer, which answers come early and
late, and at which part of a trajectory. What it has is net pairs, right less exchanged: 0 where
time does not tell.
"""

import argparse
import math
import random
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from pathlib import Path

import numpy as np

from infthor_eval.formats.step_log import read_steps
from infthor_eval.generation.moment_pairs import KnownEvents, Ladder, choose, ladders, mirrors
from infthor_eval.generation.questions.candidates import Candidate
from infthor_eval.generation.questions.checker import Checker
from infthor_eval.generation.questions.generate import candidates_of, further_candidates_of
from infthor_eval.generation.questions.history import DEFAULT_SHARE, TrajectoryHistory
from infthor_eval.generation.questions.recency import QUESTION_TYPE, occurrences, recent
from infthor_eval.nieh.scoring import score

_STEPS = 200  # of gradient ascent
_PART = 200  # frames


@dataclass(frozen=True)
class Asked:
    """A question at a moment.

    Attributes:
        candidate: the question, with its answers there.
        moment: frame after which it is asked.
        age: frames since the newest evidence; of the forms that count back, since the event.
    """

    candidate: Candidate
    moment: int
    age: int

    @property
    def reply(self) -> str:
        """The answers, as a reply gives them."""
        return ", ".join(map(str, self.candidate.answers))


Pair = tuple[Asked, Asked]


def asked_at(folder: Path, every: int) -> Iterator[Asked]:
    """Yield the questions on a trajectory that the solver confirms, at evenly spaced moments."""
    steps = read_steps(folder)
    history, checker = TrajectoryHistory("t", steps), Checker(steps, DEFAULT_SHARE)
    for moment in range(every, len(steps), every):
        known, solver, rng = history.until(moment), checker.until(moment), random.Random(0)
        candidates = [
            *candidates_of(known, known.all_object_types, rng),
            *further_candidates_of(known, rng),
            *recent(occurrences(known)),
        ]
        for it in candidates:
            gold = sorted(map(str, it.answers))
            found = (solver.answers(it.text, shown) for shown in (None, it.clues))
            is_asked = it.clues and not it.absence
            if is_asked and all(answers and sorted(answers) == gold for answers in found):
                newest = it.clues[1] if it.question_type == QUESTION_TYPE else max(it.clues)
                yield Asked(it, moment, moment - newest)


def pairs_of(asked: Sequence[Asked], older: int) -> list[Pair]:
    """Return the pairs of a trajectory, one for each two sets of clues of a form."""
    by_text: dict[str, list[Asked]] = defaultdict(list)
    for one in asked:
        if one.age >= older:
            by_text[one.candidate.text].append(one)
    found: dict[tuple[object, ...], Pair] = {}
    for group in by_text.values():
        for first, second in combinations(group, 2):
            key = first.candidate.form, first.candidate.clues, second.candidate.clues
            if key not in found and _are_apart(first, second):
                found[key] = first, second
    return list(found.values())


def _are_apart(first: Asked, second: Asked) -> bool:
    if first.candidate.answers == second.candidate.answers:
        return False
    overlap = (
        score(one.reply, other.candidate.answers, scorer="strict")
        for one, other in ((first, second), (second, first))
    )
    return max(overlap) < 1


def mirrored(folder: Path, older: int) -> list[Pair]:
    """Return the pairs of `infthor-eval moments`, at their first rung."""
    history = TrajectoryHistory("t", read_steps(folder))
    found = mirrors(
        ladders(KnownEvents.of_history(history), (older,)), partial(score, scorer="strict")
    )
    return [
        (_asked(first, older), _asked(second, older))
        for mirror in choose(list(found), len(history))
        for first, second in mirror.pairs
    ]


def _asked(ladder: Ladder, age: int) -> Asked:
    return Asked(ladder.candidate, ladder.evidence + age, age)


def signs(pair: Pair) -> Counter[str]:
    """Return what tells a pair's order without a frame: positive if the first is the earlier."""
    first, second = pair
    form = first.candidate.form
    found: Counter[str] = Counter()
    for asked, sign in ((first, 1), (second, -1)):
        found[f"answer {asked.reply}"] += sign
        found[f"{form} {asked.reply}"] += sign
        for moment, at in ((first.moment, 1), (second.moment, -1)):
            found[f"answer {asked.reply} near {moment // _PART}"] += sign * at
    longer = len(first.candidate.answers) - len(second.candidate.answers)
    found["longer"] = found[f"{form} longer"] = int(math.copysign(1, longer)) if longer else 0
    if first.reply.isdigit() and second.reply.isdigit():
        found["larger"] = int(math.copysign(1, int(first.reply) - int(second.reply)))
    return found


def learned(others: Sequence[Pair], pairs: Sequence[Pair]) -> list[int]:
    """Return for each pair whether a logistic regression on others orders it rightly: 1, 0, -1."""
    rows = [signs(pair) for pair in others]
    names = {name: at for at, name in enumerate(sorted({key for row in rows for key in row}))}
    values = np.zeros((len(rows), len(names)))
    for row, counted in zip(values, rows, strict=True):
        for name, value in counted.items():
            row[names[name]] = value
    weights = np.zeros(len(names))
    for _ in range(_STEPS):
        likely = 1 / (1 + np.exp(-values @ weights))
        weights += (values.T @ (1 - likely) - weights) / max(1, len(rows))
    sums = (
        sum(weights[names[name]] * value for name, value in signs(pair).items() if name in names)
        for pair in pairs
    )
    return [int(math.copysign(1, it)) if abs(it) > 1e-9 else 0 for it in sums]


def main() -> None:
    """Print the pairs of each trajectory, and of each form what the learner has."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sets", type=Path, nargs="+")
    parser.add_argument("--mirrored", action="store_true")
    parser.add_argument("--every", type=int, default=25)
    parser.add_argument("--older", type=int, default=30)
    parser.add_argument("--least", type=int, default=12, help="pairs of a form that is listed")
    arguments = parser.parse_args()
    found: dict[str, list[Pair]] = {}
    for root in arguments.sets:
        for folder in sorted((root / "metadata").iterdir()):
            if arguments.mirrored:
                pairs = mirrored(folder, arguments.older)
            else:
                pairs = pairs_of(list(asked_at(folder, arguments.every)), arguments.older)
            found[folder.name] = pairs
            back = sum(pair[0].candidate.question_type == QUESTION_TYPE for pair in pairs)
            print(f"{folder.name}: {len(pairs)} pairs, {back} by counting back", flush=True)
    net: dict[str, list[int]] = defaultdict(list)
    by_trajectory: dict[str, Counter[str]] = defaultdict(Counter)
    for name, pairs in found.items():
        others = [pair for other, them in found.items() if other != name for pair in them]
        for pair, sign in zip(pairs, learned(others, pairs), strict=True):
            net[pair[0].candidate.form].append(sign)
            by_trajectory[pair[0].candidate.form][name] += 1
    for form, them in sorted(net.items(), key=lambda item: -len(item[1])):
        if len(them) >= arguments.least:
            share, error = np.mean(them), 1.96 / math.sqrt(len(them))
            n_in = len(by_trajectory[form])
            print(f"{share:+.2f} ± {error:.2f} of {len(them)} in {n_in} trajectories: {form}")


if __name__ == "__main__":
    main()
