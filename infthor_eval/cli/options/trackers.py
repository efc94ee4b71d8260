"""The options that send finished runs to trackers, named as lm-eval names them."""

import functools
from collections.abc import Callable
from typing import Any

import click

from infthor_eval.cli.options.values import pairs_in

__all__ = ["TRACKERS", "tracker_options"]

_HELP = {
    "wandb_args": "Send finished runs to Weights & Biases: arguments of wandb.init (project=NAME).",
    "trackio_args": "Send finished runs to trackio: arguments of trackio.init (project=NAME).",
    "hf_hub_log_args": "Push finished runs to the hub: lm-eval's arguments (push_results_to_hub=True).",
}


TRACKERS = tuple(_HELP)  # the parameters of the options


def tracker_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the trackers' options to a command, which is given what was typed, by option, as `trackers`."""

    @functools.wraps(command)
    def with_trackers(**given: Any) -> Any:
        typed = {name: given.pop(name) for name in _HELP}
        found = {name: pairs_in(text.split(","), _typed(name)) for name, text in typed.items() if text is not None}
        return command(trackers=found, **given)

    options = (click.option(_typed(name), metavar="K=V,...", help=told) for name, told in reversed(_HELP.items()))
    return functools.reduce(lambda wrapped, option: option(wrapped), options, with_trackers)


def _typed(name: str) -> str:
    return f"--{name.replace('_', '-')}"
