"""No key of the machine's user in these tests, no waiting, and runs in batches."""

import pytest

from model_adapters.served import endpoint
from model_adapters.served.batches import queue

from ...helpers.command_line import option_words


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    monkeypatch.setattr(endpoint, "_FIRST_WAIT_S", 0.001)
    monkeypatch.setattr(queue, "_FIRST_POLL_S", 0.001)
    monkeypatch.setattr(queue, "_LONGEST_POLL_S", 0.01)
    monkeypatch.setattr(queue, "_LISTED_WITHIN_S", 0.05)
    for name in ("OPENAI_API_KEY", "ANTHROPIC_API_KEY", "GEMINI_API_KEY"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def ask(make_nieh_set, tmp_path, run_cli):
    """Runs `nieh_gt` on five questions, in batches unless it is told otherwise."""
    data = make_nieh_set(size=56)

    def ask(server, *options, model="openai", **model_args):
        settings = {"base_url": server.url, "model": "m", "retries": 1, "batch": True, **model_args}
        typed = ",".join(f"{name}={value}" for name, value in settings.items())
        task = option_words(model=model, model_args=typed, tasks="nieh_gt", data=data)
        return run_cli(*task, "--out", tmp_path / "out", *options)

    return ask
