"""Twins that are asked at rungs: when, about what, and what their set says."""

import json
from functools import partial
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.step_log import ObjectInFrame, Step
from infthor_eval.formats.twins import ComparedFrame, PairedQuestion, read_pairs
from infthor_eval.generation.questions.history import TrajectoryHistory
from infthor_eval.generation.replay_set import select
from infthor_eval.generation.twins import rungs
from infthor_eval.generation.twins.drafting import TwinSettings, draft_twins
from infthor_eval.generation.twins.insertions import Insertion
from infthor_eval.generation.twins.rungs import farthest_first, ladders, stretches, that_stay
from infthor_eval.generation.twins.twin_set import make_twins
from infthor_eval.nieh.results import retention
from infthor_eval.nieh.scoring import score
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.workers import WorkerSettings

from ...helpers.command_line import read_success

RUNGS = (3, 6, 12)


def frames(differing):
    return [ComparedFrame(not differs) for differs in differing]


def test_moments_are_so_many_frames_after_a_difference_and_before_the_next():
    differing = [at in (1, 6) for at in range(10)]
    assert ladders(frames(differing), (2, 3, 4, 5)) == [[3, 4, 5], [8, 9]]
    assert ladders(frames([False] * 10), (2, 3)) == []
    assert ladders(frames([True, False]), (2, 3)) == []


@given(
    st.lists(st.booleans(), max_size=60),
    st.lists(st.integers(1, 40), unique=True).map(lambda rungs: tuple(sorted(rungs))),
)
def test_the_newest_difference_is_a_rung_before_each_moment(differing, rungs):
    found = ladders(frames(differing), rungs)
    assert len(found) <= 6
    for moments in found:
        evidence = {max(at for at in range(moment + 1) if differing[at]) for moment in moments}
        assert len(evidence) == 1
        ages = [moment - evidence.copy().pop() for moment in moments]
        assert tuple(ages) == rungs[: len(ages)]


def asked(text, answer):
    return PairedQuestion(
        text, text, "open_state", "open_state: Fridge", ((answer,), ("other",)), (1,), ((1,), (1,)),
        (False, False), (0.0, 0.0),
    )  # fmt: skip


def test_questions_stay_as_long_as_their_answers_do():
    at_rungs = [
        [asked("a", "1"), asked("b", "1")],
        [asked("a", "1"), asked("b", "2"), asked("c", "1")],
        [asked("a", "1"), asked("b", "1"), asked("c", "1")],
    ]
    assert [question.text for question in that_stay(at_rungs)] == ["a", "b", "a", "a"]


def test_edits_of_what_is_unseen_for_longest_come_first():
    shown = {0: ["Fridge|1", "Egg|1"], 3: ["Fridge|1"], 12: ["Egg|1"]}
    box = ObjectInFrame(400, (100, 100, 120, 120), True)
    steps = [Step(at, "", seen=dict.fromkeys(shown.get(at, ()), box)) for at in range(20)]
    episode = SimpleNamespace(history=TrajectoryHistory("made", steps))
    # 17 frames after frame 3; 12 between 0 and 12; 8 after 12; none that shows it
    far, middle, near, never = (
        Insertion(at, ((), ()), frozenset({key}), frozenset())
        for at, key in ((0, "Fridge|1"), (0, "Egg|1"), (4, "Egg|1"), (4, "Fridge|1"))
    )
    ordered = [never, near, middle, far]
    assert farthest_first(ordered, episode, (1, 8, 12, 16)) == [far, middle, near, never]
    assert farthest_first(ordered, episode, (1, 9)) == [middle, far, near, never]
    assert farthest_first(ordered, episode, (1,)) == [near, middle, far, never]


def test_stretches_are_beginnings_that_end_with_a_sub_goal(living_room, monkeypatch):
    monkeypatch.setattr(rungs, "_SHORTEST", 4)
    whole, *parts = stretches(living_room)
    assert whole is living_room and whole.is_whole and parts
    lengths = [len(part.trajectory.plan.low_actions) for part in parts]
    for at, part in enumerate(parts, 1):
        assert not part.is_whole
        assert lengths[at - 1] <= len(whole.trajectory.plan.low_actions) / 2**at
        assert len(part.history) == lengths[at - 1] + 1
        last = part.trajectory.plan.low_actions[-1]
        following = whole.trajectory.plan.low_actions[lengths[at - 1]]
        assert last.high_idx != following.high_idx
        assert len(part.trajectory.sub_tasks) == len(part.trajectory.sub_trajs)
        assert part.trajectory.sub_trajs[-1].low_pddl_idx[1] == lengths[at - 1]
    assert lengths == sorted(lengths, reverse=True)


@pytest.fixture(scope="module")
def made(file, tmp_path_factory):
    """A set of twins at rungs, and its numbers."""
    out = tmp_path_factory.mktemp("rungs") / "set"
    kinds = ("state", "count-open", "count-move", "put-target")
    summary = make_twins(
        select([file]),
        embedded_launch(),
        out,
        TwinSettings(kinds, rungs=RUNGS),
        partial(draft_twins, score=partial(score, scorer="strict")),
        worker_settings=WorkerSettings(),
    )
    return out, summary


def test_each_question_is_asked_at_its_rungs_of_worlds_that_look_the_same_since(made):
    out, summary = made
    pairs = read_pairs(out)
    ages = set()
    for pair in pairs:
        evidence_of: dict[object, int] = {}
        for question in pair.questions:
            evidence = pair.evidence(question.moment)
            age = question.moment - evidence
            ages.add(age)
            # Nobody is asked the same once more on other evidence.
            assert evidence_of.setdefault((question.text, question.answers), evidence) == evidence
            assert age in RUNGS
            assert all(pair.frames[at].same for at in range(evidence + 1, question.moment + 1))
            assert max(question.clues) <= question.moment
    assert {3, 6} <= ages
    counted = [question for pair in pairs for question in pair.questions]
    assert summary.placebos == sum(question.is_placebo for question in counted)
    assert sum(summary.by_age.values()) == len(counted) - summary.placebos
    assert summary.pairs <= summary.by_age[3]  # those that reach further are there, too


def test_the_last_frames_before_a_moment_are_the_same_in_both_worlds(made):
    out, _ = made
    data = NiehSet(out)
    by_pair = {}
    for question in data.questions:
        by_pair.setdefault(question.pair, []).append(question)
    for questions in by_pair.values():
        one, other = (data.frames_until(question) for question in questions)
        assert len(one) == len(other)
        age = next(
            at for at, (a, b) in enumerate(zip(one[::-1], other[::-1], strict=True)) if a != b
        )
        assert age in RUNGS


def test_every_row_can_be_asked_and_oracle_has_all_pairs_at_every_age(
    made, run_cli, tmp_path, monkeypatch
):
    monkeypatch.setattr(retention, "_FEWEST", 1)
    out, summary = made
    assert not NiehSet(out).skipped
    run = ("--tasks", "nieh_twins", "--data", out, "--context", "trajectory", "--output", tmp_path)
    read_success(run_cli("run", "--model", "oracle", *run))
    (file,) = tmp_path.glob("oracle/*/results.json")
    pairs = json.loads(file.read_text())["summary"]["tasks"]["nieh_twins"]["pairs"]
    assert pairs["net_pairs"]["mean"] == pairs["placebo"]["mean"] == 1.0
    assert pairs["placebo"]["n"] == summary.placebos
    kept = pairs["retention"]["kept"]
    assert [(it["age"], it["share"]) for it in kept] == [(rung, 1.0) for rung in RUNGS[: len(kept)]]
    assert pairs["retention"]["half_life"] == [kept[-1]["age"], None]
    read_success(run_cli("report", file.parent, "--out", tmp_path / "page.html"))
    assert '"asked after frame"' in (tmp_path / "page.html").read_text()


def test_placebos_differ_in_a_clue_frame_and_not_in_their_answer(made):
    out, summary = made
    assert summary.placebos
    for pair in read_pairs(out):
        for question in pair.questions:
            if question.is_placebo:
                assert question.fact.startswith("placebo: ")
                assert any(not pair.frames[clue].same for clue in question.clues)
