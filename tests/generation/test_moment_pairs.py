"""Pairs of moments: that they come by two, hold at both moments, and that time tells nothing."""

import json
from collections import Counter, defaultdict
from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.step_log import read_steps
from infthor_eval.generation.moment_pairs import (
    KnownEvents,
    Ladder,
    choose,
    ladders,
    mirrors,
    pair_moments,
)
from infthor_eval.generation.questions.candidates import Candidate
from infthor_eval.generation.questions.checker import Checker
from infthor_eval.generation.questions.history import DEFAULT_SHARE
from infthor_eval.nieh.scoring import score

from ..helpers.bundled import BUNDLED
from ..helpers.command_line import assert_refused, read_success
from .questions.logs import history, state

FRIDGE, SAFE = "Fridge|5|0|0", "Safe|6|0|0"
RUNGS = (1, 2, 3, 5, 10)
strictly = partial(score, scorer="strict")


PAUSE = "pause"


def opened(*keys, idle=0):
    """Each is opened and closed, and for a while nothing happens."""
    for key in keys:
        if key != PAUSE:
            yield "OpenObject", key, None, {key: state(key, is_open=True)}
            yield "CloseObject", key, None, {key: state(key, is_open=False)}
        yield from [("Pass", None, None, {})] * (20 if key == PAUSE else idle)


def made(*keys, idle=0):
    start = {key: state(key, is_open=False) for key in (FRIDGE, SAFE)}
    return KnownEvents.of_history(history(start, *opened(*keys, idle=idle)))


@pytest.fixture
def folder(tmp_path):
    """The bundled set, with no questions yet."""
    root = tmp_path / "set"
    root.mkdir()
    (root / "metadata").symlink_to(BUNDLED / "metadata")
    (root / "set.json").symlink_to(BUNDLED / "set.json")
    return root


def test_a_ladder_goes_up_until_something_else_happens():
    found = ladders(made(FRIDGE, SAFE, idle=6), (1, 3, 10))
    last = {it.reply: it.rungs for it in found if it.candidate.text == "What did you open last?"}
    assert last == {"fridge": {1, 3}, "safe": {1, 3}}  # the safe is opened after 8, it ends after 7


def test_answers_that_come_in_one_order_alone_are_no_pair():
    def pairs(*keys):
        return list(mirrors(ladders(made(*keys, idle=3), (1,)), strictly))

    assert not pairs(FRIDGE, PAUSE, SAFE)
    assert not pairs(FRIDGE, SAFE, PAUSE, FRIDGE)  # each question once
    assert not pairs(FRIDGE, PAUSE, SAFE, SAFE, PAUSE, FRIDGE)  # not at the same two times
    for late in ((SAFE, FRIDGE), (FRIDGE, SAFE)):
        found = choose(pairs(FRIDGE, SAFE, PAUSE, *late), 5)
        assert [it.candidate.text for it in found] == ["What did you open last?"]
        (first, second), (third, fourth) = found[0].pairs
        assert (first.reply, second.reply) == (fourth.reply, third.reply) == ("fridge", "safe")


def test_each_question_holds_at_its_moment_and_what_comes_later_is_not_needed():
    result = pair_moments(BUNDLED, RUNGS, 25, strictly)
    assert result.trajectories == 6 and not result.skipped and result.by_form.total() >= 4
    for question in result.questions:
        checker = Checker(read_steps(BUNDLED / "metadata" / question.traj_id), DEFAULT_SHARE)
        known = checker.until(question.moment)
        gold = tuple(map(str, question.answers))
        assert known.answers(question.text) == known.answers(question.text, question.clues) == gold
        assert question.moment - max(question.clues) == int(question.pair.rpartition("/")[2])


def test_who_knows_words_answers_and_which_is_later_has_as_many_exchanged():
    result = pair_moments(BUNDLED, RUNGS, 25, strictly)
    assert_time_tells_nothing(result.questions)


def assert_time_tells_nothing(questions):
    pairs = defaultdict(list)
    for question in questions:
        pairs[question.pair].append(question)
    orders = Counter()
    for pair, sides in pairs.items():
        first, second = sorted(sides, key=lambda question: question.moment)
        assert first.text == second.text and len(first.clues) == len(second.clues)
        rung = pair.rpartition("/")[2]
        orders[first.traj_id, first.text, rung, first.answers, second.answers] += 1
    assert orders
    for (traj_id, text, rung, first, second), n in orders.items():
        assert first != second and orders[traj_id, text, rung, second, first] == n


@st.composite
def some_ladders(draw):
    """Questions on events in a row, by how many others have followed."""
    events = draw(st.lists(st.sampled_from(["fridge", "safe", "box"]), min_size=4, max_size=16))
    found = []
    for n_later, ordinal in enumerate(("last", "second to last", "third to last")):
        for number, answer in enumerate(events[: len(events) - n_later]):
            frames = range(10 * number, 10 * (number + n_later) + 1, 10)
            clues = tuple(clue for frame in frames for clue in (frame, frame + 1))
            rungs = draw(st.frozensets(st.sampled_from([10, 30, 100]), min_size=1))
            candidate = Candidate("t", "What {}?", (ordinal,), clues, (answer,), ())
            found.append(Ladder(candidate, rungs))
    return found


@given(some_ladders(), st.integers(0, 6))
def test_what_is_chosen_is_balanced_and_asks_nothing_twice(found, most):
    chosen = choose(list(mirrors(found, strictly)), most)
    assert len(chosen) <= most
    asked = Counter((it.candidate.text, it.evidence) for one in chosen for it in one.ladders)
    assert set(asked.values()) <= {1}
    for one in chosen:
        (first, second), (third, fourth) = one.pairs
        apart = min(second.evidence, fourth.evidence) - max(first.evidence, third.evidence)
        assert abs(first.evidence - third.evidence) < apart
        assert abs(second.evidence - fourth.evidence) < apart
        assert (first.reply, second.reply) == (fourth.reply, third.reply)
        assert one.rungs and all(set(one.rungs) <= it.rungs for it in one.ladders)


@given(some_ladders())
def test_no_event_is_told_by_two_pairs_of_answers(found):
    answers = defaultdict(set)
    for one in choose(list(mirrors(found, strictly)), 100):
        for ladder in one.ladders:
            answers[ladder.candidate.form, ladder.candidate.clues[0]].add(one.fact)
    assert all(len(facts) == 1 for facts in answers.values())


def test_no_event_of_the_bundled_set_is_told_by_two_pairs_of_answers():
    answers = defaultdict(set)
    for question in pair_moments(BUNDLED, RUNGS, 100, strictly).questions:
        words = "open" if "open" in question.text else question.text.partition(" ")[0]
        answers[question.traj_id, words, question.clues[0]].add(question.fact)
    assert answers and all(len(facts) == 1 for facts in answers.values())


def test_the_pairs_are_a_task(folder, run_cli, tmp_path):
    file = folder / "moments.csv"
    words = ("moments", folder, "--out", file, "--rungs", "1,2,3,5,10")
    printed, _ = read_success(run_cli(*words))
    assert " pairs of moments on 6 trajectories" in printed
    out = tmp_path / "out"
    for model in ("oracle", "blind", "flip"):
        words = ("run", "--model", model, "--tasks", "nieh_moments", "--data", file)
        read_success(run_cli(*words, "--output", out / model))
    found = {}
    for path in out.rglob("results.json"):
        written = json.loads(path.read_text())["summary"]["tasks"]["nieh_moments"]["pairs"]
        found[path.relative_to(out).parts[0]] = written
    assert found["oracle"]["net_pairs"]["mean"] == 1 and found["blind"]["net_pairs"]["mean"] == 0
    assert found["flip"]["flipped"]["mean"] == 1
    assert set(found["oracle"]["by_kind"]) == {"moment"}
    assert {question.cluster for question in NiehSet(file).questions} == {
        question.traj_id for question in NiehSet(file).questions
    }


def test_rungs_are_numbers_of_frames(folder, run_cli):
    words = ("moments", folder, "--out", folder / "moments.csv", "--rungs")
    for rungs in ("", "0", "soon"):
        assert_refused(run_cli(*words, rungs), "give numbers of frames above 0")


def test_a_trajectory_that_cannot_be_read_is_named_and_the_others_are_paired(tmp_path, run_cli):
    metadata = tmp_path / "set" / "metadata"
    metadata.mkdir(parents=True)
    for path in (BUNDLED / "metadata").iterdir():
        (metadata / path.name).symlink_to(path)
    (metadata / "spoiled").mkdir()
    (metadata / "spoiled" / "metadata.json").write_text("[{")
    out = tmp_path / "set" / "moments.csv"
    code, printed, notes = run_cli("moments", tmp_path / "set", "--out", out, "--rungs", "1,2")
    assert code == 1 and "on 6 trajectories" in printed and "spoiled" in notes


@pytest.fixture
def published(tmp_path):
    """The bundled set in the published layout: no ids in logs, and trajectories apart."""
    root = tmp_path / "published"
    for path in (BUNDLED / "metadata").iterdir():
        folder = root / "metadata" / path.name
        folder.mkdir(parents=True)
        for name in ("img", "expert_log.json"):
            (folder / name).symlink_to(path / name)
        log = json.loads((path / "metadata.json").read_text())
        fields = ("img_idx", "img_filename", "step", "object_log")
        entries = [{name: {"step": 0, **entry}[name] for name in fields} for entry in log]
        (folder / "metadata.json").write_text(json.dumps(entries))
        (tmp_path / "apart").mkdir(exist_ok=True)
        (tmp_path / "apart" / f"{path.name}.json").symlink_to(path / "traj_data.json")
    return root


def test_published_logs_do_with_their_trajectories(published):
    apart = published.parent / "apart"
    found = pair_moments(published, RUNGS, 25, strictly, apart)
    assert not found.skipped and found.by_form.total() >= 4
    assert_time_tells_nothing(found.questions)
    for question in found.questions:
        checker = Checker(read_steps(BUNDLED / "metadata" / question.traj_id), DEFAULT_SHARE)
        known = checker.until(question.moment).answers(question.text)
        assert known == tuple(map(str, question.answers))  # by the log that has ids


def test_what_a_log_must_say_is_said(published, run_cli):
    words = ("moments", published, "--out", published / "moments.csv")
    code, _, notes = run_cli(*words)
    assert code == 1 and notes.count("the trajectory's JSON is not in metadata/") == 6
    for path in published.glob("metadata/*/metadata.json"):
        numbers = [entry["img_idx"] for entry in json.loads(path.read_text())]
        path.write_text(json.dumps({"img_idx": numbers}))
    code, _, notes = run_cli(*words, "--trajectories", published.parent / "apart", "--overwrite")
    assert code == 1 and notes.count("does not say what the frames show") == 6
