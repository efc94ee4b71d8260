"""Plans carried out by a model behind a server."""

import hashlib

import msgspec
import pytest

from tests.helpers.command_line import option_words
from tests.helpers.journals import read_outcome
from tests.helpers.trajectories import CANDLE, FORK, MUG, cut_trajectory, write_trajectories

from ..policies.servers import send
from .talking import completion, keep_requests, serve_chat

MOVES = ("RotateLeft", "RotateRight", "LookUp", "LookDown", "MoveAhead")


def _moves(request, _handler=None):
    """A move that follows from everything that was shown."""
    drawn = hashlib.sha256(repr(request["messages"]).encode()).digest()[0]
    return completion(f"{MOVES[drawn % len(MOVES)]}<|act|>", (100, 3))


@pytest.fixture
def played(task_files, tmp_path, run_cli):
    """Plays plans of at most four actions; gives exit code, records and results."""
    task = task_files / "plans" / "infthor_plans.yaml"
    task.write_text(
        "include: _plans.yaml\ntask: infthor_plans\ndataset_kwargs: {plans: all, max_steps: 4}\n"
    )

    def played(url, data, name="m", **more):
        settings = {"base_url": url, "model": "m", "retries": 0, **more}
        typed = ",".join(f"{option}={value}" for option, value in settings.items())
        arguments = option_words(model="openai", model_args=typed, tasks="infthor_plans", data=data)
        code, _, err = run_cli(*arguments, "--greedy", "--name", name, "--out", tmp_path / "out")
        assert "Traceback" not in err
        return code, *read_outcome(tmp_path / "out" / name)

    return played


def test_episodes_at_once_find_what_one_after_the_other_finds(played, tmp_path):
    data = write_trajectories(
        tmp_path / "data",
        cut_trajectory(FORK, 1),
        cut_trajectory(MUG, 1),
        cut_trajectory(CANDLE, 1),
    )
    with serve_chat(_moves) as url:
        runs = [played(url, data, f"with-{number}", max_in_flight=number) for number in (3, 1)]
    together, alone = (
        [msgspec.structs.replace(record, seconds=0.0) for record in records]
        for _, records, _ in runs
    )
    assert together == alone
    assert len({record.cluster for record in together}) == 3
    assert all(step.action in MOVES for record in together for step in record.payload.steps)
    n_steps = sum(len(record.payload.steps) for record in together)
    for code, _, results in runs:
        assert code == 0
        assert results["usage"] == {
            "requests": n_steps,
            "context": 100 * n_steps,
            "reply": 3 * n_steps,
            "cost": None,
        }


def test_a_plan_that_fails_in_the_middle_says_what_it_took_and_the_next_one_is_played(
    played, tmp_path
):
    asked = []

    def answer(_request, handler):
        return send(handler, 400, b"no") if len(asked) == 3 else completion("RotateLeft", (100, 3))

    data = write_trajectories(tmp_path / "data", cut_trajectory(FORK, 2))
    with serve_chat(keep_requests(asked, answer)) as url:
        code, (first, second), results = played(url, data)
    assert code == 1
    assert "answers 400 Bad Request: 'no'" in first.failure
    assert (first.usage.requests, second.failure, second.usage.requests) == (2, None, 4)
    assert results["usage"]["requests"] == 6


def test_a_survived_fault_stands_in_the_plans_record(played, tmp_path):
    asked = []

    def answer(_request, handler):
        return send(handler, 503, b"busy") if len(asked) == 2 else completion("RotateLeft")

    data = write_trajectories(tmp_path / "data", cut_trajectory(FORK, 1))
    with serve_chat(keep_requests(asked, answer)) as url:
        code, (record,), _ = played(url, data, retries=1)
    assert code == 0
    (fault,) = record.faults
    assert "answers 503 Service Unavailable: 'busy'" in fault


def test_plans_beyond_the_cap_are_not_asked_and_are_played_by_the_next_run(played, tmp_path):
    data = write_trajectories(tmp_path / "data", cut_trajectory(FORK, 2))
    with serve_chat(lambda *_: completion("RotateLeft", (95, 5))) as url:
        code, (first, second), _ = played(url, data, max_tokens_total=400)
        assert (code, first.failure, first.usage.requests) == (1, None, 4)
        assert second.failure.startswith(
            "not asked: 400 tokens reach max_tokens_total=400; raise it"
        )
        code, (first, second), results = played(url, data, max_tokens_total=800)
    assert (code, first.attempt, second.attempt, second.failure) == (0, 1, 2, None)
    assert results["usage"]["requests"] == 8
