"""Our runs in experiment trackers and on the hub, through lm-eval's own loggers.

To add a tracker: here, its option in `infthor_eval/cli/options/show.py`, its row in
`docs/howto/trackers.md`.
"""

import difflib
import importlib.util
import inspect
import logging
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from infthor_eval.errors import UsageError, in_one_line, wrap_errors
from infthor_eval.exports.lm_eval import Exported, convert_run
from infthor_eval.harness.registration import NAME
from infthor_eval.runs import RunOutcome
from infthor_eval.storage.scratch import ScratchFolder

Arguments = Mapping[str, str]
_OURS = {"self", "output_path", "token", "init_args", "step"}  # arguments that are not a user's


class Trackers:
    """The trackers to which finished runs are sent."""

    def __init__(
        self,
        wandb_args: Arguments | None = None,
        trackio_args: Arguments | None = None,
        hf_hub_log_args: Arguments | None = None,
    ) -> None:
        """Check the arguments of `wandb.init`, `trackio.init`, `EvaluationTracker`; None if
        unused."""
        trackers = (
            ("Weights & Biases", _to_wandb, _init_arguments("wandb", wandb_args)),
            ("trackio", _to_trackio, _init_arguments("trackio", trackio_args)),
            ("the hub", _to_hub, _hub_arguments(hf_hub_log_args)),
        )
        self._used = [(service, send, args) for service, send, args in trackers if args is not None]

    def send(self, outcome: RunOutcome) -> None:
        """Send a run to all trackers."""
        if not self._used:
            return
        converted = convert_run(outcome)
        for service, send, args in self._used:
            problem = f"{outcome.folder}: could not be sent to {service}"
            with wrap_errors(problem, "run the same command again", catch=Exception):
                send(converted, outcome.summary.header.name, args)


def _to_wandb(run: Exported, name: str, args: Mapping[str, Any]) -> None:
    from lm_eval.loggers import WandbLogger

    logger = WandbLogger({"name": name, **args})
    try:
        logger.post_init(run.results)
        logger.log_eval_result()
        logger.log_eval_samples(_as_evaluated(run))
    finally:
        logger.run.finish()


def _to_trackio(run: Exported, name: str, args: Mapping[str, Any]) -> None:
    from lm_eval.loggers import TrackioLogger

    logger = TrackioLogger({"name": name, **args})
    try:
        logger.post_init(run.results)
        with _raise_failures("lm_eval.loggers.trackio_logger"):
            logger.log_eval_result()
            logger.log_eval_samples(_as_evaluated(run))
    finally:
        logger.finish()


def _to_hub(run: Exported, name: str, args: Mapping[str, Any]) -> None:
    from lm_eval.loggers import EvaluationTracker

    with (
        ScratchFolder() as folder,
        _raise_failures("lm_eval.loggers.evaluation_tracker"),
    ):
        tracker = EvaluationTracker(output_path=str(folder), **args)
        tracker.general_config_tracker.log_experiment_args(NAME, {"model": name}, None, None, False)
        samples = _as_evaluated(run)
        tracker.save_results_aggregated(dict(run.results), samples)
        for task, rows in samples.items():
            tracker.save_results_samples(task, rows)
        tracker.recreate_metadata_card()


def _init_arguments(package: str, typed: Arguments | None) -> dict[str, Any] | None:
    if typed is None:
        return None
    if importlib.util.find_spec(package) is None:
        raise UsageError(f"--{package}-args needs the package {package}; pip install {package}")
    init = importlib.import_module(package).init
    return _parse(f"--{package}-args", typed, [*inspect.signature(init).parameters, "step"])


def _hub_arguments(typed: Arguments | None) -> dict[str, Any] | None:
    """Return the arguments of lm-eval's tracker, with the token of the environment or of `hf auth
    login`."""
    if typed is None:
        return None
    from huggingface_hub import get_token
    from lm_eval.loggers import EvaluationTracker

    option = "--hf-hub-log-args"
    known = [name for name in inspect.signature(EvaluationTracker).parameters if name not in _OURS]
    args = _parse(option, typed, known)
    if not (args.get("push_results_to_hub") or args.get("push_samples_to_hub")):
        raise UsageError(
            f"{option} would push nothing; add push_results_to_hub=True or push_samples_to_hub=True"
        )
    token = os.environ.get("HF_TOKEN") or get_token()
    if not token:
        raise UsageError(
            f"{option} needs a token of the hub; set HF_TOKEN, or log in with `hf auth login`"
        )
    return {**args, "token": token}


def _parse(option: str, typed: Arguments, names: list[str]) -> dict[str, Any]:
    """Return typed arguments as values (numbers, True and False, texts); refuse unknown names."""
    from lm_eval.utils import handle_arg_string

    for name in typed:
        if name not in names:
            near = difflib.get_close_matches(name, names, n=1)
            raise UsageError(
                f"{option} has no {name}; "
                f"{f'did you mean {near[0]}?' if near else f'there are {names}'}"
            )
    return {name: handle_arg_string(value) for name, value in typed.items()}


def _as_evaluated(run: Exported) -> dict[str, list[dict[str, Any]]]:
    """Return the samples as lm-eval has them before it writes them: with pairs of arguments."""
    samples: dict[str, list[dict[str, Any]]] = {}
    for task, rows in run.samples.items():
        samples[task] = []
        for row in rows:
            arguments = row["arguments"]["gen_args_0"]
            samples[task].append(row | {"arguments": [(arguments["arg_0"], arguments["arg_1"])]})
    return samples


@contextmanager
def _raise_failures(name: str) -> Iterator[None]:
    """Raise RuntimeError for a failure, which lm-eval's loggers only log."""
    messages: list[str] = []
    handler = logging.Handler(logging.INFO)
    handler.emit = lambda record: messages.append(_message(record))  # type: ignore[method-assign]
    logger = logging.getLogger(name)
    level = logger.level
    logger.setLevel(logging.INFO)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)
    failed = [
        number for number, text in enumerate(messages) if text.startswith(("Could not", "Failed"))
    ]
    if failed:
        raise RuntimeError(" ".join(messages[failed[0] : failed[0] + 2]))


def _message(record: logging.LogRecord) -> str:
    reason = record.exc_info[1] if record.exc_info else None
    return record.getMessage() + (f": {in_one_line(reason)}" if reason is not None else "")
