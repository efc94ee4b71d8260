"""The balanced choice of paired questions."""

from collections import Counter

from msgspec.structs import replace

from infthor_eval.formats.twins import ComparedFrame, PairedQuestion, TwinPair
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


def at(moment, fact="one", form="a", answers=(("yes",), ("no",))):
    return replace(question(fact, form), moment=moment, answers=answers)


def with_evidence(pair, *differing):
    frames = tuple(ComparedFrame(number not in differing) for number in range(100))
    return replace(pair, frames=frames)


def test_a_question_at_several_moments_is_chosen_whole_and_counts_once():
    asked = with_evidence(pair("swap", at(15), at(35), at(75), at(95)), 5, 65)
    chosen = choose_pairs([[asked]], 1)
    assert [one.ages for one in chosen] == [[10, 30]]  # longer ladders come first, then names
    assert [one.ages for one in choose_pairs([[asked]], 5)] == [[10, 30], [10, 30]]


def test_there_is_a_placebo_for_every_four_pairs():
    same = (("yes",), ("yes",))
    questions = [at(15, fact=str(number)) for number in range(8)]
    placebos = [at(15, fact="placebo: Mug", form=form, answers=same) for form in "pqrs"]
    chosen = choose_pairs([[with_evidence(pair("swap", *questions, *placebos), 5)]], 100)
    assert Counter(one.question.is_placebo for one in chosen) == {False: 8, True: 2}
