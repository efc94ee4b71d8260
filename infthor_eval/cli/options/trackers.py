"""The options that send finished runs to trackers, named as lm-eval names them."""

from collections.abc import Callable, Mapping
from typing import Any

import click

from infthor_eval.cli.options.values import parse_pairs

__all__ = ["parse_trackers", "tracker_options"]

_HELP = {
    "wandb_args": "Send finished runs to Weights & Biases: arguments of wandb.init (project=NAME).",
    "trackio_args": "Send finished runs to trackio: arguments of trackio.init (project=NAME).",
    "hf_hub_log_args": "Push finished runs to the hub: lm-eval's arguments "
    "(push_results_to_hub=True).",
}


def tracker_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add an option for each tracker to a command, which passes them to `parse_trackers`."""
    for name, text in reversed(_HELP.items()):
        command = click.option(_option(name), metavar="K=V,...", help=text)(command)
    return command


def parse_trackers(given: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """Return the arguments of each tracker that is used, by option; `given` are the parameters of
    the command."""
    return {
        name: parse_pairs(given[name].split(","), _option(name))
        for name in _HELP
        if given[name] is not None
    }


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"
