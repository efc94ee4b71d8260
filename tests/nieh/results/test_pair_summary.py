"""Pairs of twins in summaries: hand-made records, and properties that hold for any replies."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from infthor_eval.nieh.records import NiehAnswer, ShownClues, TwinSide
from infthor_eval.nieh.results.pair_summary import NEVER_CHANGED, score_pairs, summarise_pairs
from infthor_eval.nieh.scoring import scores
from infthor_eval.runs import UnitRecord

PLACES = ("bowl", "drawer", "sofa", "desk")


def side(
    pair="a/1",
    world="one",
    answer="bowl",
    other="sofa",
    reply="bowl",
    *,
    base="t",
    repeat=1,
    kind="swap",
    n_frames=3,
    n_differing=1,
    age=None,
    n_after=None,
):
    twin = TwinSide(
        pair=pair,
        fact=f"{pair}: mug",
        kind=kind,
        traj_id=f"{base}-{world}",
        answers=(other,),
        n_frames=n_frames,
        n_differing=n_differing,
        n_after_clues=n_frames - 1,
        n_since_change=age,
    )
    shown = None if n_after is None else ShownClues(n_shown=1, n_clues=1, n_after=n_after)
    payload = NiehAnswer(
        question="Where is the mug now?",
        question_type="location",
        n_clues=1,
        clue_column="1",
        answers=(answer,),
        shown_clues=shown,
        twin=twin,
    )
    if reply is not None:
        payload = payload.with_reply(reply, scores(reply, (answer,)))
    return UnitRecord(
        task="nieh_twins",
        id=f"{base}-{world}/{pair}",
        cluster=base,
        fingerprint="f",
        payload=payload,
        repeat=repeat,
        failure="broke" if reply is None else None,
    )


def pair(first, second, name="a/1", **about):
    """Both worlds' records: the mug is in the bowl in one, and on the sofa in the other."""
    return [
        side(name, "one", "bowl", "sofa", first, **about),
        side(name, "two", "sofa", "bowl", second, **about),
    ]


def summary(records):
    return summarise_pairs(records, "strict")


def test_a_pair_counts_only_if_both_are_right():
    found = summary(
        [*pair("bowl", "sofa", "a/1"), *pair("bowl", "bowl", "b/1"), *pair("desk", "bowl", "c/1")]
    )
    assert (found.n_pairs, found.n_facts, found.n_trajectories) == (3, 3, 1)
    assert found.pair_accuracy.mean == pytest.approx(1 / 3)
    assert found.single.mean == pytest.approx(3 / 6)
    assert found.flipped.mean == pytest.approx(2 / 3)
    assert found.right_when_flipped.mean == pytest.approx(1 / 2)
    assert found.one_right.mean == pytest.approx(1 / 3)
    assert found.wrong_twin.mean == pytest.approx(2 / 6)  # "bowl" in the world of the sofa, twice


def test_who_says_the_same_in_both_worlds_has_no_pair():
    found = summary([*pair("bowl", "bowl"), *pair("sofa", "sofa", "b/1", base="u")])
    assert found.pair_accuracy.mean == 0
    assert found.flipped.mean == 0
    assert found.right_when_flipped is None
    assert found.one_right.mean == 1


def test_the_commoner_answer_is_prior_knowledge():
    common = [*pair("bowl", "bowl"), *pair("bowl", "bowl", "b/1")]
    rare = [
        side("c/1", "one", "desk", "bowl", "desk"),
        side("c/1", "two", "bowl", "desk", "desk"),
    ]
    found = summary([*common, *rare])
    # "bowl" is gold three times, "sofa" twice, "desk" once: right with the commoner one twice.
    assert found.one_is_commoner.mean == pytest.approx(2 / 3)
    even = summary(pair("bowl", "bowl"))
    assert even.one_is_commoner.mean == 0.5


def test_a_pair_with_a_failed_reply_has_no_result_and_the_score_says_so():
    assert summary(pair("bowl", None)) is None
    found = summary([*pair("bowl", None), *pair("bowl", "sofa", "b/9")])
    assert (found.n_pairs, found.n_incomplete) == (1, 2)
    assert (found.pair_accuracy.mean, found.pair_accuracy.n, found.pair_accuracy.n_all) == (1, 1, 2)


def test_a_question_without_its_twin_is_counted_and_in_no_pair():
    found = summary([*pair("bowl", "sofa"), side("b/1")])
    assert (found.n_pairs, found.n_incomplete) == (1, 1)
    assert summary([side("b/1")]) is None


def test_repetitions_of_a_pair_are_one_pair():
    again = pair("bowl", "bowl", repeat=2)
    found = summary([*pair("bowl", "sofa"), *again])
    assert found.n_pairs == 1
    assert found.pair_accuracy.mean == 0.5


def test_facts_count_once_however_many_pairs_they_have():
    same = [
        replace(it, payload=replace(it.payload, twin=replace(it.payload.twin, fact="a/1: mug")))
        for it in pair("bowl", "sofa", "a/2")
    ]
    found = summary([*pair("bowl", "sofa"), *same, *pair("desk", "desk", "b/1")])
    assert (found.n_pairs, found.n_facts) == (3, 2)
    assert found.pair_accuracy.mean == pytest.approx(2 / 3)
    assert found.by_fact.mean == pytest.approx(1 / 2)


def test_groups_of_pairs_have_their_names_in_order():
    found = summary(
        [
            *pair("bowl", "sofa", "a/1", kind="swap", n_frames=1, n_after=120, age=60),
            *pair("bowl", "bowl", "b/1", kind="move", n_frames=60, n_after=3, n_differing=0),
        ]
    )
    assert {name: rate.mean for name, rate in found.by_kind.items()} == {"move": 0.0, "swap": 1.0}
    assert list(found.by_shown) == ["<=1", "<=64"]
    assert list(found.by_distance) == ["0-49", "100-199"]
    assert list(found.by_difference) == ["yes", "no"]
    assert list(found.by_age) == ["50-99", NEVER_CHANGED]


def test_questions_without_twins_have_no_summary_of_pairs():
    plain = side()
    assert summary([replace(plain, payload=replace(plain.payload, twin=None))]) is None


@given(st.lists(st.tuples(st.sampled_from(PLACES), st.sampled_from(PLACES)), min_size=1))
def test_rates_of_any_replies_agree_with_one_another(replies):
    records = [
        record
        for number, (first, second) in enumerate(replies)
        for record in pair(first, second, f"p{number}/1", base=f"t{number % 3}")
    ]
    found = summary(records)
    both = found.pair_accuracy.mean
    assert both <= found.single.mean
    assert found.single.mean == pytest.approx(both + found.one_right.mean / 2)
    assert both <= found.flipped.mean  # both answers differ
    assert [it.score for it in score_pairs(records, "strict")].count(1.0) == round(
        both * len(replies)
    )
    assert found == summary(records[::-1])
