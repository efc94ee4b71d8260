"""What is known of a log up to a frame is what the log that ends there says."""

import random

import pytest

from infthor_eval.formats.step_log import read_steps
from infthor_eval.generation.questions.checker import Checker
from infthor_eval.generation.questions.generate import candidates_of, further_candidates_of
from infthor_eval.generation.questions.history import DEFAULT_SHARE, TrajectoryHistory
from infthor_eval.generation.questions.recency import occurrences, recent

from ...helpers.bundled import BUNDLED, bundled_name


@pytest.mark.parametrize("scene", ["kitchen-1", "living-room-2"])
def test_rules_and_solver_know_the_same_of_a_beginning_as_of_a_log_that_ends_there(scene):
    steps = read_steps(BUNDLED / "metadata" / bundled_name(scene))
    history, checker = TrajectoryHistory("t", steps), Checker(steps, DEFAULT_SHARE)
    asked(history)  # what it has cached is no part of its beginnings
    for moment in (0, 17, 40, 63, len(steps) - 1):
        alone = TrajectoryHistory("t", steps[: moment + 1])
        part = history.until(moment)
        candidates = asked(part)
        assert candidates == asked(alone) and len(part) == moment + 1
        cut, whole = checker.until(moment), Checker(steps[: moment + 1], DEFAULT_SHARE)
        for candidate in candidates:
            verdict = cut.verdict(candidate.question("t"))
            assert verdict == whole.verdict(candidate.question("t")) and verdict.sound


def asked(history):
    """All candidates of the rules."""
    rng = random.Random(0)
    types = history.all_object_types | {"Mug", "Bowl"}
    return [
        *candidates_of(history, types, rng),
        *further_candidates_of(history, rng),
        *recent(occurrences(history)),
    ]
