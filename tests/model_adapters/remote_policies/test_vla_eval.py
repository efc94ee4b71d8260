"""The client of vla-eval's model servers, against these servers themselves."""

import threading
import time
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from model_adapters import ContractError, check_adapter

from .conftest import refusal, run

ACTION = np.array([1, 0, 0, 0, 0, 0, -1], dtype=np.float32)  # 5 cm ahead, open


@pytest.fixture
def serve(vla_eval):
    """Starts a server of the package whose actions a function gives; keeps what it is told."""
    from vla_eval.model_servers import PredictModelServer

    handles = []

    class Server(PredictModelServer):
        def __init__(self, answer, *, actions=None, observations=None, params=None, **settings):
            super().__init__(**settings)
            self.told, self.seen, self.n_seen = [], [], Counter()
            self.get_observation_params = lambda: params or {}
            if actions is not None:
                self.get_action_spec = lambda: actions
                self.get_observation_spec = lambda: observations or {}
            self._answer = answer

        def kinds(self, n_told):
            """What it is told in the end: nobody waits for it."""
            while len(self.told) < n_told:
                time.sleep(0.001)
            return sorted(kind for kind, _ in self.told)

        def predict(self, obs, ctx):
            self.seen.append(obs)
            self.n_seen[ctx.session_id] += 1
            return {"actions": self._answer(self, obs, ctx)}

        async def on_episode_start(self, config, ctx):
            await super().on_episode_start(config, ctx)
            self.told.append(("start", config))
            if "forbidden" in config["task"]["task_description"]:
                raise ValueError("not this task")

        async def on_episode_end(self, result, ctx):
            self.told.append(("end", result))
            await super().on_episode_end(result, ctx)

    def start(answer=lambda *_: ACTION, port=0, **settings):
        server = Server(answer, **settings)
        handles.append(vla_eval.serve_background(server, port=port))
        server.handle = handles[-1]
        return server, handles[-1].url

    yield start
    for handle in handles:
        handle.close()


def test_a_server_is_told_of_episodes_and_shown_what_is_seen(serve, connect, shot):
    server, url = serve()
    policy = connect("vla-eval", url)
    ((step,), (again,)) = run(policy, [shot, replace(shot, step=1)], name="a/b")
    assert step == again
    assert step.translation == pytest.approx((0.05, 0, 0))
    assert step.gripper == 1
    run(policy, [replace(shot, wrist=None, state=None)], "put it down")
    server.kinds(4)
    starts = [told for kind, told in server.told if kind == "start"]
    tasks = [told["task"] for told in starts]
    assert tasks[0] == {"name": "a/b", "task_description": "pick up the mug", "max_steps": 10}
    assert (tasks[1]["task_description"], starts[0]["mode"]) == ("put it down", "sync")
    (_, ended) = server.told[1]
    assert (ended["metrics"], ended["steps"]) == ({"success": True}, 2)
    assert 0 < ended["elapsed_sec"] < 60
    seen, _, bare = server.seen
    assert list(seen["images"]) == ["agentview", "wrist"]
    for ref, image in zip((shot.image, shot.wrist), seen["images"].values(), strict=True):
        assert np.array_equal(image, np.asarray(ref.load()))
    np.testing.assert_allclose(seen["states"], [0.4, -0.1, 0.3, 0.1, 0.2, 0.3, 1, 1], rtol=1e-6)
    assert np.array_equal(seen["state"], seen["states"])
    assert seen["task_description"] == "pick up the mug"
    assert bare.keys() == {"images", "task_description"}
    assert list(bare["images"]) == ["agentview"]


def test_a_chunk_is_taken_whole_in_part_or_from_the_server_step_by_step(serve, connect, shot):
    chunk = np.arange(4)[:, None] * ACTION
    server, url = serve(lambda *_: chunk)
    assert [len(chunk) for chunk in run(connect("vla-eval", url), [shot])] == [4]
    assert [len(chunk) for chunk in run(connect("vla-eval", url, execute=3), [shot])] == [3]
    server, url = serve(lambda *_: chunk, chunk_size=4)
    steps = run(connect("vla-eval", url), [shot] * 5)
    assert [step.translation[0] for (step,) in steps] == pytest.approx([0, 0.05, 0.1, 0.15, 0])
    assert len(server.seen) == 2


def test_episodes_at_once_are_kept_apart(serve, connect, shot):
    together = threading.Barrier(2, timeout=60)

    def count(server, obs, ctx):
        return ACTION * server.n_seen[ctx.session_id] * (1 + obs["task_description"].count("!"))

    server, url = serve(count)
    policy = connect("vla-eval", url, max_in_flight=2)
    assert policy.capabilities.max_in_flight == 2
    found = {}

    def drive(instruction):
        from model_adapters import Episode

        together.wait()
        policy.begin(Episode(instruction, instruction, 3))
        steps = []
        for _ in range(3):
            together.wait()
            steps.append(policy.act(shot)[0].translation[0] / 0.05)
        policy.end(success=False)
        found[instruction] = steps

    threads = [threading.Thread(target=drive, args=(text,)) for text in ("one", "two!")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found["one"] == pytest.approx([1, 2, 3])
    assert found["two!"] == pytest.approx([2, 4, 6])
    assert len(server.n_seen) == 2


def test_what_an_episode_leaves_behind_is_found(serve, connect):
    def leaking(server, obs, ctx):
        return ACTION * sum(server.n_seen.values())

    def clean(server, obs, ctx):
        return ACTION * (ctx.step + 1) * obs["images"]["agentview"].mean() / 255

    for answer, is_clean in ((clean, True), (leaking, False)):
        _, url = serve(answer)
        policy = connect("vla-eval", url, deterministic=True)
        assert policy.capabilities.deterministic
        if is_clean:
            check_adapter(policy)
        else:
            with pytest.raises(ContractError, match="the same episode again"):
                check_adapter(policy)
        check_adapter(connect("vla-eval", url))  # nothing is said of it then


def test_the_identity_is_what_the_server_says_and_how_it_is_read(serve, connect, vla_eval):
    from vla_eval import specs

    actions = {
        "position": specs.POSITION_DELTA,
        "rotation": specs.ROTATION_AA,
        "gripper": specs.GRIPPER_CLOSE_POS,
    }
    _, url = serve(actions=actions)
    identity = connect("vla-eval", url, translation_scale=0.1).identity()
    said = identity["server"]
    assert (said["model_server"], said["harness_version"]) == ("Server", vla_eval.__version__)
    assert said["action_spec"]["rotation"] == {"format": "axis_angle", "range": [-3.15, 3.15]}
    assert identity["url"] == url
    assert identity["actions"] == {
        "metres": 0.1,
        "rotation": "axis_angle",
        "radians": 1.0,
        "gripper": "binary_close_positive",
        "padded": False,
    }
    assert "timeout_s" not in identity


@pytest.mark.parametrize(
    ("form", "options", "expected"),
    [
        ("STATE_EEF_POS_QUAT_GRIP", {}, 1),
        ("STATE_EEF_POS_AA_GRIP", {}, 2),
        ("STATE_EEF_POS_EULER_GRIP", {}, 2),
        ("STATE_JOINT", {"state_format": "eef_pos3_quat4_gripper1"}, 1),
    ],
)
def test_the_hand_is_written_as_the_server_declares(
    form, options, expected, serve, connect, shot, vla_eval
):
    from vla_eval import specs

    wanted = {"image": specs.IMAGE_RGB, "state": getattr(specs, form), "language": specs.LANGUAGE}
    server, url = serve(actions={"actions": specs.RAW}, observations=wanted)
    policy = connect("vla-eval", url, **options)
    run(policy, [shot])
    assert (server.seen[0]["states"][3:] == 1).sum() == expected
    bare = replace(shot, state=None, wrist=None)
    assert refusal(run, policy, [bare]).endswith("needs more than is given; add --state")


@pytest.mark.parametrize(
    ("observations", "params"),
    [
        ({"image": "rgb_hwc_uint8", "wrist_image": "rgb_hwc_uint8"}, {}),
        ({"image": "rgb_hwc_uint8", "second": "rgb_hwc_uint8"}, {}),
        ({}, {"send_wrist_image": True}),
    ],
)
def test_a_view_from_the_wrist_that_is_missing_is_named(
    observations, params, serve, connect, shot, vla_eval
):
    from vla_eval import specs

    wanted = {key: specs.DimSpec(key, 0, form) for key, form in observations.items()}
    _, url = serve(actions={"actions": specs.RAW}, observations=wanted, params=params)
    policy = connect("vla-eval", url)
    said = refusal(run, policy, [replace(shot, wrist=None)])
    assert said.endswith("needs more than is given; add --cameras front,wrist")
    assert len(run(policy, [shot])) == 1


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (("joints", 8, "joint_positions"), r"needs joints \(joint_positions\); it can be given"),
        (("state", 20, "eef_rot6d_20d"), "needs the hand's state as eef_rot6d_20d"),
        (("left", 0, "rgb_hwc_uint8"), "needs left; it can be given two images and a state"),
    ],
)
def test_a_server_that_needs_more_than_an_arm_has_is_refused(
    part, message, serve, connect, vla_eval
):
    from vla_eval import specs

    wanted = {"image": specs.IMAGE_RGB, "wrist": specs.IMAGE_RGB, part[0]: specs.DimSpec(*part)}
    _, url = serve(actions={"actions": specs.RAW}, observations=wanted)
    with pytest.raises(Exception, match=message):
        connect("vla-eval", url)


@pytest.mark.parametrize(
    "given",
    [
        {"position": "POSITION_ABSOLUTE", "rotation": "ROTATION_EULER", "gripper": "GRIPPER_01"},
        {"position": "POSITION_DELTA", "rotation": "ROTATION_AA", "gripper": "GRIPPER_RAW"},
        {"position": "POSITION_DELTA", "rotation": "RAW", "gripper": "GRIPPER_01"},
        {"joints": "STATE_JOINT"},
        {"position": "POSITION_DELTA", "rotation": "ROTATION_AA", "gripper": "GRIPPER_01",
         "base_motion": "BASE_MOTION"},
    ],
)  # fmt: skip
def test_actions_that_are_not_run_here_are_refused_before_an_episode(
    given, serve, connect, vla_eval
):
    from vla_eval import specs

    server, url = serve(actions={key: getattr(specs, name) for key, name in given.items()})
    assert f"vla-eval ({url}) declares" in refusal(connect, "vla-eval", url)
    assert server.told == []


def test_a_start_that_the_server_refuses_fails_the_episode(serve, connect, shot):
    _, url = serve()
    policy = connect("vla-eval", url)
    said = refusal(run, policy, [shot], "something forbidden")
    assert "fails: episode_start_failed: ValueError: not this task" in said
    assert run(policy, [shot])


def test_an_error_of_the_server_fails_the_episode_alone(serve, connect, shot):
    def fail_once(server, obs, ctx):
        if len(server.seen) == 2:
            raise RuntimeError("CUDA out\nof memory")
        return ACTION

    server, url = serve(fail_once)
    policy = connect("vla-eval", url)
    said = refusal(run, policy, [shot, shot])
    assert "fails: observation_failed: RuntimeError: CUDA out" in said
    assert "no episode goes on" in refusal(policy.act, shot)
    assert "no episode goes on" in refusal(policy.end, success=True)
    assert run(policy, [shot])
    assert server.kinds(4) == ["end", "end", "start", "start"]  # one by each connection
    assert ("end", {}) in server.told  # as the server is told where a connection is lost


def test_a_server_that_was_started_again_is_connected_again(serve, connect, shot):
    server, url = serve()
    policy = connect("vla-eval", url)
    run(policy, [shot])
    server.handle.close()
    again, _ = serve(port=server.handle.port)
    assert run(policy, [shot])
    assert again.kinds(2) == ["end", "start"]
    assert len(policy._sessions) == 1


def test_without_the_package_it_says_what_to_install(connect, monkeypatch, vla_eval):
    import sys

    monkeypatch.setitem(sys.modules, "vla_eval.protocol.messages", None)
    said = refusal(connect, "vla-eval", "ws://127.0.0.1:1")
    assert said.startswith("vla-eval lacks a package (")
    assert said.endswith("pip install 'infthor-eval[vla]'")
