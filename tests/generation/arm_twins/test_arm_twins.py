"""Arm twins: what they are, and what an arm makes of them that knows, guesses, or remembers."""

from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from infthor_eval import Evaluator, evaluate, load_run
from infthor_eval.errors import UsageError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.trajectory import encode_trajectory, iter_trajectories
from infthor_eval.formats.twins import read_pairs
from infthor_eval.manipulation import actors
from infthor_eval.manipulation.actors import PlannerArm
from infthor_eval.manipulation.trajectories import choice_episodes
from infthor_eval.run import open_runs
from model_adapters import Capabilities

from ...helpers.command_line import read_success
from ...helpers.processes import finish, start_cli
from ...helpers.trajectories import FORK, read_trajectory

TASK = "manipulathor_twins"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A set with one pair of worlds, as a person makes it."""
    root = tmp_path_factory.mktemp("arms")
    file = root / "base.json"
    file.write_bytes(encode_trajectory(read_trajectory(FORK)))
    out = root / "set"
    words = ("twins", file, "--arms", "--seed", 1, "--per-kind", 1, "--out", out)
    finish(start_cli(*words))
    return out


@pytest.fixture(scope="module")
def worlds(folder):
    (pair,) = read_pairs(folder)
    by_name = {trajectory.traj_id: trajectory for trajectory in iter_trajectories(folder)}
    return pair, [by_name[name] for name in pair.traj_ids]


def test_both_worlds_end_alike_and_nothing_of_late_tells_them_apart(folder, worlds):
    pair, trajectories = worlds
    frames = [NiehSet(folder).frames(name) for name in pair.traj_ids]
    one, other = ([frame.digest for frame in of_world] for of_world in frames)
    assert len(one) == len(other) == len(trajectories[0].plan.low_actions) + 1
    assert [a == b for a, b in zip(one, other, strict=True)] == [f.same for f in pair.frames]
    assert one[-11:] == other[-11:]
    for question in pair.questions:
        assert {answer for (answer,) in question.answers} == {"left", "right"}
        assert any(one[clue] != other[clue] for clue in question.clues)
        assert max(question.clues) < len(one) - 11


def test_the_instruction_is_the_same_and_names_the_other_thing(worlds):
    pair, (here, there) = worlds
    assert len(here.arm_choices) == len(there.arm_choices) == len(pair.questions) == 2
    for choice, twin in zip(here.arm_choices, there.arm_choices, strict=True):
        assert (choice.pair, choice.instruction) == (twin.pair, twin.instruction)
        assert pair.ids[choice.target] == twin.other
        assert pair.ids[choice.other] == twin.target
    forms = [choice.pair.rpartition("/")[2] for choice in here.arm_choices]
    assert forms == ["place", "order"]


def test_what_is_named_is_what_the_log_says(worlds):
    """By the actions alone: what was picked up first, and what was where at the start."""
    _, trajectories = worlds
    for trajectory in trajectories:
        acts = [low.api_action for low in trajectory.plan.low_actions]
        put = [act.object_id for act in acts if act.action == "PutObject"]
        place, order = trajectory.arm_choices
        wanted = put[0] if order.instruction.endswith("first") else put[-1]
        assert order.target == wanted
        assert {place.target, place.other} == set(put)


@pytest.fixture
def run(folder, tmp_path):
    """Evaluates a model by name, or an object, on the set; returns what the run holds."""

    def run(model, **options):
        frame = evaluate(model, TASK, data=str(folder), out=str(tmp_path), **options)
        (opened,) = open_runs([Path(frame.folder[0])])
        return opened

    return run


@pytest.fixture
def cheat(run, monkeypatch):
    """Runs the planner, which goes to the other thing where a rule says; returns net pairs by what
    it took and by what it chose, and how episodes ended."""

    def cheat(rule):
        plan = PlannerArm._steps

        def steps(situation):
            environment = situation.environment
            if rule(situation):
                other = environment.episode.choice.other
                environment.start = replace(environment.start, object_id=other)
            return plan(situation)

        monkeypatch.setattr(PlannerArm, "_steps", staticmethod(steps))
        opened = run("planner-arm")
        found = opened.summary.summary.tasks[TASK].choices
        ended = [record.payload.ended for record in opened.records]
        return found.net_pairs.mean, found.chosen.mean, ended

    return cheat


def test_a_planner_has_what_its_knowledge_is_worth(cheat):
    assert cheat(lambda situation: False) == (1.0, 1.0, ["done"] * 4)


def test_who_has_it_the_wrong_way_round_is_below_zero(cheat):
    assert cheat(lambda situation: True) == (-1.0, -1.0, ["took the other"] * 4)


def test_by_the_side_alone_there_are_no_net_pairs(cheat, worlds):
    """Who always goes left takes the same thing in both worlds."""
    pair, trajectories = worlds
    left = {}
    for side, trajectory in enumerate(trajectories):
        for question, episode in zip(pair.questions, choice_episodes(trajectory), strict=True):
            left[trajectory.traj_id, episode.index] = question.answers[side] == ("left",)

    def goes_right(situation):
        _, name, _, index = situation.seed.split("/")
        return not left[name, int(index)]

    net, chosen, ended = cheat(goes_right)
    assert (net, chosen) == (0.0, 0.0)
    assert sorted(ended) == ["done"] * 2 + ["took the other"] * 2


class Watching:
    """A policy that stays where it is, and keeps what it is told."""

    name = "watching"
    capabilities = Capabilities(counts_tokens=False, token_ids=False)

    def __init__(self):
        self.told = []

    def identity(self):
        return {}

    def begin(self, episode):
        digests = [frame.digest for frame in episode.history]
        self.told.append((episode.name, episode.instruction, digests))

    def act(self, seen):
        self.told[-1] += (seen.image.digest,)
        return ()  # gives up

    def end(self, *, success):
        assert success is None  # it would tell the twin what is right

    def close(self):
        pass


def test_a_policy_is_shown_what_happened_and_the_same_present(run, folder, worlds, monkeypatch):
    monkeypatch.setattr(actors, "check_chunk", lambda *_: None)
    pair, _ = worlds
    policy = Watching()
    opened = run(policy)
    assert opened.summary.summary.tasks[TASK].choices.net_pairs.mean == 0.0
    assert {record.payload.ended for record in opened.records} == {"gave up"}
    frames = {name: [f.digest for f in NiehSet(folder).frames(name)] for name in pair.traj_ids}
    for name, instruction, history, *present in policy.told:
        _, world, _, _ = name.split("/")
        assert len(history) == len(frames[world])
        assert instruction.startswith("pick up the one that ")
        assert len(present) == 1
    by_instruction = {}
    for _, instruction, history, *present in policy.told:
        by_instruction.setdefault(instruction, []).append((history, *present))
    for one, other, *_ in by_instruction.values():
        assert one[1] == other[1]  # pixel by pixel
        assert one[0] != other[0]


def test_which_one_is_asked_in_words_too(folder, tmp_path, run_cli):
    asked = ("--model", "oracle,blind", "--tasks", "nieh_twins")
    read_success(run_cli(*asked, "--data", str(folder), "--out", str(tmp_path)))
    scores = {
        model: load_run(next((tmp_path / model).iterdir())).score_strict.tolist()
        for model in ("oracle", "blind")
    }
    assert scores["oracle"] == [1.0] * 4
    assert sorted(scores["blind"]) == [0.0, 0.0, 1.0, 1.0]


def test_a_limit_keeps_both_worlds_of_a_pair(run):
    records = run("planner-arm", limit=2).records
    assert len(records) == 2
    assert len({record.payload.pair for record in records}) == 1


def test_trajectories_without_choices_and_options_of_other_twins_are_refused(tmp_path):
    file = tmp_path / "base.json"
    file.write_bytes(encode_trajectory(read_trajectory(FORK)))
    with (
        pytest.raises(UsageError, match="has a choice between two things"),
        Evaluator(TASK, data=str(file)),
    ):
        pass


def test_choices_are_part_of_a_trajectory_only_where_there_are_some(worlds):
    plain = msgspec.json.decode(encode_trajectory(read_trajectory(FORK)))
    assert "arm_choices" not in plain
    assert "arm_choices" in msgspec.json.decode(encode_trajectory(worlds[1][0]))
