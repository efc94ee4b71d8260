"""What a server says of a batch is damaged: its fault alone is one line, and all else is kept."""

import json
from collections.abc import Callable

import pytest

from model_adapters.served.batches import transfer

from ....helpers.journals import read_records
from ..anthropic.server import AnthropicServer, message
from ..gemini.server import GeminiServer, content
from ..talking import completion
from .server import BatchServer, serve_batches

Damage = Callable[[bytes], bytes]

SERVERS = {
    "openai": lambda: BatchServer(answer=lambda _: completion("yes")),
    "anthropic": lambda: AnthropicServer(answer=lambda _: message()),
    "gemini": lambda: GeminiServer(answer=lambda _: content(), last_status="succeeded"),
}
_LISTS = ("/content", "/results", ":download")
_BODY = {
    "openai": b'"response": ',
    "anthropic": b'"result": ',
    "gemini": b'"response": ',
}


def _damages(model):
    """What becomes of a line with a reply."""
    before = _BODY[model]

    def instead(value):
        return lambda line: line[: line.index(before) + len(before)] + value + b"}"

    error = {
        "openai": b'null, "error": {"code": 7}',
        "anthropic": b'{"type": "errored", "error": {"error": {"type": 7}}}',
        "gemini": b'null, "error": {"code": "x"}',
    }
    return {
        "no UTF-8": lambda line: line.replace(b"yes", b"y\xffs"),
        "another type": instead(b"7"),
        "half a pair": lambda line: line.replace(b"yes", b"\\ud800"),
        "no reply": lambda line: (
            line.replace(b'"choices"', b'"c"')
            .replace(b"candidates", b"c")
            .replace(b'"message", "role"', b'7, "role"')
        ),
        "an error of another type": instead(error[model]),
        **(
            {"no error": instead(b'{"type": "errored", "error": null}')}
            if model == "anthropic"
            else {}
        ),
    }


CASES = [(model, name) for model in SERVERS for name in _damages(model)]


def _damage(server, damage):
    """Damage the lines of each list of replies."""
    answer_to = server.answer_to

    def answer(method, path, headers, body):
        status, said, *more = answer_to(method, path, headers, body)
        if path.partition("?")[0].endswith(_LISTS):
            said = b"\n".join(damage(said.splitlines()))
        return (status, said, *more)

    server.answer_to = answer


@pytest.mark.parametrize(("model", "name"), CASES)
def test_a_damaged_line_is_the_fault_of_its_request_alone(ask, tmp_path, model, name):
    with serve_batches(SERVERS[model]()) as server:
        answer_to = server.answer_to
        _damage(server, lambda lines: [_damages(model)[name](lines[0]), *lines[1:]])
        code, _, err = ask(server, model=model)
        assert (code, "Traceback" in err) == (1, False), err
        failures = [record.failure for record in read_records(tmp_path / "out")]
        (failure,) = filter(None, failures)
        assert "gives no reply in a batch: it " in failure
        assert [n for n, _ in server.sizes] == [5]
        server.answer_to = answer_to
        code, _, err = ask(server, model=model)  # asks this one alone
    assert code == 0, err
    assert "1 evaluated now, 4 resumed" in err


@pytest.mark.parametrize("model", SERVERS)
def test_lines_of_nobody_are_left_out(ask, model):
    noise = [b"", b"\xff\xfe", b"<html>", b"[" * 100_000, b'{"custom_id": "x-y", "key": "z"}', b"7"]
    with serve_batches(SERVERS[model]()) as server:
        _damage(server, lambda lines: [*noise, *lines, *noise])
        code, _, err = ask(server, model=model)
    assert code == 0, err
    assert [n for n, _ in server.sizes] == [5]


@pytest.mark.parametrize("model", SERVERS)
def test_a_page_in_place_of_the_lines_is_fetched_again_and_not_paid_again(ask, model):
    with serve_batches(SERVERS[model]()) as server:
        answer_to = server.answer_to
        _damage(server, lambda _: [b"<html>", b"busy"])
        code, _, err = ask(server, model=model)
        assert code == 2 and "answers without a line of a batch" in err.splitlines()[-1]
        server.answer_to = answer_to
        code, _, err = ask(server, model=model)
        assert code == 0, err
    assert [n for n, _ in server.sizes] == [5]


@pytest.mark.parametrize("model", SERVERS)
def test_of_two_replies_that_differ_none_counts(ask, tmp_path, model):
    with serve_batches(SERVERS[model]()) as server:
        _damage(server, lambda lines: [*lines, lines[0].replace(b"yes", b"no"), lines[1]])
        code, _, err = ask(server, model=model)
    assert code == 1, err
    assert "4 answered, 1 not" in err
    failures = [record.failure for record in read_records(tmp_path / "out") if record.failure]
    assert len(failures) == 1 and "it gives several that differ, and none counts" in failures[0]
    assert [n for n, _ in server.sizes] == [5]


def test_a_reply_counts_beside_a_fault(ask):
    with serve_batches(SERVERS["openai"]()) as server:
        fault = {"response": None, "error": {"code": "batch_expired", "message": "m"}}
        _damage(
            server,
            lambda lines: [json.dumps(json.loads(lines[0]) | fault).encode(), *lines],
        )
        code, _, err = ask(server)
    assert code == 0, err
    assert "5 answered, 0 not" in err


@pytest.mark.parametrize(
    ("broken", "n_asked"),
    [
        (completion("", finish_reason="error"), 7),
        (completion("It", finish_reason="abort"), 7),
        ({"error": {"code": 529, "message": "busy"}}, 7),
        ({"error": {"code": 400, "message": "no fridge"}}, 5),
    ],
)
def test_errors_inside_a_success_are_asked_again_if_that_may_help(ask, broken, n_asked):
    outcomes = iter([broken, broken])
    with serve_batches(BatchServer(answer=lambda _: next(outcomes, completion("yes")))) as server:
        code, _, err = ask(server)
        assert server.n_asked == n_asked, err
        assert code == (1 if n_asked == 5 else 0)
        assert ask(server)[0] == 0
    assert server.n_asked == 7


def test_what_an_earlier_version_kept_as_a_reply_is_asked_again(ask, tmp_path):
    with serve_batches(SERVERS["openai"]()) as server:
        assert ask(server)[0] == 0
        (kept,) = tmp_path.rglob("*.replies.jsonl")
        lines = [json.loads(line) for line in kept.read_text().splitlines()]
        lines[0]["content"] = json.dumps(completion("It", finish_reason="abort"))
        kept.write_text("".join(json.dumps(line) + "\n" for line in lines))
        for journal in tmp_path.rglob("worker-*.jsonl"):
            journal.unlink()
        assert ask(server)[0] == 0
    assert [n for n, _ in server.sizes] == [5, 1]


BAD_NAMES = ["a\r\nX-Key: b", "a" * 2**20, "", "a b", "?x", "é\x00"]


@pytest.mark.parametrize("name", BAD_NAMES)
@pytest.mark.parametrize("model", SERVERS)
def test_a_name_that_breaks_addresses_is_one_line(ask, model, name):
    with serve_batches(SERVERS[model]()) as server:
        answer_to = server.answer_to

        def rename(method, path, headers, body):
            status, said, *more = answer_to(method, path, headers, body)
            if isinstance(said, dict) and method == "POST":
                field = "name" if model == "gemini" else "id"
                said.get("file", said)[field] = name
            return (status, said, *more)

        server.answer_to = rename
        code, _, err = ask(server, model=model)
    assert (code, "Traceback" in err) == (2, False), err
    last = err.splitlines()[-1]
    assert "does not answer with a" in last and "matching regex" in last and len(last) < 600


@pytest.mark.parametrize("url", ["http://[", "http://127.0.0.1:9/x", "x", "https://127.0.0.1/é"])
def test_an_address_for_an_upload_is_the_servers_own(ask, url):
    with serve_batches(SERVERS["gemini"]()) as server:
        server.before = lambda _, path: (
            (200, b"", {"X-Goog-Upload-URL": url}) if path.startswith("/upload") else None
        )
        code, _, err = ask(server, model="gemini")
    assert code == 2, err
    assert "gives no address of its own for an upload" in err.splitlines()[-1]


@pytest.mark.parametrize("is_new", [False, True])
@pytest.mark.parametrize("model", SERVERS)
def test_a_list_without_end_is_one_line(ask, model, is_new, monkeypatch):
    monkeypatch.setattr(transfer, "_MOST_PAGES", 20)
    n_pages = 0

    def page():
        nonlocal n_pages
        n_pages += 1
        name = f"b{n_pages if is_new else 0}"
        batch = {"status": "completed", "processing_status": "ended", "created_at": 4e9}
        if model == "anthropic":
            batch["created_at"] = "0001-01-01T00:00:00" if n_pages % 2 else "2099-01-01T00:00:00Z"
        if model == "gemini":
            return {"operations": [{"name": name}], "nextPageToken": name}
        return {"data": [{"id": name} | batch], "has_more": True, "last_id": name}

    with serve_batches(SERVERS[model]()) as server:

        def lose(method, path):
            if method == "POST" and path.endswith(("batches", ":batchGenerateContent")):
                return 0, b""
            is_list = method == "GET" and "batches?" in path
            return (200, json.dumps(page()).encode()) if is_list else None

        server.before = lose
        code, _, err = ask(server, model=model)
    assert code == 2, err
    assert "lists its batches without end; " in err.splitlines()[-1]
    assert n_pages == (20 if is_new else 2)
