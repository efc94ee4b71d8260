"""A task of NIEH: its file, its samples, and how their replies become records."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any, Literal

from infthor_eval.errors import DataError, UsageError, unknown_name
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.memory import memory_class, parse_options, read_budget
from infthor_eval.nieh.config import MetricsConfig, NiehTaskConfig, SkippedSample
from infthor_eval.nieh.contexts import (
    CONTEXTS,
    DEFAULT_CONTEXT,
    MEMORY,
    ContextSettings,
    check_prompt,
)
from infthor_eval.nieh.metrics import PUBLISHED, Metrics, metrics_of
from infthor_eval.nieh.options import OTHER, NiehOptions
from infthor_eval.nieh.other_homes import without_alike
from infthor_eval.nieh.samples import TaskSamples, find_samples, find_set
from infthor_eval.runs import TaskFile, TaskRequest
from infthor_eval.runs.generation_kwargs import decoding_of
from infthor_eval.settings import check_names, read
from infthor_eval.storage.folders import packaged_folder
from model_adapters import Decoding

# Keys of `dataset_kwargs` beside the settings of contexts.
_OF_SETS = ("leaves_open", "data", "bundled")
_NEEDED = (
    "custom_dataset",
    "dataset_kwargs",
    "doc_to_text",
    "generation_kwargs",
    "process_results",
    "test_split",
)


@dataclass(frozen=True)
class PreparedTask:
    """A task with what turns samples into records; `generation_kwargs` in lm-eval's words.

    Attributes:
        stop: see `infthor_eval.questions.asking.Request`.
    """

    task_samples: TaskSamples
    decoding: Decoding
    generation_kwargs: Mapping[str, Any]
    metrics: Metrics = PUBLISHED
    stop: tuple[str, ...] = ()


class NiehTask:
    """A task file, as far as it can be read before the model is loaded.

    Attributes:
        settings: contents of its file; with the run's context, if it leaves that open.
        needs_size: True if the samples depend on the model's tokens per frame.
        task_samples: the samples; None if they depend on the model.
    """

    def __init__(self, file: TaskFile, request: TaskRequest[NiehOptions]) -> None:
        """Check the file and find its samples, unless they depend on the model."""
        file.require(*_NEEDED)
        check_task_file(file)
        self.name = file.name
        own = file.settings["dataset_kwargs"]
        leaves_context_open = _leaves_context_open(own)
        if leaves_context_open:
            own = _context_of(request.options) | own
        self.settings: Mapping[str, Any] = {**file.settings, "dataset_kwargs": own}
        self._limit = request.limit
        self._config: dict[str, Any] = _run_settings(request) | own
        self._generation_kwargs = _drawn(file.settings["generation_kwargs"], request.options)
        self.decoding: Decoding = decoding_of(self._generation_kwargs, request.seed, str(file.path))
        self._max_thinking_tokens = request.options.max_thinking_tokens
        self.metrics: Metrics = metrics_of(file)
        self.data: NiehSet = find_set(**self._config)
        # A budget of a memory is in tokens, too.
        self.needs_size = (
            CONTEXTS[self._config["context"]].needs_model or self._config.get("budget") is not None
        )
        self._takes = {
            "context": leaves_context_open,
            "memory": self._config["context"] == MEMORY and "memory" not in own,
            "prompt": "prompt" not in own,
            "size": self.needs_size,
        }
        self.task_samples: TaskSamples | None = (
            None if self.needs_size else find_samples(self._config, self._limit)
        )

    @cached_property
    def sources(self) -> Mapping[str, Any]:
        """Whatever the frames depend on besides the set and the settings (`Context.sources`)."""
        if self.task_samples is not None:
            return self.task_samples.sources
        settings = read(ContextSettings, self._config)
        return CONTEXTS[self._config["context"]].sources(self.data, settings)

    @cached_property
    def cuts_cache(self) -> bool:
        """True if its memory is one of the model's cache."""
        name = self._config.get("memory")
        if self._config["context"] != MEMORY or name is None:
            return False
        capabilities = getattr(memory_class(name), "capabilities", None)
        return getattr(capabilities, "cache", None) is not None

    def takes(self, where: str) -> bool:
        """Return whether options that apply there (`Setting.where`) have an effect on it."""
        taken = self._takes.get(where)
        return where in self.sources if taken is None else taken  # which takes long to find

    def prepare(self, tokens_per_frame: int | None) -> PreparedTask:
        """Prepare the task for a model, given a frame's tokens where samples depend on them."""
        samples = self.task_samples
        if samples is None:
            samples = find_samples(
                self._config | {"tokens_per_frame": tokens_per_frame}, self._limit
            )
        if self._max_thinking_tokens is None:
            return PreparedTask(samples, self.decoding, self._generation_kwargs, self.metrics)
        n_tokens = self.decoding.max_new_tokens + self._max_thinking_tokens
        decoding = replace(self.decoding, max_new_tokens=n_tokens, stop=())
        settings = {**self._generation_kwargs, "max_gen_toks": n_tokens}
        return PreparedTask(samples, decoding, settings, self.metrics, self.decoding.stop)

    def config(self, prepared: PreparedTask, video_input: bool | None) -> NiehTaskConfig:
        """Return everything that the numbers of the task depend on.

        Args:
            prepared: the task, prepared for a model.
            video_input: True if the model is given films as videos, False if as images; None if it
                sees nothing.
        """
        samples = prepared.task_samples
        film: Literal["video", "images"] | None = None
        if samples.shows_films and video_input is not None:
            film = "video" if video_input else "images"
        without: tuple[str, ...] = ()
        if samples.frame_ablation.frames == OTHER:
            without = without_alike(samples.data, [it.question for it in samples.samples])
        return NiehTaskConfig(
            settings=dict(self.settings),
            decoding=prepared.decoding.document(),
            metrics=MetricsConfig(names=prepared.metrics.names, **prepared.metrics.code),
            data=samples.data.fingerprint,
            simulator=samples.data.simulator,
            sources=dict(samples.sources),
            n_samples=len(samples.samples),
            skipped=tuple(
                SkippedSample(question_id=it.question.id, variant=it.variant, reason=it.reason)
                for it in samples.skipped
            ),
            film=film,
            without_alike=without,
            withheld=any(it.question.is_withheld for it in samples.samples),
        )


def check_task_file(file: TaskFile) -> None:
    """Check `dataset_kwargs`, so that no setting is without effect, as a misspelt one would be."""
    file.require("dataset_kwargs")
    location = f"{file.path}: dataset_kwargs"
    raw = file.settings["dataset_kwargs"]
    if isinstance(raw, Mapping):
        check_names(ContextSettings, raw, location, _OF_SETS)
    if not isinstance(raw, Mapping) or not (
        isinstance(raw.get("context"), str) or _leaves_context_open(raw)
    ):
        raise DataError(
            f"{location} must be a mapping with the name of a context (context: NAME, or "
            "leaves_open: context)"
        )
    for key in _OF_SETS:
        if not isinstance(raw.get(key, ""), str):
            raise DataError(f"{location}: {key} is {raw[key]!r:.60}; it is a name")
    settings = read(ContextSettings, raw, location)
    if "context" in raw:
        _check_context(raw["context"], settings, location)
    if "bundled" in raw:
        try:
            packaged_folder(f"sets/{raw['bundled']}")
        except DataError as error:
            raise DataError(f"{location}: bundled is {raw['bundled']!r:.60}: {error}") from error


def _leaves_context_open(dataset_kwargs: Mapping[str, Any]) -> bool:
    """Return True for a task whose context the run names."""
    return "context" not in dataset_kwargs and dataset_kwargs.get("leaves_open") == "context"


def _check_context(name: str, settings: ContextSettings, location: str) -> None:
    context = CONTEXTS.get(name)
    if context is None:
        raise UsageError(f"{location}: context is {name!r:.60}; it is one of {', '.join(CONTEXTS)}")
    try:
        check_prompt(name, settings.words)
    except UsageError as error:
        raise UsageError(f"{location}: {error}") from error
    if context.needs_model and settings.ctx_size is None:
        raise UsageError(
            f"{location}: ctx_size is missing; {name} needs it, a number of kilo-tokens above 0"
        )


def _context_of(options: NiehOptions) -> dict[str, Any]:
    """Return the settings of a run's context, for a task that leaves it open."""
    name = options.context or DEFAULT_CONTEXT
    if name not in CONTEXTS:
        raise unknown_name("context", name, CONTEXTS)
    if CONTEXTS[name].needs_model and options.ctx_size is None:
        raise UsageError(f"--context {name}: needs a size; give --ctx-size in kilo-tokens")
    size = {} if options.ctx_size is None else {"ctx_size": options.ctx_size}
    return {"context": name} | size


def _drawn(generation_kwargs: Any, options: NiehOptions) -> Any:
    """Return generation settings with drawn replies, if the run wants them or repeats questions."""
    if not isinstance(generation_kwargs, Mapping):
        return generation_kwargs  # refused where it is read
    own = generation_kwargs.get("temperature") or None
    greedy = not generation_kwargs.get("do_sample", own is not None)
    if options.temperature is None and not (greedy and options.repeats > 1):
        return generation_kwargs
    temperature = own or 1.0 if options.temperature is None else options.temperature
    return {**generation_kwargs, "do_sample": True, "temperature": temperature}


def _run_settings(request: TaskRequest[NiehOptions]) -> dict[str, Any]:
    """Return the settings that a run gives to its tasks; those of their files go before them."""
    options = {"data": str(request.data) if request.data else None, **asdict(request.options)}
    options["budget"] = read_budget(request.options.budget)
    options["memory_args"] = parse_options(request.options.memory_args)
    return {"seed": request.seed} | {
        key: value for key, value in options.items() if value is not None
    }
