"""The config of a run of NIEH."""

import re
from typing import TYPE_CHECKING, Annotated, Any, Literal

import msgspec
from msgspec import Meta

from infthor_eval.memory import read_budget
from infthor_eval.nieh.options import NiehOptions, NiehSettings
from infthor_eval.quantities import MOST, Count
from infthor_eval.runs import RunConfig, TaskConfig
from infthor_eval.settings import with_settings


class MetricsConfig(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The metrics of a task, and what tells them from others of their names.

    Attributes:
        names: names in the order of tables.
        strict: version of the strict scorer's rules.
        process_results: the task's own function.
        source: digest of its source.
    """

    names: Annotated[tuple[str, ...], Meta(min_length=1)]
    strict: str | None = None
    process_results: str | None = None
    source: str | None = None


class SkippedSample(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """A sample that cannot be asked, and why."""

    question_id: str
    reason: str
    variant: str = ""


class MemoryIdentity(msgspec.Struct, frozen=True):
    """The memory of a task; a privileged one is given what no agent can know."""

    name: str
    privileged: bool


def _is_count_or_none(value: Any) -> bool:
    return value is None or (isinstance(value, int) and 0 <= value <= MOST)


class NiehTaskConfig(TaskConfig, frozen=True, kw_only=True, omit_defaults=True):
    """The config of a task.

    Attributes:
        decoding: how replies are decoded, as `Decoding.document` has it.
        data: fingerprint of the set.
        simulator: simulator that rendered its frames; None if the set does not say.
        sources: what the frames depend on besides the set and the settings.
        film: how the model is given films; None where there are none.
        withheld: True if the gold answers are secret: scores are 0 until their owner gives the key.
        without_alike: trajectories that other homes of another kind of room stand for, as the set
            has no further one of theirs.
    """

    decoding: dict[str, Any]
    metrics: MetricsConfig
    data: str
    simulator: str | None
    n_samples: Count
    skipped: tuple[SkippedSample, ...]
    sources: dict[str, Any] = msgspec.field(default_factory=dict)
    film: Literal["video", "images"] | None = None
    without_alike: tuple[str, ...] = ()
    withheld: bool = False

    def __post_init__(self) -> None:
        """Check what summaries read; msgspec turns the error into its own."""
        if not isinstance(self.dataset_kwargs.get("context"), str):
            raise TypeError("`config.dataset_kwargs.context` is no name")
        if not _is_count_or_none(self.budget):
            raise TypeError("`config.dataset_kwargs.budget` is no number of tokens")
        if "max_new_tokens" not in self.decoding:
            raise TypeError("`decoding.max_new_tokens` is missing")
        # None for imported replies, whose limit nobody wrote down.
        if not _is_count_or_none(self.decoding["max_new_tokens"]):
            raise TypeError("`decoding.max_new_tokens` is no number of tokens")
        _ = self.memory

    @property
    def skip_reasons(self) -> list[str]:
        """See `TaskConfig`: of each skipped sample."""
        return [sample.reason for sample in self.skipped]

    @property
    def context(self) -> str:
        """Name of the context."""
        return str(self.dataset_kwargs["context"])

    @property
    def budget(self) -> int | None:
        """The task's own budget of what its memory recalls, tokens; None to take the run's."""
        budget: int | None = self.dataset_kwargs.get("budget")
        return budget

    @property
    def memory(self) -> MemoryIdentity | None:
        """The memory; None if the task has none."""
        memory = self.sources.get("memory")
        return None if memory is None else msgspec.convert(memory, MemoryIdentity)


class SourceRun(msgspec.Struct, frozen=True):
    """The run whose replies were scored again: its name, and the hash of its config."""

    name: str
    config: str


class RescoredConfig(msgspec.Struct, frozen=True, kw_only=True):
    """Who scored the replies of a run again.

    Attributes:
        source: the run that they come from; None where that does not matter.
        scorer: identity of a scorer of one's own; None for none.
        judge: identity of a judge; None for none.
    """

    source: SourceRun | None = msgspec.field(name="from")
    scorer: dict[str, Any] | None
    judge: dict[str, Any] | None


if TYPE_CHECKING:

    class _KeptSettings(RunConfig[NiehTaskConfig], NiehOptions, frozen=True): ...

else:
    _KeptSettings = with_settings(
        with_settings(RunConfig[NiehTaskConfig], NiehSettings),  # first, as in runs of before
        NiehOptions,
    )


class NiehConfig(_KeptSettings, frozen=True, kw_only=True, omit_defaults=True):
    """The config of a run, with those of `NiehOptions` that are `in_config`.

    Attributes:
        rescored: who scored its replies again; None for a run that asked.
    """

    rescored: RescoredConfig | None = None

    @property
    def simulators(self) -> list[str]:
        """Names of the simulators that rendered the frames."""
        return sorted({task.simulator for task in self.tasks.values() if task.simulator})

    def in_words(self, name: str, value: str) -> str:
        """See `RunConfig`: a budget with what it is in frames."""
        # What stands in the `run.yaml` of others need be no budget.
        is_budget = name == "budget" and re.fullmatch(r"[1-9]\d{0,5}k?", value, re.ASCII)
        return value + self.in_frames(read_budget(value)) if is_budget else value

    def in_frames(self, tokens: int | None) -> str:
        """Return " [3 frames]" for a budget in tokens that is whole frames, else an empty text."""
        if not tokens or not self.tokens_per_frame or tokens % self.tokens_per_frame:
            return ""
        n = tokens // self.tokens_per_frame
        return f" [{n} frame{'s' if n > 1 else ''}]"
