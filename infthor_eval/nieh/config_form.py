"""The part of an NIEH run's config that its summary and tables read, as `task.NiehTask.config`
writes it."""

from typing import Annotated, Any

import msgspec
from msgspec import Meta

__all__ = ["NiehConfig"]


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


class _Task(msgspec.Struct, kw_only=True):
    config: _TaskFile
    decoding: _Decoding
    metrics: _Metrics
    skipped: list[_Skipped]
    n_samples: int
    data: str
    sources: _Sources = msgspec.field(default_factory=_Sources)
    simulator: str | None


class NiehConfig(msgspec.Struct):
    """The config of a run."""

    tasks: dict[str, _Task]
    model: dict[str, Any]
    frames: str
    budget: int | str | None = None
    rescored: dict[str, Any] = {}
