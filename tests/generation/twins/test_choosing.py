"""The balanced choice of paired questions."""

from collections import Counter

from infthor_eval.formats.twins import PairedQuestion, TwinPair
from infthor_eval.generation.twins.twin_set import choose_pairs


def question(fact, form="Was {} open?"):
    return PairedQuestion(
        f"{form} {fact}", form, "open_state", fact, (("yes",), ("no",)), (1,), ((1,), (1,)),
        (False, False), (0.0, 0.0),
    )  # fmt: skip


def pair(kind, *questions, number=0):
    return TwinPair(
        f"{kind}-{number}", kind, 0, "", ("a", "b"), "kitchen-1", {}, (), (), (), (), questions
    )


def test_facts_come_before_further_questions_on_one():
    pairs = [pair("swap", question("one", "a"), question("one", "b"), question("two", "a"))]
    assert {one.question.fact for one in choose_pairs([pairs], 2)} == {"one", "two"}


def test_no_trajectory_has_more_than_its_share():
    pairs = [pair("swap", *(question(str(number)) for number in range(9)))]
    assert len(choose_pairs([pairs, pairs], 3)) == 6


def test_no_kind_is_above_30_percent_if_there_are_kinds_enough():
    kinds = {"swap": 9, "state": 3, "move": 3, "replace": 3}
    trajectory = [
        pair(kind, *(question(f"{number}", f"{number}") for number in range(count)))
        for kind, count in kinds.items()
    ]
    chosen = choose_pairs([trajectory], 100)
    counts = Counter(one.pair.kind for one in chosen)
    assert max(counts.values()) <= 0.3 * len(chosen)
    assert set(counts) == set(kinds)


def test_few_kinds_are_not_cut():
    trajectory = [pair("swap", question("1"), question("2")), pair("state", question("1"))]
    assert len(choose_pairs([trajectory], 100)) == 3
