"""The client against servers that answer, and that fail."""

import base64
import json
import socket
import struct
import threading
from contextlib import suppress

import numpy as np
import pytest

from infthor_eval.errors import DataError, ModelError, UsageError
from infthor_eval.formats.frames import FrameRef
from model_adapters import ArmObservation, Episode, check_adapter, load, with_episodes
from model_adapters.policies.http import adapter
from model_adapters.policies.http.adapter import decode_numbers, encode_array

from ..servers import policy_answers, read_image, send, serve

ACTION = [0.1, 0.2, 0.3, -0.1, -0.2, -0.3, 1.0]


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    """No waiting between attempts."""
    monkeypatch.setattr(adapter, "_FIRST_WAIT_S", 0.001)


def _act(url, frame, **settings):
    policy = load("vla-http", {"url": url, "timeout_s": "600", **settings}, 0)
    return policy.act(frame, "pick up the mug")


def _refused(answer, frame, **settings):
    with serve(answer) as url, pytest.raises(ModelError) as caught:
        _act(url, frame, **settings)
    assert f"{url}/act" in str(caught.value)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("image", ["json_numpy", "list"])
@pytest.mark.parametrize("ending", ["", "/", "/act"])
def test_a_frame_and_an_instruction_are_sent_and_an_action_comes_back(image, ending, plain_frames):
    requests = []

    def answer(request, _handler):
        requests.append(request)
        return ACTION

    with serve(answer) as url:
        (step,) = _act(url + ending, plain_frames[1], image=image, unnorm_key="bridge_orig")
    assert (step.translation, step.rotation, step.gripper) == (
        (0.1, 0.2, 0.3),
        (-0.1, -0.2, -0.3),
        1.0,
    )
    (request,) = requests
    assert request.keys() == {"image", "instruction", "unnorm_key"}
    assert (request["instruction"], request["unnorm_key"]) == ("pick up the mug", "bridge_orig")
    seen = read_image(request)
    assert (seen.shape, seen.dtype, np.unique(seen).tolist()) == ((300, 300, 3), np.uint8, [255])


class _Rooms:
    """A server of episodes: `/act` answers with the frames since the last `/reset`."""

    def __init__(self, *, has_reset=True):
        self.instructions, self.n_frames = [], 0
        self._has_reset = has_reset

    def __call__(self, request, handler):
        if handler.path == "/reset" and self._has_reset:
            self.n_frames = 0
            self.instructions.append(request["instruction"])
            send(handler, 200, b"")  # whatever it answers is no matter
        elif handler.path == "/act":
            self.n_frames += 1
            return [self.n_frames / 100, *ACTION[1:]]
        else:
            handler.send_error(404)
        return None


def _episodes(url, frames, **settings):
    """First numbers of the steps of two episodes, each of all frames."""
    policy = with_episodes(load("vla-http", {"url": url, **settings}, 0))
    firsts = []
    for instruction in ("pick up the mug", "put it down"):
        policy.begin(Episode("e", instruction, len(frames)))
        firsts += [policy.act(ArmObservation(frame))[0].translation[0] for frame in frames]
        policy.end(success=False)
    return firsts


def test_a_server_is_told_of_episodes_if_it_has_an_address_for_it(plain_frames):
    rooms = _Rooms()
    with serve(rooms, path=None) as url:
        assert _episodes(f"{url}/act", plain_frames, reset="/reset") == [0.01, 0.02, 0.01, 0.02]
        assert rooms.instructions == ["pick up the mug", "put it down"]
        assert _episodes(url, plain_frames) == [0.03, 0.04, 0.05, 0.06]  # of its own accord: none
    policy = load("vla-http", {"url": "http://host/base/", "reset": "/new/start"}, 0)
    assert policy.identity()["reset"] == "/new/start"


def test_a_server_without_that_address_is_one_line(plain_frames):
    rooms = _Rooms(has_reset=False)
    with serve(rooms, path=None) as url, pytest.raises(ModelError) as caught:
        _episodes(url, plain_frames, reset="/reset")
    assert f"{url}/reset answers 404 Not Found" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_without_a_key_none_is_sent(plain_frames):
    requests = []
    with serve(lambda request, _: requests.append(request) or ACTION) as url:
        _act(url, plain_frames[0])
    assert "unnorm_key" not in requests[0]


def test_chunks_are_taken_and_cut(plain_frames):
    with serve(lambda *_: [ACTION] * 4) as url:
        assert len(_act(url, plain_frames[0])) == 4
        assert len(_act(url, plain_frames[0], execute="2")) == 2


def test_a_policy_behind_a_server_acts_as_it_does_here(policies, plain_frames):
    with serve(policy_answers(policies["openvla"])) as url:
        policy = load("vla-http", {"url": url}, 0)
        check_adapter(policy)
        assert policy.act(plain_frames[1], "close the fridge") == policies["openvla"].act(
            plain_frames[1], "close the fridge"
        )


@pytest.mark.parametrize(
    ("reply", "message"),
    [
        (ACTION[:6], r"gave actions of shape [1, 6], not one or more of 7 numbers"),
        ([], "gave actions of shape [1, 0]"),
        ([[]], "gave actions of shape [1, 0]"),
        ([[ACTION]], "gave actions of shape [1, 1, 7]"),
        ([*ACTION[:6], float("nan")], "not finite"),
        ([float("inf"), *ACTION[1:]], "not finite"),
        ("error", "answers without an action of numbers: the text 'error'"),
        ({"detail": "no such key"}, "answers without an action of numbers"),
        ([10**400, *ACTION[1:]], "answers without an action of numbers"),
    ],
)
def test_a_reply_that_is_no_action_is_refused(reply, message, plain_frames):
    assert message in _refused(lambda *_: reply, plain_frames[0])


def test_an_error_of_the_server_is_told_and_not_tried_again(plain_frames):
    n_asked = 0

    def answer(_request, handler):
        nonlocal n_asked
        n_asked += 1
        send(handler, 500, b"CUDA out\nof memory")

    assert "answers 500 Internal Server Error: 'CUDA out of memory'" in _refused(
        answer, plain_frames[0]
    )
    assert n_asked == 1


def test_what_is_no_json_is_refused(plain_frames):
    message = _refused(
        lambda _, handler: send(handler, 200, b"<html>hello</html>"), plain_frames[0]
    )
    assert "answers with something that is not JSON: '<html>hello</html>'" in message


def test_a_redirect_is_not_followed(plain_frames):
    def answer(_request, handler):
        handler.send_response(302)
        handler.send_header("Location", "http://127.0.0.1:1/elsewhere")
        handler.send_header("Content-Length", "0")
        handler.end_headers()

    assert "answers 302" in _refused(answer, plain_frames[0])


_SLOW_PIECES = {
    "before it answers": b"",
    "in its head": b"X-More: 1\r\n",
    "in a line of its head": b"x",
    "with 100 Continue": b"HTTP/1.1 100 Continue\r\n\r\n",
    "while it answers": b"0.1,",
    "while it says what is wrong": b" ",
}


@pytest.mark.parametrize("slow", _SLOW_PIECES)
def test_a_server_that_takes_too_long_is_not_waited_for(slow, plain_frames):
    done = threading.Event()

    def answer(_request, handler):
        if slow.startswith("while"):
            send(handler, 500 if "wrong" in slow else 200, b"[0.1,", length=10_000)
        elif slow.startswith("in"):
            handler.wfile.write(b"HTTP/1.1 200 OK\r\n")
        while not done.wait(0.05):
            with suppress(OSError):  # the client has gone
                handler.wfile.write(_SLOW_PIECES[slow])

    try:
        message = _refused(answer, plain_frames[0], timeout_s="0.3")
    finally:
        done.set()
    assert "does not answer within 0.3 s; raise timeout_s" in message


@pytest.mark.parametrize(
    "fail",
    [
        lambda handler: handler.connection.shutdown(socket.SHUT_RDWR),
        lambda handler: send(handler, 200, b"[0.1, ", length=100),
    ],
    ids=["closed", "cut off"],
)
def test_a_lost_connection_is_tried_again(fail, plain_frames):
    n_asked = 0

    def answer(_request, handler):
        nonlocal n_asked
        n_asked += 1
        if n_asked < 3:
            handler.close_connection = True
            fail(handler)
            return None
        return ACTION

    with serve(answer) as url:
        assert _act(url, plain_frames[0], retries="2")
        assert n_asked == 3
        n_asked = 0
        with pytest.raises(
            ModelError, match=r"/act cannot be reached in 2 attempts .*; is the server up\?"
        ):
            _act(url, plain_frames[0], retries="1")


def test_a_server_that_is_not_there_is_one_line(plain_frames):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(ModelError, match=f"{url}/act cannot be reached in 4 attempts"):
            _act(url, plain_frames[0])


def test_a_reply_without_end_is_not_read(monkeypatch, plain_frames):
    monkeypatch.setattr(adapter, "_LARGEST", 1000)
    message = _refused(
        lambda _, handler: send(handler, 200, b"[" + b"0.1," * 5000), plain_frames[0]
    )
    assert "answers more than 1000 bytes" in message


def test_a_frame_that_is_not_there_is_a_fault_of_the_data(plain_frames):
    with pytest.raises(DataError):
        _act("http://127.0.0.1:1", FrameRef(plain_frames[0].path.with_name("none.png")))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"url": "localhost:8000"}, "url is not the address of a server"),
        ({"url": "file:///etc/passwd"}, "url is not the address of a server"),
        ({"url": "http://me:secret"}, "url is not the address of a server"),
        ({"url": "http://[::1"}, "url is not the address of a server"),
        ({"url": "http://me:secret@host"}, "url holds a password"),
        ({"url": "http://host/?token=secret"}, "url holds a password, a query"),
        ({"image": "png"}, "image=png: give json_numpy or list"),
        ({"timeout_s": "0"}, "timeout_s=0: give a number above 0"),
        ({"retries": "11"}, "retries=11: give a whole number from 0, at most 10"),
        ({"execute": "0"}, "execute=0"),
        ({"reset": "reset"}, "reset is no path without a query; write /reset"),
        ({"reset": "/reset?token=secret"}, "is no path"),
    ],
)
def test_misuse_is_refused_and_no_secret_told(settings, message):
    with pytest.raises(UsageError, match=message) as caught:
        load("vla-http", settings, 0)
    assert "secret" not in str(caught.value)


def test_the_identity_is_how_it_is_asked():
    policy = load("vla-http", {"url": "https://host:1/base", "unnorm_key": "b"}, 0)
    assert policy.identity() == {
        "adapter": "vla-http",
        "url": "https://host:1/base/act",
        "unnorm_key": "b",
        "image": "json_numpy",
        "execute": None,
    }
    assert not policy.capabilities.deterministic


def test_an_array_is_its_bytes_its_type_and_its_shape():
    assert encode_array(np.array([[1, 2, 255]], dtype=np.uint8)) == {
        "__numpy__": "AQL/",
        "dtype": "|u1",
        "shape": [1, 3],
    }


def test_an_array_that_is_a_view_is_written_in_its_own_order():
    turned = np.array([[1, 2], [3, 4]], dtype=np.uint8).T
    assert base64.b64decode(encode_array(turned)["__numpy__"]) == bytes([1, 3, 2, 4])


NUMBERS = [0.5, -1.0, 2.0]
ARRAY = {
    "__numpy__": base64.b64encode(struct.pack("<3d", *NUMBERS)).decode(),
    "dtype": "<f8",
    "shape": [3],
}


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (NUMBERS, NUMBERS),
        ([1, 2], [1.0, 2.0]),
        ([NUMBERS, NUMBERS], [NUMBERS, NUMBERS]),
        (ARRAY, NUMBERS),
        ([ARRAY, NUMBERS], [NUMBERS, NUMBERS]),
        (json.dumps(ARRAY), NUMBERS),  # as OpenVLA's server answers a request in encoded form
        (encode_array(np.array([[1.5]], dtype=">f4")), [[1.5]]),
    ],
)
def test_numbers_come_in_several_forms(value, expected):
    assert decode_numbers(value).tolist() == expected


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("error", "the text 'error'"),
        ({"action": NUMBERS}, "dict"),
        ([*NUMBERS, "1"], "str '1' among numbers"),
        ([True], "bool"),
        (None, "NoneType"),
        ([NUMBERS, [1.0]], "inhomogeneous"),
        (ARRAY | {"dtype": "|O8"}, "array of object"),
        (ARRAY | {"shape": [4]}, "reshape"),
        (ARRAY | {"__numpy__": "*"}, "damaged array"),
        (ARRAY | {"dtype": "left"}, "damaged array"),
        ({"__numpy__": ARRAY["__numpy__"]}, "damaged array"),
    ],
)
def test_anything_else_is_refused(value, message):
    with pytest.raises(ValueError, match=message):
        decode_numbers(value)
