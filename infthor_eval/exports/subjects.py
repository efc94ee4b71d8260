"""Who was evaluated: a run's model as others name models, from its identity."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

from infthor_eval.errors import UsageError
from infthor_eval.run import Run
from infthor_eval.runs import RunHeader

UNKNOWN = "unknown"
_OWN = "infthor-eval"  # developer of baselines
_LOCAL = ("localhost", "127.0.0.1", "::1")


@dataclass(frozen=True)
class ModelFacts:
    """A model as others name it.

    Attributes:
        name: name in the run's tables.
        id: `developer/name`, as on the hub where it is there.
        revision: commit of the checkpoint on the hub, or hash of its files; empty if not known.
        engine: name of the library that ran it; empty if not known.
        engine_version: its version.
        platform: address of the server that ran it; empty for none.
        deployment: who ran it: "self_deployed", "externally_managed" or "unknown".
        availability: "open_weights" or "unknown".
        identity: all that is known of it, as JSON values.
    """

    name: str
    id: str
    revision: str
    engine: str
    engine_version: str
    platform: str
    deployment: str
    availability: str
    identity: Mapping[str, Any]

    @property
    def developer(self) -> str:
        """Its developer; "unknown" if the run does not know it."""
        return self.id.partition("/")[0]

    @property
    def short_name(self) -> str:
        """Its name without the developer."""
        return self.id.partition("/")[2]


def require_one_model(headers: Sequence[RunHeader[Any]]) -> None:
    """Check that runs are of one model, as `--model-id` names all of them."""
    for header in headers:
        if _id(header.config.model, header.name) != _id(headers[0].config.model, headers[0].name):
            raise UsageError(
                f"--model-id: names one model, and {header.name} is another than "
                f"{headers[0].name}; export the runs of each in a call of its own"
            )


def model_facts(run: Run, model_id: str | None = None) -> ModelFacts:
    """Return what a run says of its model; `model_id` is its name where that is wrong.

    The name is the run's own: the one that tells it from other runs beside it has options, and
    folders of this machine among them. A checkpoint of the hub names its developer and has open
    weights; of a folder and of a server neither is known.
    """
    header = run.own_header
    identity: Mapping[str, Any] = header.config.model
    engine, engine_version = engine_of(identity)
    platform, deployment = _place(identity)
    return ModelFacts(
        name=header.name,
        id=model_id or _id(identity, header.name),
        revision=str(identity.get("revision") or identity.get("fingerprint") or ""),
        engine=engine,
        engine_version=engine_version,
        platform=platform,
        deployment=deployment,
        availability="open_weights" if "revision" in identity else UNKNOWN,
        identity=identity,
    )


def _id(identity: Mapping[str, Any], name: str) -> str:
    if "baseline" in identity:
        return f"{_OWN}/{identity['baseline']}"
    named = str(identity.get("checkpoint") or identity.get("model") or identity.get("name") or name)
    developer, _, rest = named.partition("/")
    return named if developer and rest else f"{UNKNOWN}/{named.replace('/', '_') or name}"


def engine_of(identity: Mapping[str, Any]) -> tuple[str, str]:
    """Return library and version that ran a model, by its identity; empty if not known."""
    if "baseline" in identity:
        import infthor_eval

        return _OWN, infthor_eval.__version__
    versions = identity.get("versions")
    if isinstance(versions, Mapping):
        for library in ("vllm", "transformers", "torch"):
            if library in versions:
                return library, str(versions[library])
    return "", ""


def _place(identity: Mapping[str, Any]) -> tuple[str, str]:
    """Return the server that ran the model, and who ran it."""
    address = identity.get("base_url") or identity.get("url")
    if isinstance(address, str):
        host = urlsplit(address).hostname or ""
        return host, "self_deployed" if host in _LOCAL else "externally_managed"
    ran_here = "baseline" in identity or "checkpoint" in identity
    return "", "self_deployed" if ran_here else UNKNOWN
