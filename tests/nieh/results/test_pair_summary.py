"""Pairs of twins in summaries: hand-made records, and properties that hold for any replies."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from infthor_eval.nieh.records import ShownClues, TwinSide
from infthor_eval.nieh.results.pair_summary import score_pairs, summarise_pairs
from infthor_eval.pairs import PAIR_BOUNDS, PairShares
from infthor_eval.rates import format_percent

from ...helpers.nieh_runs import make_record

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
    length=100,
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
        age=age,
        span=age,
        length=length,
    )
    shown = None if n_after is None else ShownClues(n_shown=1, n_clues=1, n_after=n_after)
    named = {"task": "nieh_twins", "id": f"{base}-{world}/{pair}", "cluster": base}
    return make_record(0, reply, (answer,), twin=twin, shown_clues=shown, repeat=repeat, **named)


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
    assert found.net_pairs.mean == pytest.approx(1 / 3)
    assert found.pairs_exchanged.mean == 0.0


def test_pairs_whose_answers_are_exchanged_are_taken_off():
    found = summary(
        [
            *pair("bowl", "sofa", "a/1", base="t"),
            *pair("sofa", "bowl", "b/1", base="u"),  # each right in the other world
            *pair("sofa", "bowl", "c/1", base="u"),
            *pair("sofa", "sofa", "d/1", base="v"),  # one of them is
        ]
    )
    assert found.pair_accuracy.mean == 1 / 4
    assert found.pairs_exchanged.mean == 2 / 4
    assert found.net_pairs.mean == -1 / 4
    assert found.net_pairs.low == -1.0  # all drawn bases are u: the interval is of a difference
    assert found.by["kind"]["swap"].mean == -1 / 4
    assert found.scores == {"t": {"a/1": 1.0}, "u": {"b/1": -1.0, "c/1": -1.0}, "v": {"d/1": 0.0}}


def test_where_all_bases_are_equal_there_is_no_interval_and_it_is_said():
    found = summary([*pair("bowl", "sofa", "a/1"), *pair("bowl", "sofa", "b/1", base="u")])
    assert (found.net_pairs.mean, found.net_pairs.low, found.net_pairs.all_equal) == (1, None, True)
    assert format_percent(found.net_pairs) == "100.0 [all equal]"
    alone = summary(pair("bowl", "sofa"))
    assert (alone.net_pairs.low, alone.net_pairs.all_equal) == (None, False)
    assert format_percent(alone.net_pairs) == "100.0"


def test_lists_are_exchanged_with_full_marks_alone():
    def exchanged(reply):
        one = side("a/1", "one", "bowl", "sofa", reply)
        twin = replace(one.payload.twin, answers=("sofa", "desk"))
        one = replace(one, payload=replace(one.payload, twin=twin))
        return summary([one, side("a/1", "two", "sofa", "bowl", "bowl")]).pairs_exchanged.mean

    assert (exchanged("sofa, desk"), exchanged("sofa")) == (1.0, 0.0)


@given(st.lists(st.lists(st.sampled_from(PLACES), min_size=2, max_size=2), min_size=1))
def test_exchanging_all_worlds_exchanges_the_sign(replies):
    """Who gives each world's reply to the other has as many net pairs, with the other sign."""

    def net(turned):
        return summary(
            [
                record
                for number, both in enumerate(replies)
                for record in pair(*(both[::-1] if turned else both), f"p{number}/1")
            ]
        ).net_pairs.mean

    assert net(turned=True) == pytest.approx(-net(turned=False))


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
    for rate in (found.net_pairs, found.pair_accuracy):
        assert (rate.mean, rate.n, rate.n_all) == (1, 1, 2)


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
    assert found.net_pairs.mean == pytest.approx(2 / 3)
    assert found.by_fact.mean == pytest.approx(1 / 2)


def test_groups_of_pairs_have_their_names_in_order():
    found = summary(
        [
            *pair("bowl", "sofa", "a/1", kind="swap", n_frames=1, n_after=120, age=60),
            *pair("bowl", "bowl", "b/1", kind="move", n_frames=60, n_after=3, n_differing=0),
        ]
    )
    assert {name: rate.mean for name, rate in found.by["kind"].items()} == {
        "move": 0.0,
        "swap": 1.0,
    }
    assert list(found.by["shown"]) == ["<=1", "<=64"]
    assert list(found.by["distance"]) == ["0-49", "100-199"]
    assert list(found.by["difference"]) == ["yes", "no"]
    assert list(found.by["age"]) == list(found.by["span"]) == ["30-99"]
    assert {name: rate.n for name, rate in found.by["length"].items()} == {"100-299": 2}
    assert {name: rate.n for name, rate in found.by["clues"].items()} == {"1": 2}


def test_placebos_are_in_no_rate_but_their_own():
    placebos = [
        *pair("bowl", "bowl", "p/1", base="u"),
        *pair("bowl", "sofa", "p/2", base="u"),
    ]
    same = [
        replace(
            it,
            payload=replace(
                it.payload,
                answers=("bowl",),
                twin=replace(it.payload.twin, answers=("bowl",)),
                scores={"strict": float(it.payload.reply == "bowl")},
            ),
        )
        for it in placebos
    ]
    found = summary([*pair("bowl", "sofa"), *same])
    assert (found.n_pairs, found.net_pairs.mean, found.placebo.mean) == (1, 1.0, 0.5)
    assert [it.pair for it in score_pairs([*pair("bowl", "sofa"), *same], "strict")] == ["a/1"]
    assert summary(pair("bowl", "sofa")).placebo is None


def test_questions_on_one_evidence_are_followed_from_age_to_age():
    found = summary(
        [
            record
            for base in ("t", "u")
            for age, second in ((10, "sofa"), (30, "sofa" if base == "t" else "bowl"))
            for record in pair("bowl", second, f"{base}/{age}", base=base, age=age, length=50 + age)
        ]
    )
    assert found.retention is None  # they are about two facts each


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
    assert [it.shares.right for it in score_pairs(records, "strict")].count(1.0) == round(
        both * len(replies)
    )
    assert found.net_pairs.mean == pytest.approx(both - found.pairs_exchanged.mean)
    assert found == summary(records[::-1])


def test_bounds_of_metrics_of_pairs_are_reached_and_never_passed():
    shares = [PairShares(*ends).by_metric for ends in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))]
    for metric, bounds in PAIR_BOUNDS.items():
        values = [share[metric] for share in shares]
        assert (min(values), max(values)) == bounds
