"""Whole runs in batches, as their user types them."""

import json

import pytest

from model_adapters.served.batches import queue

from ....helpers.command_line import assert_refused, option_words
from ....helpers.journals import read_outcome
from ..talking import completion
from .server import BatchServer, failed, serve_batches


def _first_time(outcome):
    """Gives an outcome for the first two requests, and replies from then on."""
    n_asked = 0

    def answer(_body):
        nonlocal n_asked
        n_asked += 1
        return outcome if n_asked <= 2 else completion("yes", (100, 10, 40))

    return answer


def test_questions_are_asked_in_one_batch_and_their_cost_is_in_the_results(ask, tmp_path):
    prices = {"price_per_m_input": 1, "price_per_m_cached": 0.5, "price_per_m_output": 5}
    with serve_batches(BatchServer()) as server:
        code, out, err = ask(server, **prices)
        assert code == 0, err
        assert [size for size, _ in server.sizes] == [5]
        assert server.n_asked == 5
        assert "batch batch_2: 5 request(s) submitted" in err
        assert "batch batch_2: 5 answered, 0 not" in err
        again, _, err = ask(server, **prices)
        assert (again, server.n_asked) == (0, 5)
        assert "0 evaluated now, 5 resumed from the journal" in err
    records, results = read_outcome(tmp_path / "out")
    each = (60 * 1 + 40 * 0.5 + 10 * 5) / 1e6
    assert [record.payload.reply for record in records] == ["yes"] * 5
    assert results["usage"] == {
        "requests": 5,
        "context": 500,
        "reply": 50,
        "cost": pytest.approx(5 * each),
    }
    assert "(200 of them cached, 40.0 %)" in out


def test_a_run_may_go_on_with_or_without_batches(ask, tmp_path):
    with serve_batches(BatchServer(answer=_first_time(failed(400, "no fridge")))) as server:
        assert ask(server)[0] == 1
        code, _, err = ask(server, batch=False)
        assert code == 0, err
        assert server.n_asked == 7  # a refused one counts as asked
        assert "2 evaluated now, 3 resumed" in err
    assert len(server.sizes) == 1
    assert len(list((tmp_path / "out" / "m").iterdir())) == 1


@pytest.mark.parametrize(
    ("model_args", "sizes"), [({"batch_requests": 2}, [2, 2, 1]), ({"batch_mb": 1}, [5])]
)
def test_a_batch_is_no_larger_than_it_may_be(ask, model_args, sizes):
    with serve_batches(BatchServer()) as server:
        assert ask(server, **model_args)[0] == 0
    assert [n for n, _ in server.sizes] == sizes
    assert server.n_asked == 5


def test_batches_are_split_by_their_size(ask, monkeypatch):
    with serve_batches(BatchServer()) as server:
        assert ask(server)[0] == 0
        largest = server.sizes[0][1] // 2
        monkeypatch.setattr(queue, "_MB", largest)
        assert ask(server, "--fresh", batch_mb=1)[0] == 0
    assert len(server.sizes) > 2
    assert all(size <= largest for _, size in server.sizes[1:])
    assert server.n_asked == 10


def test_a_request_that_no_batch_can_hold_fails_alone(ask, tmp_path, monkeypatch):
    with serve_batches(BatchServer()) as server:
        assert ask(server, batch_requests=1)[0] == 0
        sizes = sorted(size for _, size in server.sizes)
        monkeypatch.setattr(queue, "_MB", sizes[-1] - 1)
        code, _, err = ask(server, "--fresh", batch_mb=1)
    assert code == 1
    assert "the request has 1.0 MB, more than a batch may have" in err
    records, _ = read_outcome(tmp_path / "out")
    assert 1 <= sum(record.failure is not None for record in records) < 5


@pytest.mark.parametrize(
    ("outcome", "fault"),
    [
        (failed(429, "slow down"), "in a batch answers 429 Too Many Requests"),
        (failed(503, "busy"), "in a batch answers 503 Service Unavailable"),
        ("batch_expired", "gives no reply in a batch: batch_expired m"),
    ],
)
def test_what_passes_is_asked_again_and_told(ask, tmp_path, outcome, fault):
    with serve_batches(BatchServer(answer=_first_time(outcome))) as server:
        code, _, err = ask(server)
    assert code == 0, err
    assert [n for n, _ in server.sizes] == [5, 2]
    assert "3 answered, 2 not" in err
    assert "2 request(s) were not processed, and are asked again" in err
    faults = [fault for record in read_outcome(tmp_path / "out")[0] for fault in record.faults]
    assert len(faults) == 2
    assert all(fault in line for line in faults)


def test_what_does_not_pass_fails_and_is_asked_by_the_next_run(ask, tmp_path):
    with serve_batches(BatchServer(answer=lambda _: failed(500, "out of memory"))) as server:
        code, _, err = ask(server)
        assert code == 1
        assert "answers 500 Internal Server Error" in err and ", in 2 attempts; " in err
        assert [n for n, _ in server.sizes] == [5, 5]
        server.answer = lambda _: completion("yes")
        assert ask(server)[0] == 0
    assert [record.failure for record in read_outcome(tmp_path / "out")[0]] == [None] * 5


def test_a_refusal_is_not_asked_again(ask, tmp_path):
    with serve_batches(BatchServer(answer=_first_time(failed(400, "no fridge")))) as server:
        assert ask(server)[0] == 1
    assert len(server.sizes) == 1
    failures = [record.failure for record in read_outcome(tmp_path / "out")[0] if record.failure]
    assert len(failures) == 2
    assert all("in a batch answers 400 Bad Request" in failure for failure in failures)


def test_a_batch_that_expires_gives_what_it_has(ask):
    server = BatchServer(answer=_first_time("batch_expired"), last_status="expired")
    with serve_batches(server):
        code, _, err = ask(server)
    assert code == 0, err
    assert "3 answered, 2 not (the batch is expired)" in err
    assert server.n_asked == 5


def test_lines_that_are_missing_are_asked_again(ask):
    with serve_batches(BatchServer()) as server:

        def drop(method, path):
            if "/content" not in path:
                return None
            server.before = lambda *_: None
            name = path.split("/")[-2]
            return 200, b"".join(server.files[name].splitlines(keepends=True)[:3])

        server.before = drop
        code, _, err = ask(server)
    assert code == 0, err
    assert [n for n, _ in server.sizes] == [5, 2]


def test_who_cancels_a_batch_is_not_asked_to_pay_for_another(ask):
    server = BatchServer(answer=_first_time("batch_cancelled"), last_status="cancelled")
    with serve_batches(server):
        code, _, err = ask(server)
    assert code == 1
    assert len(server.sizes) == 1
    assert "gives no reply in a batch: batch_cancelled m; run the same command again" in err


def test_a_batch_that_is_refused_ends_the_run_in_one_line(ask):
    errors = [{"code": "billing_hard_limit_reached", "message": "pay first", "line": None}]
    with serve_batches(BatchServer(last_status="failed", errors=errors)) as server:
        code, _, err = ask(server)
        assert code == 2
        line = err.splitlines()[-1]
        assert "refuses batch batch_2: billing_hard_limit_reached pay first; fix it" in line
        server.last_status = "completed"
        assert ask(server)[0] == 0
    assert server.n_asked == 5


def test_a_server_with_too_much_in_its_queue_gets_the_rest_later(ask):
    errors = [{"code": "token_limit_exceeded", "message": "Enqueued token limit reached"}]
    server = BatchServer(errors=errors)
    n_finished = 0

    def refuse_the_second(method, path):
        nonlocal n_finished
        if path.startswith("/v1/batches/"):
            server.last_status = "failed" if path.endswith("batch_4") else "completed"

    server.before = refuse_the_second
    with serve_batches(server):
        code, _, err = ask(server, batch_requests=3)
        assert code == 0, err
        assert "batch batch_4: token_limit_exceeded Enqueued token limit reached" in err
        assert [n for n, _ in server.sizes] == [3, 2, 2]
        assert server.n_asked == 5
        server.before = lambda *_: None
        server.last_status = "failed"
        code, _, err = ask(server, "--fresh")
    assert code == 2
    assert "takes no further batch now; run the same command again later" in err


def test_caps_are_kept_batch_by_batch(ask, tmp_path):
    with serve_batches(BatchServer()) as server:
        code, _, err = ask(server, "--max-tokens-total", 330)  # 110 for each question
        assert code == 1
        assert "2 sample(s) not asked: 330 tokens reach max_tokens_total=330; raise" in err
        assert [n for n, _ in server.sizes] == [1, 2]
        assert ask(server, "--max-tokens-total", 100_000)[0] == 0
    assert server.n_asked == 5


def test_a_batch_whose_name_was_lost_is_found_again(ask):
    with serve_batches(BatchServer()) as server:
        for _ in range(5):  # batches of others, on pages before it
            server.add_batch(
                {
                    "input_file_id": server.add_file(
                        b'{"custom_id": "a", "url": "/v1/chat/completions"}'
                    ),
                    "endpoint": "/v1/chat/completions",
                    "completion_window": "24h",
                    "metadata": None,
                }
            )

        def lose(method, path):
            if (method, path) != ("POST", "/v1/batches"):
                return None
            server.before = lambda *_: None
            newest = list(server.files)[-1]
            server.add_batch(
                {
                    "input_file_id": newest,
                    "endpoint": "/v1/chat/completions",
                    "completion_window": "24h",
                    "metadata": {"infthor_eval_batch": _name_in(server.files[newest])},
                }
            )
            return 0, b""

        server.before = lose
        code, _, err = ask(server)
    assert code == 0, err
    assert server.n_asked == 5
    assert len(server.sizes) == 6


def test_a_batch_that_the_server_lists_a_moment_later_is_not_submitted_again(ask):
    with serve_batches(BatchServer()) as server:

        def lose(method, path):
            if (method, path) == ("POST", "/v1/batches"):
                newest = list(server.files)[-1]
                server.add_batch(
                    {
                        "input_file_id": newest,
                        "endpoint": "/v1/chat/completions",
                        "completion_window": "24h",
                        "metadata": {"infthor_eval_batch": _name_in(server.files[newest])},
                    }
                )
                server.before = hide
                return 0, b""
            return None

        def hide(method, path):
            if method == "GET" and path.startswith("/v1/batches?"):
                server.before = lambda *_: None
                return 200, b'{"data": [], "has_more": false}'
            return None

        server.before = lose
        assert ask(server, retries=0)[0] != 0
        code, _, err = ask(server)
    assert code == 0, err
    assert (server.n_asked, len(server.sizes)) == (5, 1)


def _name_in(content):
    name = json.loads(content.splitlines()[0])["custom_id"].partition("-")[2]
    return str(name)


def test_a_server_that_is_away_for_a_while_is_waited_for(ask):
    with serve_batches(BatchServer()) as server:
        n_down = 7

        def down(method, path):
            nonlocal n_down
            if not path.startswith("/v1/batches/") or n_down == 0:
                return None
            n_down -= 1
            return 502, b"bad gateway"

        server.before = down
        code, _, err = ask(server)
    assert code == 0, err
    assert err.count("the batches are looked after all the same") == 1
    assert server.n_asked == 5


def test_the_key_is_in_no_file(ask, tmp_path, monkeypatch):
    key = "sk-0123456789abcdef0123456789"
    monkeypatch.setenv("OPENAI_API_KEY", key)
    outcomes = iter([failed(401, f"no {key}"), completion(f"The key is {key}.")])
    server = BatchServer(answer=lambda _: next(outcomes, completion("yes")))
    with serve_batches(server):
        _, out, err = ask(server)
    written = b"".join(path.read_bytes() for path in tmp_path.rglob("*") if path.is_file())
    assert b"The key is [key]." in written
    assert key not in written.decode("utf-8", "replace") + out + err


@pytest.mark.parametrize("left", ["no requests file", "a half one", "a bad batch", "bad replies"])
def test_what_is_found_in_the_folder_is_taken_or_refused_in_one_line(ask, tmp_path, left):
    with serve_batches(BatchServer()) as server:
        assert ask(server)[0] == 0
        (folder,) = tmp_path.rglob("batches")
        (batch,) = folder.glob("*-1.json")
        if left == "a half one":
            (folder / "x-9.requests.jsonl").write_bytes(b"{")
            assert ask(server)[0] == 0
            assert not list(folder.glob("*.requests.jsonl"))
            return
        if left == "no requests file":
            # As after a kill between its last write and its submission, with its file deleted.
            content = json.loads(batch.read_text())
            batch.write_text(json.dumps(content | {"server_id": None, "ended": False}))
            server.batches.clear()
            (folder.parent / "worker-0.jsonl").unlink()
            assert ask(server)[0] == 0
            assert server.n_asked == 10
            return
        bad = batch if left == "a bad batch" else next(folder.glob("*.replies.jsonl"))
        bad.write_text("{")
        ended = ask(server)
    assert_refused(ended, f"{bad}: cannot be read", "put it back, or start again with --fresh")


@pytest.mark.parametrize(
    ("tasks", "options", "message"),
    [
        ("infthor_plans_mini", (), "but infthor_plans_mini asks what depends on earlier replies"),
        ("nieh_mini_gt", ("--workers", 2), "leave out --workers"),
        ("nieh_memory_notes", (), "but nieh_memory_notes asks what depends on earlier replies"),
    ],
)
def test_what_cannot_be_asked_together_is_refused_in_one_line(
    run_cli, make_nieh_set, tmp_path, tasks, options, message
):
    data = ("--data", make_nieh_set(size=56)) if tasks == "nieh_memory_notes" else ()
    task = option_words(
        model="openai", model_args="base_url=http://127.0.0.1:1/v1,model=m,batch=true", tasks=tasks
    )
    ended = run_cli(*task, *data, *options, "--out", tmp_path / "out")
    assert_refused(ended, message, after_notes=True)


def test_a_plan_measures_with_single_requests_and_prices_what_is_cached(run_cli, make_nieh_set):
    prices = "price_per_m_input=1000,price_per_m_cached=100,price_per_m_output=5000"
    with serve_batches(BatchServer()) as server:
        given = f"base_url={server.url},model=m,batch=true,{prices}"
        task = option_words(
            model="openai", model_args=given, tasks="nieh_gt", data=make_nieh_set(size=56)
        )
        code, out, err = run_cli("plan", *task)
    assert code == 0, err
    assert server.sizes == []
    each = (60 * 1000 + 40 * 100 + 10 * 5000) / 1e6
    assert f"money: {5 * each:.2f} US dollars, by the prices of the model" in out
    assert " 500 " in out and " 300 " in out  # tokens read, and those not in a cache
