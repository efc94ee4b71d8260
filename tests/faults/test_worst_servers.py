"""A server of chat completions gives the worst values: a failed unit or a reply, and a run that can
be read."""

import itertools
import json
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler
from typing import Any

from infthor_eval.runs import read_run
from infthor_eval.suites import find_suite

from ..model_adapters.policies.servers import no_proxy, send
from ..model_adapters.served.talking import completion, serve_chat
from .test_worst_values import IN_JSON, fast_disk, read_in_every_way

__all__ = ["fast_disk", "no_proxy"]  # for all tests here


N_UNITS = 127  # of the bundled set
SPOILED = "@spoiled@"
FIELDS: tuple[tuple[str | int, ...], ...] = (
    (),
    ("id",),
    ("model",),
    ("choices",),
    ("choices", 0),
    ("choices", 0, "message"),
    ("choices", 0, "message", "content"),
    ("choices", 0, "message", "reasoning_content"),
    ("choices", 0, "message", "refusal"),
    ("choices", 0, "finish_reason"),
    ("usage",),
    ("usage", "prompt_tokens"),
    ("usage", "completion_tokens"),
    ("usage", "prompt_tokens_details"),
    ("usage", "prompt_tokens_details", "cached_tokens"),
    ("usage", "cost"),
)


def spoiled_bodies() -> Iterator[bytes]:
    """Answers in which one field has one of the worst values, then sound ones."""
    for path, value in itertools.product(FIELDS, IN_JSON):
        document: Any = [completion("yes", (10, 2, 3))]
        place, key = document, 0
        for step in path:
            place, key = place[key], step
        place[key] = SPOILED
        yield json.dumps(document[0]).replace(f'"{SPOILED}"', value).encode(errors="surrogatepass")
    while True:
        yield json.dumps(completion("yes")).encode()


def test_a_server_gives_the_worst_replies(run_cli, tmp_path) -> None:
    bodies = spoiled_bodies()

    def answer(_request: dict[str, Any], handler: BaseHTTPRequestHandler) -> None:
        send(handler, 200, next(bodies))

    typed = ("run", "--model", "openai", "--tasks", "nieh_mini_gt", "--quiet", "--out", tmp_path)
    n_values = len(FIELDS) * len(IN_JSON)
    n_failed = 0
    with serve_chat(answer) as url:
        for start in range(0, n_values, N_UNITS):
            settings = f"base_url={url},model=m,retries=0,max_in_flight=1"
            code, _, err = run_cli(*typed, "--name", f"from{start}", "--model-args", settings)
            assert code in (0, 1), err
            assert "Traceback" not in err
            (folder,) = (tmp_path / f"from{start}").iterdir()
            records = read_run(folder, find_suite("nieh").records)[1]
            assert len(records) == N_UNITS
            failures = [record.failure for record in records if record.failure is not None]
            assert all("\n" not in failure for failure in failures)
            n_failed += len(failures)
    # What is not needed (an id, the model's own name) may be anything.
    assert n_values // 4 < n_failed < n_values
    read_in_every_way(run_cli, folder)
    assert run_cli("rescore", folder, "--out", tmp_path / "rescored")[0] == 0
