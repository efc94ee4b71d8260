"""Why two runs may differ: the settings that do, and what each can change.

A setting is known as a cause by what it changes. Frames in another order change the requests, whose
hashes then differ; another template changes the tokens of the same request, another image size the
pixels; another precision changes the replies alone.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import msgspec

from infthor_eval.runs import RunConfig
from infthor_eval.settings import causes_of

Path = tuple[str, ...]
_ABSENT = "-"


class Effect(StrEnum):
    """How a question of two runs differs.

    Attributes:
        ASKED: it is in one of them alone.
        FAILED: it is in both, and only one has a result.
        SCORES: the replies are equal, the scores are not.
        REQUEST: what was sent to the adapter is another: frames, words or gold answers.
        TOKENS: the request is the same, and the model read other tokens.
        PIXELS: the request is the same, and the model read other pixels of its frames.
        CUT: one reply is the beginning of the other.
        REPLY: the replies differ.
    """

    ASKED = "asked"
    FAILED = "failed"
    SCORES = "scores"
    REQUEST = "request"
    TOKENS = "tokens"
    PIXELS = "pixels"
    CUT = "cut"
    REPLY = "reply"


@dataclass(frozen=True)
class Setting:
    """A setting that differs, by its name in the config, and its value in both runs as text."""

    name: str
    first: str
    second: str


@dataclass(frozen=True)
class Cause:
    """A cause that runs can differ by.

    Attributes:
        name: its name in sentences.
        effects: what it can change.
        settings: the settings that tell of it; none for what only the records tell.
    """

    name: str
    effects: frozenset[Effect]
    settings: tuple[Setting, ...] = ()


@dataclass(frozen=True)
class _Kind:
    """Settings that are one cause, by the beginnings of their paths; "*" is any one name."""

    name: str
    effects: frozenset[Effect]
    paths: tuple[str, ...]

    def has(self, path: Path) -> bool:
        return any(_begins(path, tuple(pattern.split("."))) for pattern in self.paths)


_SENT = frozenset({Effect.REQUEST})
_TOKENS = frozenset({Effect.TOKENS})
_PIXELS = frozenset({Effect.PIXELS, Effect.TOKENS})  # images of other sizes have other tokens
_READ = frozenset({Effect.TOKENS, Effect.PIXELS, Effect.REPLY})
_WRITTEN = frozenset({Effect.REPLY})
_CUT = frozenset({Effect.CUT})
_SCORED = frozenset({Effect.SCORES})
_CHOSEN = frozenset({Effect.ASKED})
_ANY = frozenset(Effect)


def _each(parent: str, names: str) -> tuple[str, ...]:
    """Return the paths of names that spaces separate, below one parent."""
    return tuple(f"{parent}.{name}" for name in names.split())


_TASK = "tasks.*"
_FILE = "tasks.*.config"
_CONTEXT = "tasks.*.config.dataset_kwargs"
_DECODING = "tasks.*.decoding"

_ENGINE = _Kind("the engine", _READ, ("host", *_each("model", "engine base_url adapter")))
_ENGINE_SETTING = ("model", "engine")

# In the order in which they are named where the records do not tell them apart: what usually
# changes more comes first. A setting is of the first kind that has it.
_KINDS = (
    _Kind("the frame ablation", _SENT, ("frames", f"{_TASK}.without_alike")),
    _Kind("the question set or its frames", _SENT, ("simulator", *_each(_TASK, "data simulator"))),
    _Kind(
        "the words of the question",
        _SENT,
        _each(_FILE, "doc_to_text doc_to_image"),
    ),
    _Kind("the memory", _SENT, (f"{_TASK}.sources.memory",)),
    _Kind(
        "the context or its window",
        _SENT | _CHOSEN,
        (_CONTEXT, *_each(_TASK, "film sources")),
    ),
    _Kind(
        "the model",
        _READ,
        _each("model", "name checkpoint class n_parameters baseline model imported"),
    ),
    _Kind("the model's revision", _READ, ("model.revision",)),
    _Kind("the chat template or system prompt", _TOKENS, _each("model", "prompt chat_template")),
    _Kind("the size of images", _PIXELS, ("model.image_processor.size", "model.max_frames")),
    _Kind("the preparation of images", _PIXELS, _each("model", "image_processor image_backend")),
    _Kind("the file or package that the model comes from", _READ, ("adapter",)),
    _ENGINE,
    _Kind(
        "the limit of the model's context",
        _CHOSEN | {Effect.FAILED} | _READ,
        ("model.max_tokens",),
    ),
    _Kind("the temperature", _WRITTEN, _each(_DECODING, "temperature top_p")),
    _Kind(
        "the repetition penalty",
        _WRITTEN,
        (f"{_DECODING}.repetition_penalty", "model.generation.repetition_penalty"),
    ),
    _Kind("the allowed replies", _WRITTEN, (f"{_DECODING}.choices",)),
    _Kind(
        "where replies end",
        _CUT,
        (*_each(_DECODING, "max_new_tokens stop"), "model.generation.end_ids"),
    ),
    _Kind("the seed", _WRITTEN | _SENT | _CHOSEN, ("seed", "model.seed", f"{_DECODING}.seed")),
    _Kind("the extension of the context (RoPE)", _WRITTEN, ("model.rope",)),
    _Kind("the precision", _WRITTEN, _each("model", "dtype quantization")),
    _Kind("the checkpoint's files", _READ, ("model.fingerprint",)),
    _Kind("the versions of libraries", _READ, ("model.versions",)),
    _Kind("other settings of the model", _READ, ("model",)),
    _Kind(
        "the scorer",
        _SCORED,
        ("rescored", f"{_TASK}.metrics", *_each(_FILE, "metric_list process_results")),
    ),
    _Kind("which questions are asked", _CHOSEN, ("limit", f"{_TASK}.skipped")),
    _Kind("the version of infthor-eval", _ANY, ("infthor_eval", "suite_code")),
    _Kind("other settings", _ANY, ("*",)),
)
# Names of tasks, and what other settings show too: decoding, the set's digest, skipped questions.
_COVERED_ELSEWHERE = _Kind(
    "",
    frozenset(),
    (
        *_each(_FILE, "task tag metadata generation_kwargs doc_to_target"),
        f"{_CONTEXT}.bundled",
        f"{_TASK}.n_samples",
    ),
)

# The cause to name where no setting explains a difference.
UNEXPLAINED = {
    Effect.ASKED: Cause("questions that one run did not come to", _CHOSEN),
    Effect.FAILED: Cause("questions that failed or were not asked", frozenset({Effect.FAILED})),
    Effect.SCORES: Cause("the scores of equal replies", _SCORED),
    Effect.REQUEST: Cause("frames or words that no setting accounts for", _SENT),
    Effect.TOKENS: Cause("tokens that no setting accounts for", _TOKENS),
    Effect.PIXELS: Cause("pixels that no setting accounts for", frozenset({Effect.PIXELS})),
    Effect.CUT: Cause("nothing that is recorded", _WRITTEN),
    Effect.REPLY: Cause("nothing that is recorded", _WRITTEN),
}


def differing_causes(first: RunConfig[Any], second: RunConfig[Any]) -> list[Cause]:
    """Return the causes by which the settings of two runs differ, in the order of `_KINDS`.

    The only task of one run is compared with the only one of the other, whatever their names.
    """
    one, other = (dict(_flat(document)) for document in _documents(first, second))
    pairs = {path: (one.get(path, _ABSENT), other.get(path, _ABSENT)) for path in one | other}
    differing = {path: values for path, values in pairs.items() if len(set(values)) > 1}
    declared = causes_of(type(first))
    found: dict[str, list[Setting]] = {}
    for path, values in differing.items():
        if _COVERED_ELSEWHERE.has(path):
            continue
        kind = _find_kind(path, declared)
        if _ENGINE_SETTING in differing and _is_of_engine(path, values):
            kind = _ENGINE
        found.setdefault(kind.name, []).append(Setting(".".join(path), *values))
    return [
        Cause(kind.name, kind.effects, tuple(found[kind.name]))
        for kind in _KINDS
        if kind.name in found
    ]


def _find_kind(path: Path, declared: Mapping[str, str]) -> _Kind:
    """Return the cause that a setting is, by its path: the one that is declared with it, where the
    setting is of the run or of a task file."""
    name = path[4] if len(path) > 4 and _begins(path, _CONTEXT.split(".")) else path[0]
    cause = declared.get(name)
    found = next((kind for kind in _KINDS if kind.name == cause), None)
    return found or next(kind for kind in _KINDS if kind.has(path))


def _is_of_engine(path: Path, values: Sequence[Any]) -> bool:
    """Return whether a setting differs because engines do: it is one that only one engine has, or
    the name of the same model with another engine behind it."""
    if path == ("model", "name"):
        return len({str(value).partition("@")[0] for value in values}) == 1
    return path[0] == "model" and _ABSENT in values


def _documents(first: RunConfig[Any], second: RunConfig[Any]) -> list[dict[str, Any]]:
    documents = [first.document, second.document]
    tasks = [document.get("tasks", {}) for document in documents]
    if all(len(of_run) == 1 for of_run in tasks) and tasks[0].keys() != tasks[1].keys():
        for document, of_run in zip(documents, tasks, strict=True):
            document["tasks"] = {"*": next(iter(of_run.values()))}
    return documents


def _flat(value: Any, path: Path = ()) -> Iterator[tuple[Path, str]]:
    """Yield the path and the text of each value; a list is one value."""
    if isinstance(value, Mapping) and value:
        for name, item in value.items():
            yield from _flat(item, (*path, name))
    else:
        yield path, value if isinstance(value, str) else msgspec.json.encode(value).decode()


def _begins(path: Path, pattern: Sequence[str]) -> bool:
    return len(path) >= len(pattern) and all(
        wanted in ("*", name) for wanted, name in zip(pattern, path, strict=False)
    )
