"""The config of a run: everything that can change a number. Its hash names the run's folder."""

from collections.abc import Mapping, Sequence
from typing import Any, Generic, Self, TypeVar

import msgspec

import infthor_eval
from infthor_eval.errors import DataError, in_one_line
from infthor_eval.quantities import Count
from infthor_eval.storage.digests import fingerprint, json_values


class TaskConfig(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The config of a task; a suite adds fields in a subclass.

    Attributes:
        settings: contents of the task file ("config" in the journal).
    """

    settings: dict[str, Any] = msgspec.field(name="config", default_factory=dict)

    @property
    def dataset_kwargs(self) -> Mapping[str, Any]:
        """The settings of the suite in the task file."""
        settings = self.settings.get("dataset_kwargs")
        return settings if isinstance(settings, Mapping) else {}

    @property
    def skip_reasons(self) -> Sequence[str]:
        """Why units of the task could not be evaluated, a reason each."""
        return ()


TaskConfigType = TypeVar("TaskConfigType")


class RunConfig(
    msgspec.Struct, Generic[TaskConfigType], frozen=True, kw_only=True, omit_defaults=True
):
    """The config of a run, as it is in the header of its journal.

    A suite adds fields in a subclass and fills them in; the run fills in what all runs have
    (`complete`). A field with its default is not written: one that is added later leaves the hashes
    of runs without it as they are.

    Attributes:
        infthor_eval: version of this package.
        suite: name of the suite.
        model: name and identity of the model, policy or baseline.
        adapter: identity of a model adapter that is not this package's
            (`model_adapters.adapter_identity`).
        suite_code: package, version and digest of a suite that is not this package's.
        limit: number of items of each task; None for all.
        seed: seed of the run.
        tasks: configs of the tasks by name.
        frames: the frame ablation ("shown": none).
        simulator: the simulator that episodes are in; "" for none.
        host: the harness whose requests are answered; "" for this one.
    """

    infthor_eval: str = ""
    suite: str = ""
    model: dict[str, Any] = {}
    adapter: dict[str, Any] = {}
    suite_code: dict[str, Any] = {}
    limit: Count | None = None
    seed: int | None = None
    tasks: dict[str, TaskConfigType] = {}
    frames: str = ""
    simulator: str = ""
    host: str = ""

    def complete(
        self,
        suite: str,
        model: Mapping[str, Any],
        *,
        adapter: Mapping[str, Any] | None = None,
        suite_code: Mapping[str, Any] | None = None,
        limit: int | None = None,
        seed: int = 0,
    ) -> Self:
        """Return the config with what all runs have, as it is read back from a journal.

        Raises:
            DataError: a value in it is none of JSON's; the message names the field.
        """
        whole = msgspec.structs.replace(
            self,
            infthor_eval=infthor_eval.__version__,
            suite=suite,
            model=dict(model),
            adapter=dict(adapter or {}),
            suite_code=dict(suite_code or {}),
            limit=limit,
            seed=seed,
        )
        try:
            document = msgspec.to_builtins(whole, str_keys=True, enc_hook=_plain_text)
            json_values(document, "config")
        except (TypeError, ValueError, RecursionError) as error:
            raise DataError(
                f"the config of the run cannot be kept ({in_one_line(error)}); change that setting"
            ) from error
        return msgspec.json.decode(whole._encode(), type=type(self))

    @property
    def simulators(self) -> list[str]:
        """Names of the simulators that the frames are from."""
        return [self.simulator] if self.simulator else []

    def in_words(self, name: str, value: str) -> str:
        """Return the value of an option, by its name, as people read it."""
        return value

    @property
    def document(self) -> dict[str, Any]:
        """The config as JSON values."""
        document: dict[str, Any] = msgspec.json.decode(self._encode())
        return document

    def _encode(self) -> bytes:
        return msgspec.json.encode(self, enc_hook=_plain_text)

    @property
    def hash(self) -> str:
        """The hash that names the run's folder (hex, 16 characters)."""
        return fingerprint(self.document)

    def differing(self, other: "RunConfig[Any]") -> list[str]:
        """Return the names of the fields that another config has otherwise."""
        mine = self.document
        theirs = other.document
        return sorted(name for name in {*mine, *theirs} if mine.get(name) != theirs.get(name))


def _plain_text(value: Any) -> str:
    """Return a text of a type of its own, such as torch's version, as a plain one."""
    if isinstance(value, str):
        return str(value)
    raise TypeError(f"{type(value).__name__} cannot be written into a run's config")


def require_tasks(config: RunConfig[Any], run: str) -> None:
    """Check that a config has tasks; that of a journal of another harness's requests has none."""
    if not config.tasks:
        raise DataError(
            f"{run}: not the config of a run of {config.suite or 'a suite'} (it has no tasks); run "
            "the evaluation again"
        )


Config = TypeVar("Config", bound=RunConfig[Any])
