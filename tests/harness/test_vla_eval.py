"""Our episodes as a benchmark of vla-eval: the same ones, with the same successes, as through our
own command."""

import json
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from infthor_eval.errors import UsageError
from model_adapters import load
from tests.harness.doors import (
    MAX_STEPS,
    SCRIPT,
    TASKS,
    lose_two_episodes,
    own_successes,
    write_data,
    write_short_tasks,
)
from tests.helpers.peers import needs_peer, peer_imports

pytestmark = needs_peer("vla-eval")
WATCHED = "tests.harness.vla_eval_servers:Watched"


@pytest.fixture(scope="module", autouse=True)
def imports():
    with peer_imports("vla-eval"):
        yield


@pytest.fixture
def data(tmp_path, task_files):
    write_short_tasks(task_files)
    return write_data(tmp_path)


@pytest.fixture
def evaluate(tmp_path, data):
    """Runs a model server on our episodes as vla-eval does; gives what it writes, by name."""
    import vla_eval

    def evaluate(server, **params):
        entry = {"benchmark": WATCHED, "name": "arm", "params": {"task": TASKS, **params}}
        entry["params"].setdefault("data", str(data))
        out = tmp_path / "theirs"
        config = {"benchmarks": [entry], "output_dir": str(out), "render": "cpu"}
        # In a thread: a loop may run in this one that another test has left.
        with vla_eval.serve_background(server) as served, ThreadPoolExecutor(1) as pool:
            pool.submit(vla_eval.run, config, server_url=served.url, docker=False).result()
        written = json.loads((out / "arm_aggregate.json").read_text())
        return {task["task"]: task["episodes"][0] for task in written["tasks"]}

    return evaluate


def successes(episodes):
    return {name: episode["metrics"]["success"] for name, episode in episodes.items()}


@pytest.fixture
def frames(tmp_path):
    folder = tmp_path / "frames"
    folder.mkdir()
    return folder


@pytest.mark.parametrize(("model", "dtype"), [("openvla-tiny", "float64"), ("script", "float32")])
def test_policies_succeed_in_the_same_episodes_as_through_our_own_command(
    model, dtype, data, tmp_path, frames, run_cli, evaluate
):
    from tests.harness.vla_eval_servers import PolicyServer

    if model == "script":
        (tmp_path / "script.py").write_text(SCRIPT)
        model = f"{tmp_path / 'script.py'}:act"
    ours = own_successes(run_cli, model=model, tasks=TASKS, data=data, out=tmp_path / "ours")
    theirs = evaluate(PolicyServer(load(model, {}, 0), frames, dtype))
    assert set(ours.values()) == {True, False}
    assert successes(theirs) == ours
    for name, episode in theirs.items():
        assert episode["steps"] <= MAX_STEPS
        assert episode["metrics"]["reward"] == 2.0 * ours[name]


def test_the_planner_through_calls_is_the_bound_that_it_is_through_our_own_command(
    data, tmp_path, run_cli, evaluate
):
    from tests.harness.vla_eval_servers import PlannerServer

    ours = own_successes(run_cli, model="planner-arm", tasks=TASKS, data=data, out=tmp_path / "o")
    assert successes(evaluate(PlannerServer(), calls=True)) == ours


def test_a_server_asks_for_the_wrist_and_the_hand_and_is_shown_them(data, frames, evaluate):
    from tests.harness.vla_eval_servers import PolicyServer

    wants = ("send_wrist_image", "send_state")
    server = PolicyServer(load("openvla-tiny", {}, 0), frames, wants=wants)
    evaluate(server, limit=1)
    seen = server.shown[0]
    assert {name: image.shape for name, image in seen["images"].items()} == {
        "agentview": (64, 64, 3),
        "wrist": (64, 64, 3),
    }
    assert next(iter(seen["images"])) == "agentview"
    assert seen["states"].shape == (8,)
    assert (seen["states"] == seen["state"]).all()
    assert (seen["states"][-2:] == 1).all()  # nothing is held before a pick-up


@pytest.mark.parametrize(
    ("action", "said"),
    [
        ({"actions": np.zeros((2, 7))}, "not seven finite numbers"),
        ({"actions": np.full(7, np.nan)}, "not seven finite numbers"),
        ({"calls": [{"action": "Pass"}]}, "set calls: true among params"),
    ],
)
def test_another_action_fails_its_episode_alone(action, said, evaluate):
    from tests.harness.vla_eval_servers import SameServer

    episodes = evaluate(SameServer(action), limit=2)
    assert len(episodes) == 4
    for episode in episodes.values():
        assert episode["failure_reason"] == "env_step"
        assert said in episode["failure_detail"]


def test_an_episode_that_cannot_begin_or_loses_its_simulator_fails_alone(monkeypatch, evaluate):
    from tests.harness.vla_eval_servers import SameServer

    lose_two_episodes(monkeypatch)
    episodes = evaluate(SameServer({"actions": np.zeros(7)}), limit=2)
    failed = {it["failure_reason"]: it for it in episodes.values() if "failure_reason" in it}
    assert set(failed) == {"env_start", "env_step"}
    assert "cannot be brought" in failed["env_start"]["failure_detail"]
    assert "the simulator is lost" in failed["env_step"]["failure_detail"]
    assert sum("failure_reason" in it for it in episodes.values()) == 2
    assert len(episodes) == 4


def test_the_specs_say_what_the_numbers_are(data):
    from infthor_eval.harness.vla_eval import InfthorArm

    arm = InfthorArm(TASKS, str(data), cameras="front,wrist", state=True, translation_scale=0.1)
    action, seen = arm.get_action_spec(), arm.get_observation_spec()
    assert {name: spec.format for name, spec in action.items()} == {
        "position": "delta_xyz",
        "rotation": "euler_xyz",
        "gripper": "binary_close_positive",
    }
    assert action["position"].description == "1 is 0.1 m"
    assert set(seen) == {"image", "language", "wrist", "state"}
    assert arm.get_metadata()["max_steps"] == MAX_STEPS
    names = [task["name"] for task in arm.get_tasks()]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize(
    ("params", "said"),
    [
        ({"task": "nieh_mini"}, "is no task of an arm"),
        ({"task": "manipulathor_mimi"}, "did you mean 'manipulathor_mini'"),
        ({"limit": 0}, "limit must be at least 1"),
        ({"cameras": "back"}, "cameras"),
        ({"rotation_scale": 0}, "rotation_scale must be above 0"),
    ],
)
def test_a_bad_value_is_refused_in_a_line(params, said):
    from infthor_eval.harness.vla_eval import InfthorArm

    with pytest.raises(UsageError, match=said):
        InfthorArm(**params)


def test_neither_torch_nor_transformers_is_imported(start):
    path = [path for path in sys.path if "vla-eval" in path]
    start(
        f"import sys; sys.path += {path!r}; import infthor_eval.harness.vla_eval\n"
        "assert not {'torch', 'transformers'} & set(sys.modules)"
    )
