"""The part of an NIEH run's config that its summary and tables read, as `task.NiehTask.config` writes it.

A journal can be cut, edited, or of another suite, and its header's config is free-form JSON. It is checked here once,
before anything is summed up.
"""

from typing import Annotated, Any

import msgspec
from msgspec import Meta

from infthor_eval.errors import wrap_errors
from infthor_eval.runs import RunHeader

__all__ = ["check_config"]


class _Dataset(msgspec.Struct):
    context: str
    budget: int | str | None = None


class _TaskFile(msgspec.Struct):
    dataset_kwargs: _Dataset


class _Decoding(msgspec.Struct):
    max_new_tokens: int | None


class _Metrics(msgspec.Struct):
    names: Annotated[list[str], Meta(min_length=1)]


class _Skipped(msgspec.Struct):
    question_id: str
    reason: str
    variant: str = ""


class _Memory(msgspec.Struct):
    name: str
    privileged: bool


class _Sources(msgspec.Struct):
    memory: _Memory | None = None


class _Task(msgspec.Struct):
    config: _TaskFile
    decoding: _Decoding
    metrics: _Metrics
    skipped: list[_Skipped]
    n_samples: int
    data: str
    sources: _Sources = msgspec.field(default_factory=_Sources)
    simulator: str | None = None


class _Config(msgspec.Struct):
    tasks: dict[str, _Task]
    model: dict[str, Any]
    frames: str
    budget: int | str | None = None
    rescored: dict[str, Any] = {}


def check_config(header: RunHeader) -> None:
    """Check that the config in a journal's header is that of an NIEH run.

    Raises:
        DataError: names the run, and the place in its config.
    """
    problem, hint = f"{header.name}: not the config of a run of nieh", "run the evaluation again"
    with wrap_errors(problem, hint, catch=msgspec.ValidationError):
        msgspec.convert(header.config, _Config)
