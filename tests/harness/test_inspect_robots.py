"""Our episodes in inspect-robots: the same ones, with the same successes, as through our own
command."""

import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from infthor_eval.plugins import import_target
from model_adapters import load
from tests.harness.doors import (
    MAX_STEPS,
    SCRIPT,
    lose_two_episodes,
    own_successes,
    write_data,
    write_short_tasks,
)
from tests.helpers.peers import needs_peer, peer_imports

pytestmark = needs_peer("inspect-robots")
PICKUP, PUT = "manipulathor_pickup", "manipulathor_put"


@pytest.fixture(scope="module", autouse=True)
def imports():
    with peer_imports("inspect-robots"):
        yield


@pytest.fixture
def data(tmp_path, task_files):
    write_short_tasks(task_files)
    return write_data(tmp_path)


@pytest.fixture
def policy(tmp_path):
    """Makes theirs of one of our policies, by its name."""
    from tests.harness.inspect_robots_policies import OurPolicy

    (tmp_path / "frames").mkdir()
    (tmp_path / "script.py").write_text(SCRIPT)

    def policy(name=f"{tmp_path / 'script.py'}:act"):
        return OurPolicy(load(name, {}, 0), tmp_path / "frames")

    return policy


@pytest.fixture
def evaluate(tmp_path, data):
    """Runs a policy on our episodes as inspect-robots does; gives its log, read by its reader."""
    import inspect_robots

    from infthor_eval.harness.inspect_robots import InfthorArm, pickup_task, put_task

    def evaluate(policy, kind=PICKUP, limit=None, **options):
        factory = {PICKUP: pickup_task, PUT: put_task}[kind]
        task = factory(task=kind, data=str(data), limit=limit)
        arm = InfthorArm(f"{PICKUP},{PUT}", str(data), **options)
        logs = tmp_path / "logs"
        try:
            inspect_robots.eval(task, policy, arm, log_dir=str(logs))
        finally:
            arm.close()
        return inspect_robots.read_eval_log(next(logs.glob("*.json")))

    return evaluate


def successes(log):
    return {it.scene_id: it.epochs[0]["success_at_end"] == 1.0 for it in log.samples}


@pytest.mark.parametrize(("model", "kind"), [("openvla-tiny", PICKUP), ("script", PUT)])
def test_policies_succeed_in_the_same_episodes_as_through_our_own_command(
    model, kind, data, tmp_path, run_cli, policy, evaluate
):
    name = {"script": f"{tmp_path / 'script.py'}:act"}.get(model, model)
    theirs = policy(name)
    ours = own_successes(run_cli, model=name, tasks=kind, data=data, out=tmp_path / "ours")
    log = evaluate(theirs, kind)
    assert log.status == "success"
    assert successes(log) == ours
    assert set(ours.values()) == {True, False}
    assert log.results.metrics["success_at_end"] == sum(ours.values()) / len(ours)
    reasons = {it.scene_id: it.termination_reasons[0] for it in log.samples}
    assert {name for name, reason in reasons.items() if reason == "success"} == {
        name for name, done in ours.items() if done
    }
    assert set(reasons.values()) <= {"success", "failure", "max_steps"}


def test_an_arm_that_does_not_turn_adds_up_its_gripper(data, tmp_path, run_cli, policy, evaluate):
    from inspect_robots.types import Action, ActionChunk

    closing = [0.04, -0.01, 0.02, 0.0, 0.0, 0.0, 0.0]
    (tmp_path / "closing.py").write_text(f"def act(image, instruction):\n    return {closing}\n")
    name = f"{tmp_path / 'closing.py'}:act"
    ours = own_successes(run_cli, model=name, tasks=PICKUP, data=data, out=tmp_path / "ours")
    theirs = policy(name)
    act = theirs.act

    def act_by_changes(observation):
        (action,) = act(observation).actions
        return ActionChunk([Action(np.array([*action.data[:3], -1.0]))])

    theirs.act = act_by_changes
    assert successes(evaluate(theirs, turns=False)) == ours
    assert any(ours.values())


def test_their_agents_take_an_arm_that_does_not_turn(data):
    from inspect_robots.types import Action

    from infthor_eval.harness.inspect_robots import InfthorArm, pickup_task

    arm = InfthorArm(PICKUP, str(data), turns=False)
    space = arm.info.action_space
    assert space.semantics.rotation_repr == "none"
    assert space.semantics.dim_labels == ("dx", "dy", "dz", "gripper")
    assert (space.low <= 0).all() and (space.high >= 0).all()
    (scene, *_) = pickup_task(task=PICKUP, data=str(data)).scenes
    given = []
    arm.world.step = lambda delta: given.append(delta) or arm.world.reset(scene.id)
    arm.reset(scene)
    for change in (-0.3, -0.3, 0.1, 1.0, -1.0):
        arm.step(Action(np.array([0.01, 0.0, 0.0, change])))
    arm.close()
    assert [delta.gripper for delta in given] == pytest.approx([0.7, 0.4, 0.5, 1.0, 0.0])
    assert {delta.rotation for delta in given} == {(0.0, 0.0, 0.0)}


def test_a_policy_is_shown_the_wrist_and_told_of_the_hand(policy, evaluate):
    seeing = policy()
    evaluate(seeing, limit=1, cameras="front,wrist")
    seen = seeing.seen[0]
    assert {name: image.shape for name, image in seen.images.items()} == {
        "agentview": (64, 64, 3),
        "wrist": (64, 64, 3),
    }
    assert {name: array.shape for name, array in seen.state.items()} == {
        "eef_pos": (3,),
        "eef_rot": (3,),
        "gripper": (1,),
    }
    assert seen.instruction.startswith("pick up the ")


def test_an_episode_that_cannot_begin_or_loses_its_simulator_has_no_score(
    monkeypatch, policy, evaluate
):
    lose_two_episodes(monkeypatch)
    log = evaluate(policy(), limit=3)
    first, second, third = log.samples
    assert first.error == "EpisodeNotRun: the mug cannot be brought to where it was"
    assert second.error == "EpisodeNotRun: the simulator is lost"
    assert (first.epochs, second.epochs) == (({},), ({},))
    assert third.epochs[0]["success_at_end"] == log.results.metrics["success_at_end"]
    assert log.results.errored_trials == 2


def test_the_embodiment_fulfils_their_contract(data):
    from inspect_robots.conformance import check_embodiment

    from infthor_eval.harness.inspect_robots import InfthorArm, pickup_task

    info = InfthorArm(PICKUP, str(data)).info
    # A household that waits for its policy has no rate.
    assert [issue.code for issue in check_embodiment(info).issues] == ["control_hz"]
    assert [camera.height for camera in info.observation_space.cameras] == [64]
    assert pickup_task(task=PICKUP, data=str(data)).max_steps == MAX_STEPS


def test_scenes_of_other_episodes_are_refused(data, policy):
    import inspect_robots
    from inspect_robots.errors import ConfigError

    from infthor_eval.harness.inspect_robots import InfthorArm, put_task

    with pytest.raises(ConfigError, match=f"is no episode of {PICKUP}; give the embodiment"):
        inspect_robots.eval(
            put_task(task=PUT, data=str(data)), policy(), InfthorArm(PICKUP, str(data))
        )


@pytest.mark.parametrize(
    ("task", "said"),
    [("manipulathor_mimi", "did you mean"), ("manipulathor_mini,manipulathor_put", "no trajec")],
)
def test_a_bad_value_is_refused_in_a_line(task, said):
    from inspect_robots.errors import ConfigError

    from infthor_eval.harness.inspect_robots import InfthorArm

    with pytest.raises(ConfigError, match=said):
        InfthorArm(task)


def test_tasks_of_two_sizes_of_frames_are_refused(data, task_files):
    from inspect_robots.errors import ConfigError

    from infthor_eval.harness.inspect_robots import InfthorArm

    write_short_tasks(task_files, ("put",))
    with pytest.raises(ConfigError, match=r"frames of \[64, 300\] pixels"):
        InfthorArm(f"{PICKUP},manipulathor_put_mini", str(data))


def test_what_is_registered_is_there():
    groups = tomllib.loads(Path("pyproject.toml").read_text())["project"]["entry-points"]
    ours = {name: points for name, points in groups.items() if name.startswith("inspect_robots.")}
    assert set(ours) == {"inspect_robots.embodiments", "inspect_robots.tasks"}
    for points in ours.values():
        for name, target in points.items():
            assert import_target(target), name


def test_neither_torch_nor_transformers_is_imported(start):
    path = [path for path in sys.path if "inspect-robots" in path]
    start(
        f"import sys; sys.path += {path!r}; import infthor_eval.harness.inspect_robots\n"
        "assert not {'torch', 'transformers'} & set(sys.modules)"
    )
