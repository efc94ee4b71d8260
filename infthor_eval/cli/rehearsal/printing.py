"""A rehearsal on the terminal."""

from infthor_eval.cli.rehearsal.results import Attention, Images, Rehearsed
from infthor_eval.report.terminal import print_table, table_console
from infthor_eval.tables import Column, Row, Table

_GB = 1e9
_NONE = "-"


def print_rehearsed(found: Rehearsed) -> None:
    """Print what was found of a model, and the commands to type."""
    on = table_console()
    for line in _lines(found):
        on.print(line)
    print_table(_contexts(found), on)
    print_table(_gpus(found), on)
    commands = (f"  {command}" for command in found.commands)
    for line in (*_closing(found), "", "on the machine with the GPU:", *commands):
        on.print(line)


def _lines(found: Rehearsed) -> list[str]:
    largest = max(found.weights.values())
    # Tables of angles are in float32 and of no weight.
    weights = ", ".join(
        f"{kind} {_gb(size)}" for kind, size in found.weights.items() if size > largest / 1000
    )
    limit = "no limit" if found.limit is None else f"a limit of {found.limit:,} tokens"
    lines = [
        f"{found.model}: {found.checkpoint} (config: {found.source})",
        f"weights      {found.parameters:,} parameters, {weights} GB; {limit}",
    ]
    width, height = found.frames.size
    if found.frame_tokens is None:
        lines.append(f"frames       cannot be counted: {found.problem}; below, text alone")
    else:
        lines.append(f"frames       {found.frame_tokens} tokens for {width}x{height} pixels")
    lines += [f"attention    {_attention(call)}" for call in found.attention]
    flash = found.flash_problem or "it needs no mask, and repeats no keys"
    return [*lines, f"             flash_attention_2: {flash}"]


def _attention(call: Attention) -> str:
    given = "with a mask, which the flash kernel does not take" if call.has_mask else "no mask"
    return f"{call.of}: {call.kernel}, {given}; {call.calls} calls, heads of {call.head_size}"


def _contexts(found: Rehearsed) -> Table:
    names = ("cache GB", "activations GB", "questions together GB", "all GB", "with flash GB")
    rows = []
    for context in found.contexts:
        sizes = (context.cache, context.activations, context.together, context.total)
        flash = _NONE if context.with_flash is None else _gb(context.with_flash)
        rows.append(Row((f"{context.tokens:,}", *map(_gb, sizes), flash)))
    return Table("Memory of a context", (Column("tokens"), *map(Column, names)), tuple(rows))


def _gpus(found: Rehearsed) -> Table:
    names = ("largest context", "frames", "with flash_attention_2", "GPUs for the longest context")
    rows = []
    for gpu in found.gpus:
        frames = _NONE if gpu.frames is None else f"{gpu.frames:,}"
        flash = _NONE if gpu.tokens_with_flash is None else f"{gpu.tokens_with_flash:,}"
        rows.append(Row((f"{gpu.gigabytes} GB", f"{gpu.tokens:,}", frames, flash, str(gpu.needed))))
    title = "Largest context, in tokens, in nine tenths of a GPU's memory"
    return Table(title, (Column("GPU"), *map(Column, names)), tuple(rows))


def _closing(found: Rehearsed) -> list[str]:
    frames = found.frames
    lines = [_images(found.images)] if found.images is not None else []
    lines.append(
        f"set          {frames.trajectories:,} trajectories, the longest of {frames.longest:,} "
        f"frames; {frames.total:,} frames, {_gb(frames.disk)} GB on disk ({frames.source})"
    )
    for task in found.tasks:
        tokens = "its context is unknown without the set"
        if task.tokens is not None:
            tokens = f"up to {task.tokens:,} tokens"
            if found.limit is not None and task.tokens > found.limit:
                tokens += f", beyond the limit of {found.limit:,}: add --rope"
        lines.append(f"task         {task.name}: {tokens}")
    return lines


def _images(images: Images) -> str:
    ratio = images.by_gpu / images.here
    waits = "it need not wait for them"
    if ratio > 1:
        waits = f"it waits unless {ratio:.1f} cores prepare them"
    return (
        f"pictures     {images.here:.0f} frames/s are read and scaled on a core here "
        f"({images.measured} timed); an H100 encodes about {images.by_gpu:.1f} half-way along the "
        f"longest context (rates of benchmarks/cost.md): {waits}"
    )


def _gb(n_bytes: int) -> str:
    return f"{n_bytes / _GB:.2f}"
