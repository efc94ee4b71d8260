"""`infthor-eval run`: evaluate a model on tasks."""

from pathlib import Path

import click

__all__ = ["command"]


@click.command("run")
@click.option("--model", "models", required=True, help="Model name, or several with commas (see `ls models`).")
@click.option("--tasks", required=True, help="Task or group names with commas (see `ls tasks`).")
@click.option("--data", type=click.Path(path_type=Path), help="Folder of the NIEH set to ask about.")
@click.option("--model-args", default="", metavar="K=V,...", help="Options of the model (see `ls models`).")
@click.option("--limit", type=click.IntRange(min=1), help="Ask only the first N questions of each task.")
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    default=Path("results"),
    show_default=True,
    help="Results folder.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="For whatever is random.")
def command(
    models: str, tasks: str, data: Path | None, model_args: str, limit: int | None, output: Path, seed: int
) -> int:
    """Evaluate MODEL on TASKS and print the results beside the published ones.

    Stop it whenever you like: the same command goes on where it was.
    """
    from infthor_eval.cli.evaluate import evaluate
    from infthor_eval.runs import RunRequest

    requests = [
        RunRequest(
            model=model,
            tasks=_names(tasks, "--tasks"),
            output=output,
            data=data,
            model_options=_options(model_args),
            limit=limit,
            seed=seed,
        )
        for model in _names(models, "--model")
    ]
    return evaluate(requests)


def _names(text: str, option: str) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    if not names:
        raise click.UsageError(f"{option} is empty; give a name")
    return names


def _options(text: str) -> dict[str, str]:
    """Options written as lm-eval writes them: `k=v,k=v`."""
    options: dict[str, str] = {}
    for item in filter(None, (part.strip() for part in text.split(","))):
        key, equals, value = item.partition("=")
        if not equals or not key.strip():
            raise click.UsageError(f"--model-args: {item!r} is not of the form key=value")
        if key.strip() in options:
            raise click.UsageError(f"--model-args: {key.strip()!r} is given twice")
        options[key.strip()] = value.strip()
    return options
