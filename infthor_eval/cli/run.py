"""`infthor-eval run`: evaluate a model on tasks."""

from pathlib import Path

import click

from infthor_eval.cli.options import model_options_in, names_in

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
            tasks=names_in(tasks, "--tasks"),
            output=output,
            data=data,
            model_options=model_options_in(model_args),
            limit=limit,
            seed=seed,
        )
        for model in names_in(models, "--model")
    ]
    return evaluate(requests)
