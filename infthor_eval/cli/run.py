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
@click.option(
    "--rope", metavar="KIND:FACTOR", help="Extend the model's context: yarn:4, linear:2, dynamic:4, longrope:8."
)
@click.option(
    "--k-tokens",
    type=click.Choice(["1000", "1024"]),
    help="Tokens of a kilo-token where a context has a size; the published value of each context if not given.",
)
@click.option("--retriever", metavar="NAME", help="CLIP model of retrieval tasks, a hub id or a folder.")
@click.option("--retriever-revision", metavar="REVISION", help="Branch, tag or commit of the retriever on the hub.")
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
    models: str,
    tasks: str,
    data: Path | None,
    model_args: str,
    rope: str | None,
    k_tokens: str | None,
    retriever: str | None,
    retriever_revision: str | None,
    limit: int | None,
    output: Path,
    seed: int,
) -> int:
    """Evaluate MODEL on TASKS and print the results beside the published ones.

    Stop it whenever you like: the same command goes on where it was.
    """
    from infthor_eval.cli.evaluate import evaluate
    from infthor_eval.runs import RunRequest

    options = model_options_in(model_args)
    if rope is not None:
        if "rope" in options:
            raise click.UsageError("--rope and rope= in --model-args are the same option; give one of them")
        options["rope"] = rope
    requests = [
        RunRequest(
            model=model,
            tasks=names_in(tasks, "--tasks"),
            output=output,
            data=data,
            model_options=options,
            limit=limit,
            k_tokens=int(k_tokens) if k_tokens else None,
            retriever=retriever,
            retriever_revision=retriever_revision,
            seed=seed,
        )
        for model in names_in(models, "--model")
    ]
    return evaluate(requests)
