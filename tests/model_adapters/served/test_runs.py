"""Whole runs against a server, as their user types them."""

import logging
import signal
import subprocess
import sys
import threading
import time

import pytest

from ...helpers.command_line import option_words
from ...helpers.journals import read_outcome
from ..policies.servers import send
from .talking import always_say, completion, keep_requests, serve_chat, talkative

KEY = "sk-0123456789abcdef0123456789"


@pytest.fixture
def ask(make_nieh_set, tmp_path, run_cli):
    """Runs `nieh_gt` on five questions."""
    data = make_nieh_set(size=56)

    def ask(url, *options, **model_args):
        settings = {"base_url": url, "model": "m", "retries": 0, **model_args}
        typed = ",".join(f"{name}={value}" for name, value in settings.items())
        arguments = option_words(model="openai", model_args=typed, tasks="nieh_gt", data=data)
        return run_cli(*arguments, "--out", tmp_path / "out", *options)

    return ask


def test_questions_are_answered_and_their_tokens_and_cost_are_in_the_results(ask, tmp_path):
    prices = {"price_per_m_input": 2, "price_per_m_cached": 1, "price_per_m_output": 10}
    with serve_chat(lambda *_: completion("yes", (1000, 10, 200))) as url:
        code, out, err = ask(url, **prices)
    assert code == 0, err
    records, results = read_outcome(tmp_path / "out")
    assert (tmp_path / "out" / "m").is_dir()
    each = (800 * 2 + 200 * 1 + 10 * 10) / 1e6
    assert [record.payload.reply for record in records] == ["yes"] * 5
    assert [record.usage.cost for record in records] == pytest.approx([each] * 5)
    assert results["usage"] == {
        "requests": 5,
        "context": 5000,
        "reply": 50,
        "cost": pytest.approx(5 * each),
    }
    assert (
        "m: 5 requests, 5,000 tokens read (1,000 of them cached, 20.0 %), 50 written, "
        f"{5 * each:.4f} US dollars" in out
    )


def test_a_run_that_reaches_its_cap_goes_on_with_a_higher_one(ask, tmp_path):
    requests = []
    with serve_chat(keep_requests(requests, lambda *_: completion("yes", (95, 5)))) as url:
        code, _, err = ask(url, "--max-tokens-total", 250)
        assert code == 1
        assert "2 sample(s) not asked: 300 tokens reach max_tokens_total=250; raise" in err
        assert len(requests) == 3
        code, _, err = ask(url, "--max-tokens-total", 10_000, max_in_flight=1, timeout_s=90)
        assert code == 0, err
        assert "2 evaluated now, 3 resumed from the journal" in err
        assert len(requests) == 5
    records, results = read_outcome(tmp_path / "out")
    assert [record.failure for record in records] == [None] * 5
    assert results["usage"] == {"requests": 5, "context": 475, "reply": 25, "cost": None}


def test_money_is_capped_likewise(ask):
    requests = []
    with serve_chat(keep_requests(requests, lambda *_: completion("yes", (1000, 0)))) as url:
        code, _, err = ask(url, "--max-cost", 0.0015, price_per_m_input=1, price_per_m_output=1)
    assert code == 1
    assert len(requests) == 2
    assert "not asked: 0.0020 US dollars reach max_cost=0.0015" in err


@pytest.mark.parametrize(
    ("options", "model_args", "message"),
    [
        (
            ("--max-cost", 1),
            {},
            "max_cost needs price_per_m_input and price_per_m_output; give both",
        ),
        (
            ("--max-cost", 1),
            {"max_cost": 2},
            "--max-cost and max_cost= in --model-args are the same option",
        ),
        (("--max-cost", 0), {}, "--max-cost"),
        (("--max-tokens-total", 0), {}, "--max-tokens-total"),
        ((), {"base_url": "http://10.1.2.3/v1"}, "base_url leads to 10.1.2.3 without encryption"),
        ((), {"api_key_env": KEY}, "api_key_env is not the name of an environment variable"),
    ],
)
def test_misuse_is_one_line_before_anything_is_read(options, model_args, message, ask, tmp_path):
    code, out, err = ask("http://127.0.0.1:1/v1", *options, **model_args)
    assert (code, out, len(err.splitlines())) == (2, "", 1)
    assert message in err
    assert KEY not in err
    assert not (tmp_path / "out").exists()


def test_a_cap_is_not_for_models_that_cost_nothing(run_cli, make_nieh_set, tmp_path):
    data = make_nieh_set(size=56)
    arguments = option_words(tasks="nieh_gt", data=data, out=tmp_path / "out", max_cost=1)
    for model in ("qwen2.5-vl-tiny", "oracle"):
        code, _, err = run_cli("--model", model, *arguments)
        assert code == 2
        assert f"{model} has no option max_cost" in err


def test_units_that_fail_are_named_and_the_others_answered(ask, tmp_path):
    def answer(request, handler):
        text = request["messages"][0]["content"][-1]["text"]
        return send(handler, 400, b"no fridge") if "fridge" in text else completion("yes")

    with serve_chat(answer) as url:
        code, _, err = ask(url)
    assert code == 1
    assert "Traceback" not in err
    assert "1 sample(s) failed, in no score: " in err
    records, results = read_outcome(tmp_path / "out")
    (failed,) = [record for record in records if record.failure]
    assert "answers 400 Bad Request: 'no fridge'" in failed.failure
    assert results["usage"]["requests"] == 4


def test_a_survived_fault_stands_in_the_record(ask, tmp_path):
    n_asked = 0

    def answer(request, handler):
        nonlocal n_asked
        n_asked += 1
        return send(handler, 503, b"busy") if n_asked == 1 else completion("yes")

    with serve_chat(answer) as url:
        assert ask(url, retries=1, max_in_flight=1)[0] == 0
    faults = [fault for record in read_outcome(tmp_path / "out")[0] for fault in record.faults]
    assert len(faults) == 1
    assert "answers 503 Service Unavailable: 'busy'" in faults[0]


def _echoes(request, handler):
    """Says the key wherever it can: in a reply, in errors, in heads, as what a request failed
    for."""
    key = handler.headers["Authorization"]
    text = request["messages"][0]["content"][-1]["text"]
    if "fridge" in text:
        handler.send_response(401, f"no {key}")
        handler.send_header("X-Key", key)
        handler.end_headers()
        handler.wfile.write(
            f'{{"error": {{"message": "Incorrect API key provided: {key}"}}}}'.encode()
        )
        return None
    if "sink" in text:
        return completion(None, finish_reason=key)
    if "table" in text:
        handler.wfile.write(f"{key}\r\n\r\n".encode())
        handler.close_connection = True
        return None
    return completion(f"The key is {key}.")


def test_the_key_is_in_no_file_and_in_nothing_that_is_said(ask, tmp_path, monkeypatch, caplog):
    monkeypatch.setenv("OPENAI_API_KEY", KEY)
    heard = []
    with caplog.at_level(logging.DEBUG), serve_chat(keep_requests(heard, _echoes)) as url:
        code, out, err = ask(url, retries=1)
    assert code == 1
    assert {request["headers"]["authorization"] for request in heard} == {f"Bearer {KEY}"}
    assert "Traceback" not in err
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert {"worker-0.jsonl", "results.json"} <= {path.name for path in files}
    written = b"".join(path.read_bytes() for path in files)
    assert b"Bearer [key]" in written
    for message in (written.decode("utf-8", "replace"), out, err, caplog.text):
        assert KEY not in message
        assert KEY[3:] not in message


@pytest.mark.parametrize("in_flight", [1, 4])
def test_a_run_interrupted_twice_ends_at_once_in_one_line(make_nieh_set, tmp_path, in_flight):
    request_came, done = threading.Event(), threading.Event()

    def answer(_request, _handler):
        request_came.set()
        done.wait(600)

    data = make_nieh_set(size=56)
    with serve_chat(answer) as url:
        model_args = f"base_url={url},model=m,max_in_flight={in_flight}"
        arguments = option_words(
            model="openai", model_args=model_args, tasks="nieh_full", data=data
        )
        command = [
            sys.executable,
            "-c",
            "from infthor_eval.cli import main; main()",
            *map(str, arguments),
        ]
        stopped = subprocess.Popen(
            [*command, "--out", tmp_path / "out"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            assert request_came.wait(600)
            stopped.send_signal(signal.SIGINT)  # to end after the unit in hand, for which it waits
            time.sleep(0.5)
            stopped.send_signal(signal.SIGINT)
            out, err = stopped.communicate(timeout=600)
        finally:
            stopped.kill()
            done.set()
    assert (stopped.returncode, out) == (130, "")
    assert err.splitlines()[-1] == "infthor-eval: stopped; run the same command to continue"
    assert "Traceback" not in err
    assert "never awaited" not in err
    assert "pending" not in err


def test_notes_are_paid_for_too(make_nieh_set, tmp_path, run_cli):
    data = make_nieh_set(size=56)
    with serve_chat(lambda *_: completion("a note", (100, 10))) as url:
        model_args = f"base_url={url},model=m,price_per_m_input=1,price_per_m_output=10"
        arguments = option_words(
            model="openai", model_args=model_args, tasks="nieh_memory_notes", data=data
        )
        code, out, err = run_cli(*arguments, "--out", tmp_path / "out")
    assert code == 0, err
    _, results = read_outcome(tmp_path / "out")
    assert results["usage"] == {
        "requests": 7,
        "context": 700,
        "reply": 70,
        "cost": pytest.approx(7 * 200 / 1e6),
    }
    assert "7 requests" in out


def test_in_process_models_and_baselines_tell_what_they_read(make_nieh_set, tmp_path, run_cli):
    arguments = option_words(tasks="nieh_gt", data=make_nieh_set(size=56), out=tmp_path / "out")
    assert "requests" not in run_cli("--model", "oracle", *arguments)[1]
    assert "qwen2.5-vl-tiny: 5 requests, " in (
        out := run_cli("--model", "qwen2.5-vl-tiny", *arguments)[1]
    )
    assert "US dollars" not in out


def test_several_trajectories_are_asked_about_at_once(make_nieh_set, tmp_path, run_cli):
    both = threading.Barrier(2, timeout=600)
    seen = set()

    def answer(request, handler):
        if len(seen) < 2:
            seen.add(threading.get_ident())
            both.wait()
        return talkative(request, handler)

    data = make_nieh_set(size=56)
    with serve_chat(answer) as url:
        model_args = f"base_url={url},model=m"
        arguments = option_words(
            model="openai", model_args=model_args, tasks="nieh_full", data=data
        )
        code, _, err = run_cli(*arguments, "--out", tmp_path / "out")
    assert code == 0, err


def test_a_server_that_says_nonsense_fails_every_unit_and_nothing_else(ask):
    with serve_chat(always_say("\x1b[2J\x00 not a word")) as url:
        code, out, err = ask(url)
    assert code == 0
    assert "\x1b[2J" not in out + err
