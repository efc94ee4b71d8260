"""Servers of vla-eval's protocol that lie: each fails its episode in one line, and no other."""

import socket
import threading
import time
from dataclasses import replace

import msgpack
import numpy as np
import pytest
from PIL import Image

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef

from .conftest import refusal, run

GOOD = [1.0, 0, 0, 0, 0, 0, 1]
HELLO = {"harness_version": "0", "protocol_version": 1, "model_server": "Liar"}


class Server:
    """One connection's messages, as the package's own functions make them."""

    def __init__(self, connection):
        from vla_eval.protocol import (
            Message,
            MessageType,
            pack_message,
            unpack_message,
        )

        self._connection, self._start = connection, 0
        self._pack = lambda kind, payload, seq: pack_message(
            Message(MessageType(kind), payload, seq)
        )
        self._unpack = unpack_message

    def send(self, kind, payload, seq):
        self._connection.send(self._pack(kind, payload, seq))

    def serve(self, lie=None, hello=HELLO):
        """Answer; `lie` gets this, the connection, the observation's number and the start's."""
        for content in self._connection:
            message = self._unpack(content)
            if message.type == "hello":
                self.send("hello", hello, message.seq)
            elif message.type == "episode_start":
                self._start = message.seq
            elif message.type == "observation" and lie is not None:
                lie(self, self._connection, message.seq, self._start)
            elif message.type == "observation":
                self.send("action", {"actions": GOOD}, message.seq)


@pytest.fixture
def liar(websocket_server):
    """Starts a server that lies on its first connection."""
    return lambda lie: websocket_server(
        lambda connection, number: Server(connection).serve(lie if number == 1 else None)
    )


def answering(payload, kind="action"):
    return lambda server, _, seq, __: server.send(kind, payload, seq)


def start_fails_late(server, _, seq, start):
    server.send("error", {"error": "episode_start_failed: no such task"}, start)
    server.send("action", {"actions": GOOD}, seq)


def no_map(server, connection, seq, _):
    connection.send(msgpack.packb({"type": "action", "payload": [1], "seq": seq, "timestamp": 0}))


LIES = {
    "wrong shape": (
        answering({"actions": [0.0] * 6}),
        "gives actions of shape [1, 6], not rows of 7",
    ),
    "nan": (answering({"actions": [float("nan")] * 7}), "gives an action that is not finite"),
    "infinite": (
        answering({"actions": np.full((2, 7), np.inf)}),
        "gives an action that is not finite",
    ),
    "words": (answering({"actions": ["left"] * 7}), "answers without actions of numbers"),
    "no actions": (answering({"action": GOOD}), "answers without actions (action)"),
    "nothing": (answering({}), "answers without actions (nothing)"),
    "another type": (answering({}, "hello"), "answers OBSERVATION with HELLO"),
    "an error": (answering({"error": "a\nb"}, "error"), "fails: a\\nb"),
    "start fails late": (start_fails_late, "fails: episode_start_failed: no such task"),
    "no map": (no_map, "sends no message of its protocol (a payload of list)"),
    "not msgpack": (lambda _, it, *__: it.send(b"\xc1"), "sends no message of its protocol"),
    "text": (lambda _, it, *__: it.send("a\nhello"), "answers with the text 'hello'"),
    "closes": (lambda _, it, *__: it.close(1011, "out"), "ends the connection (received 1011"),
    "breaks off": (lambda _, it, *__: it.socket.shutdown(2), "ends the connection (no close"),
    "too long": (lambda _, it, *__: it.send(b"0" * 20_000_000), "ends the connection (sent 1009"),
}


@pytest.mark.parametrize("lie", LIES)
def test_a_lie_fails_its_episode_alone_in_one_line(lie, liar, connect, shot):
    url = liar(LIES[lie][0])
    policy = connect("vla-eval", url)
    said = refusal(run, policy, [shot])
    assert f"vla-eval ({url}) {LIES[lie][1]}" in said
    for _ in range(2):
        ((step,),) = run(policy, [shot])
        assert step.translation == pytest.approx((0.05, 0, 0))


def test_the_error_of_a_start_that_comes_with_a_later_answer_fails_it(liar, connect, shot):
    def lie(server, _, seq, start):
        server.send("action", {"actions": GOOD}, seq)
        server.send("error", {"error": "late"}, start)

    policy = connect("vla-eval", liar(lie))
    assert "fails: late" in refusal(run, policy, [shot, shot])


def test_an_answer_to_another_request_is_left_out(liar, connect, shot):
    def lie(server, _, seq, start):
        for other in (0, seq - 1, seq + 1, None, "x"):
            server.send("action", {"actions": [9.0] * 7}, other)
        server.send("error", {"error": "of another"}, seq + 7)
        server.send("action", {"actions": GOOD}, seq)
        server.send("action", {"actions": [9.0] * 7}, seq)  # a second one is nobody's

    policy = connect("vla-eval", liar(lie))
    for (step,) in run(policy, [shot] * 3):
        assert step.translation == pytest.approx((0.05, 0, 0))


@pytest.mark.parametrize("meanwhile", ["nothing", "answers to others"])
def test_a_late_answer_is_not_waited_for_nor_taken_for_the_next(meanwhile, liar, connect, shot):
    done = threading.Event()

    def lie(server, _, seq, start):
        while not done.wait(0.05):
            if meanwhile != "nothing":
                server.send("action", {"actions": [9.0] * 7}, seq - 1)
        server.send("action", {"actions": [9.0] * 7}, seq)

    policy = connect("vla-eval", liar(lie), timeout_s=0.4)
    began = time.monotonic()
    said = refusal(run, policy, [shot])
    assert "does not answer within 0.4 s; raise timeout_s" in said
    assert time.monotonic() - began < 10
    done.set()
    ((step,),) = run(policy, [shot])
    assert step.translation == pytest.approx((0.05, 0, 0))


@pytest.mark.parametrize("is_main", [True, False])
def test_a_server_that_reads_nothing_is_not_waited_for(
    is_main, websocket_server, connect, shot, tmp_path
):
    done = threading.Event()

    def deaf(connection, number):
        connection.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        server = Server(connection)
        server.send("hello", HELLO, 1)
        connection.recv_flow_control.acquire()
        done.wait()
        connection.recv_flow_control.release()

    policy = connect("vla-eval", websocket_server(deaf), timeout_s=0.4)
    (session,) = policy._sessions.values()
    session._socket.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
    noise = np.random.default_rng(0).integers(0, 256, (1000, 1000, 3), dtype=np.uint8)
    Image.fromarray(noise).save(tmp_path / "noise.png")
    large = replace(shot, image=FrameRef(tmp_path / "noise.png"))
    said = []

    def act():
        policy._sessions[threading.get_ident()] = session
        said.append(refusal(run, policy, [large]))

    thread = threading.Thread(target=act)
    if is_main:
        act()
    else:
        thread.start()
        thread.join()
    done.set()
    assert "does not answer within 0.4 s" in said[0]


@pytest.mark.parametrize(
    ("hello", "message"),
    [
        ({}, "greets unlike a server of vla-eval (Object missing required field"),
        (HELLO | {"protocol_version": 2}, "version 2 of the protocol, not 1"),
        (HELLO | {"action_spec": {"position": 3}}, "greets unlike a server of vla-eval"),
        (HELLO | {"observation_params": {"a": np.zeros(3)}}, "greets unlike a server of vla-eval"),
    ],
)
def test_another_greeting_is_refused(hello, message, websocket_server, connect):
    url = websocket_server(lambda connection, _: Server(connection).serve(hello=hello))
    assert message in refusal(connect, "vla-eval", url)


def test_a_missing_greeting_is_refused(websocket_server, connect):
    def silent(connection, _):
        connection.recv()
        connection.recv()

    def forward(connection, _):
        connection.recv()
        Server(connection).send("action", {"actions": GOOD}, 1)

    said = refusal(connect, "vla-eval", websocket_server(silent), timeout_s=0.3)
    assert "does not answer within 0.3 s" in said
    said = refusal(connect, "vla-eval", websocket_server(forward))
    assert "answers HELLO with ACTION" in said


def test_another_server_at_the_address_is_refused(websocket_server, connect, shot):
    def changing(connection, number):
        hello = HELLO | {"model_server": f"Liar{number}"}
        Server(connection).serve(answering({}) if number == 1 else None, hello)

    policy = connect("vla-eval", websocket_server(changing))
    refusal(run, policy, [shot])
    assert "says that it is another policy now; begin a new run" in refusal(run, policy, [shot])
    assert not policy._sessions


def test_a_server_that_is_not_there_is_one_line(connect, websocket_server):
    said = refusal(connect, "vla-eval", "ws://127.0.0.1:1", retries=2)
    assert said.startswith("vla-eval (ws://127.0.0.1:1) cannot be reached in 3 attempts (")
    assert said.endswith("is the server up?")


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"url": "http://localhost:1"}, r"url is not the address of a server; write ws://"),
        ({"url": "ws://me:secret@host"}, "url holds a password"),
        ({"translation_scale": "0"}, "translation_scale=0: give a number of metres above 0"),
        ({"gripper": "raw"}, "gripper=raw: give one of binary_close_positive"),
        ({"state_format": "joints"}, "state_format=joints: give one of eef_pos3_euler3"),
        ({"max_in_flight": "0"}, "max_in_flight=0"),
    ],
)
def test_misuse_is_refused(settings, message, connect):
    with pytest.raises(UsageError, match=message) as caught:
        connect("vla-eval", **{"url": "ws://127.0.0.1:1"} | settings)
    assert "secret" not in str(caught.value)
