"""No key of the machine's user in these tests, no waiting, and runs in batches."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from model_adapters.served import endpoint
from model_adapters.served.batches import queue

from ...helpers.command_line import option_words
from .batches.server import BatchServer

Ask = Callable[..., tuple[int, str, str]]


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(endpoint, "_FIRST_WAIT_S", 0.001)
    monkeypatch.setattr(queue, "_FIRST_POLL_S", 0.001)
    monkeypatch.setattr(queue, "_LONGEST_POLL_S", 0.01)
    monkeypatch.setattr(queue, "_LISTED_WITHIN_S", 0.05)
    for name in ("OPENAI_API_KEY", "ANTHROPIC_API_KEY", "GEMINI_API_KEY"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def ask(make_nieh_set: Any, tmp_path: Path, run_cli: Any) -> Ask:
    """Runs `nieh_gt` on five questions, in batches unless it is told otherwise."""
    data = make_nieh_set(size=56)

    def ask(
        server: BatchServer, *options: object, model: str = "openai", **model_args: object
    ) -> tuple[int, str, str]:
        settings = {"base_url": server.url, "model": "m", "retries": 1, "batch": True, **model_args}
        typed = ",".join(f"{name}={value}" for name, value in settings.items())
        task = option_words(model=model, model_args=typed, tasks="nieh_gt", data=data)
        return run_cli(*task, "--out", tmp_path / "out", *options)

    return ask
