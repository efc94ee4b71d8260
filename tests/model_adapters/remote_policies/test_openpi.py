"""The client of openpi's server, against a double that speaks its wire."""

import contextlib
import subprocess
import sys
from dataclasses import replace

import msgpack
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from model_adapters import check_adapter
from model_adapters.remote_policies.openpi import pack, unpack
from model_adapters.remote_policies.sessions import DAMAGED

from .conftest import refusal, run

ACTIONS = np.tile(np.array([1, 0, 0, 0, 0, 0, -1], dtype=np.float32), (3, 1))


class Double:
    """Sends metadata, then answers each map with one, as the published server does."""

    def __init__(self, answer=lambda *_: {"actions": ACTIONS}):
        self.requests, self._answer = [], answer

    def __call__(self, connection, number):
        connection.send(pack({"action_horizon": 3, "mean": np.zeros(2)}))
        for content in connection:
            self.requests.append(unpack(content))
            answer = self._answer(self.requests[-1], number)
            connection.send(answer if isinstance(answer, str | bytes) else pack(answer))


def test_a_request_has_what_is_seen_and_the_answer_is_a_chunk(websocket_server, connect, shot):
    double = Double()
    policy = connect("openpi", websocket_server(double))
    ((*steps,),) = run(policy, [shot])
    assert len(steps) == 3
    assert steps[0].translation == pytest.approx((0.05, 0, 0))
    assert steps[0].gripper == 1
    (request,) = double.requests
    assert request.keys() == {
        "observation/image",
        "observation/wrist_image",
        "observation/state",
        "prompt",
    }
    assert np.array_equal(request["observation/image"], np.asarray(shot.image.load()))
    assert request["observation/state"].shape == (8,)
    assert request["prompt"] == "pick up the mug"
    run(policy, [replace(shot, wrist=None, state=None)])
    assert double.requests[-1].keys() == {"observation/image", "prompt"}


def test_keys_and_scales_are_options(websocket_server, connect, shot):
    double = Double(lambda *_: {"actions": np.ones((2, 32), dtype=np.float32), "server_timing": {}})
    options = {
        "image_key": "cam", "wrist_key": "hand", "state_key": "pose", "prompt_key": "task",
        "translation_scale": 1, "gripper": "continuous_01", "padded": "true", "execute": 1,
        "state_format": "eef_pos3_quat4_gripper1",
    }  # fmt: skip
    policy = connect("openpi", websocket_server(double), **options)
    (((step),),) = run(policy, [shot])
    assert (step.translation, step.gripper) == ((1, 1, 1), 1)
    assert double.requests[0].keys() == {"cam", "hand", "pose", "task"}
    identity = policy.identity()
    assert identity["server"]["episodes"] == "none"
    assert (identity["image_key"], identity["actions"]["metres"]) == ("cam", 1.0)


def test_it_keeps_the_contract(websocket_server, connect):
    def look(request, _):
        return {"actions": ACTIONS * request["observation/image"].mean() / 255}

    check_adapter(connect("openpi", websocket_server(Double(look)), deterministic=True))


@pytest.mark.parametrize(
    ("lie", "message"),
    [
        ("Traceback:\n  x\nKeyError: 'observation/state'\n", 'answers with the text "KeyError: '),
        (b"\xc1", "sends no message of its protocol"),
        (msgpack.packb([1]), "sends no message of its protocol (list instead of a map)"),
        (msgpack.packb({b"__ndarray__": True}), "sends no message of its protocol"),
        (
            msgpack.packb({"actions": {b"__ndarray__": True, b"dtype": "|O", b"data": b""}}),
            "(an array of object)",
        ),
        (
            msgpack.packb(
                {"a": {b"__ndarray__": True, b"dtype": "<f4", b"data": b"123", b"shape": [1]}}
            ),
            "sends no message of its protocol",
        ),
        ({"action": ACTIONS}, "answers without actions (action)"),
        ({"actions": ACTIONS[:, :6]}, "actions of shape [3, 6], not rows of 7 numbers"),
        ({"actions": np.ones((3, 32))}, "actions of shape [3, 32]"),
        ({"actions": ACTIONS * np.nan}, "not finite"),
    ],
)
def test_a_lie_fails_its_episode_alone_in_one_line(lie, message, websocket_server, connect, shot):
    double = Double(lambda _, number: lie if number == 1 else {"actions": ACTIONS})
    policy = connect("openpi", websocket_server(double))
    assert message in refusal(run, policy, [shot])
    assert "no episode goes on" in refusal(policy.act, shot)
    assert len(run(policy, [shot])[0]) == 3


def test_a_greeting_that_is_none_is_refused(websocket_server, connect):
    url = websocket_server(lambda connection, _: connection.send("hello") or connection.recv())
    assert "answers with the text 'hello'" in refusal(connect, "openpi", url)
    url = websocket_server(lambda connection, _: connection.recv())
    assert "does not answer within 0.2 s" in refusal(connect, "openpi", url, timeout_s=0.2)


@pytest.mark.parametrize("dtype", ["u1", "<f4", ">f8", "<i8", "?"])
def test_arrays_go_over_the_wire_as_they_are(dtype):
    array = np.arange(6).reshape(2, 3).astype(dtype)
    back = unpack(pack({"a": [array], "b": "text"}))
    assert back["b"] == "text"
    assert (back["a"][0].dtype, back["a"][0].tolist()) == (array.dtype, array.tolist())


MESSAGE = pack({"actions": ACTIONS, "server_timing": {"infer_ms": 1.5}})


@given(at=st.integers(0, len(MESSAGE) - 1), put=st.binary(max_size=3), cut=st.integers(0, 3))
@example(at=MESSAGE.index(b"<f4"), put=b"(1,", cut=3)  # a SyntaxError of numpy
def test_a_damaged_message_is_told_from_others(at, put, cut):
    with contextlib.suppress(DAMAGED):
        unpack(MESSAGE[:at] + put + MESSAGE[at + cut :])


def test_an_array_is_written_with_the_markers_of_the_published_client():
    content = msgpack.unpackb(pack(np.array([[1, 2]], dtype=np.uint8)))
    assert content == {b"__ndarray__": True, b"data": b"\1\2", b"dtype": "|u1", b"shape": [1, 2]}
    number = msgpack.packb({b"__npgeneric__": True, b"data": 1.5, b"dtype": "<f8"})
    assert unpack(number) == 1.5


def test_neither_client_imports_torch():
    code = (
        "import sys, model_adapters.remote_policies.openpi, "
        "model_adapters.remote_policies.vla_eval; print('torch' in sys.modules)"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "False"
