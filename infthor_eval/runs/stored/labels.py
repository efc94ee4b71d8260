"""Labels of runs shown together: their names, and options that differ where names are equal."""

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path, PurePath

from infthor_eval.runs.journals.records import RunHeader
from infthor_eval.runs.stored.command import read_stored_command

# Options that change no number, and the tasks, which every table has a column for.
_NOT_SHOWN = {
    "out",
    "workers",
    "ray_address",
    "gpus_per_worker",
    "include_path",
    "name",
    "tasks",
}
_LONGEST_TASKS = 60  # characters of the tasks in a label


def label_runs(
    runs: Sequence[tuple[Path, RunHeader]], ignore: Collection[str] = (), *, by_task: bool = False
) -> list[str]:
    """Return a label for each run.

    Runs of one suite and name are told apart by the options that differ: `qwen2.5-vl
    (dtype=float16)`. Runs of the same tasks that have equal options too get the names of their
    folders instead.

    Args:
        runs: folder and header of each run.
        ignore: options that the tables show anyway.
        by_task: whether runs of other tasks have other labels, too; frames are no part of these.
    """
    labels = _label_by_options(runs, ignore)
    return _label_by_task(labels, runs) if by_task else labels


def _label_by_task(labels: Sequence[str], runs: Sequence[tuple[Path, RunHeader]]) -> list[str]:
    """Return the labels; those of runs of one label and frames with their tasks or folders."""
    tasks = ["+".join(sorted(header.config.tasks))[:_LONGEST_TASKS] for _, header in runs]
    keys = [
        (label, header.suite, header.config.frames)
        for label, (_, header) in zip(labels, runs, strict=True)
    ]
    with_tasks = list(zip(keys, tasks, strict=True))
    told = list(labels)
    for position, (folder, _) in enumerate(runs):
        if keys.count(keys[position]) > 1:
            is_told_by_tasks = with_tasks.count(with_tasks[position]) == 1
            told[position] += f" ({tasks[position] if is_told_by_tasks else folder.name})"
    return told


def _label_by_options(runs: Sequence[tuple[Path, RunHeader]], ignore: Collection[str]) -> list[str]:
    same_name = defaultdict(list)
    for position, (_, header) in enumerate(runs):
        same_name[header.suite, header.name].append(position)
    labels = [header.name for _, header in runs]
    for positions in same_name.values():
        if len(positions) > 1:  # otherwise no file is read
            alike = _label_alike([runs[position] for position in positions], ignore)
            for position, label in zip(positions, alike, strict=True):
                labels[position] = label
    return labels


def _label_alike(runs: Sequence[tuple[Path, RunHeader]], ignore: Collection[str]) -> Iterator[str]:
    """Yield the labels of runs of one name."""
    options = [
        {name: header.config.in_words(name, text) for name, text in _options(folder).items()}
        for folder, header in runs
    ]
    names = sorted({name for of_run in options for name in of_run} - set(ignore))
    values = {name: [of_run.get(name) for of_run in options] for name in names}
    shortened = {name: _shorten(texts) for name, texts in values.items() if len(set(texts)) > 1}
    # A run that differs in nothing but ignored options is another row of the same label.
    keys = [
        (of_run, sorted(header.config.tasks))
        for of_run, (_, header) in zip(options, runs, strict=True)
    ]
    for of_run, key, (folder, header) in zip(options, keys, runs, strict=True):
        differing = ", ".join(
            f"{name}={texts[of_run[name]]}" for name, texts in shortened.items() if name in of_run
        )
        remarks = [
            *([differing] if differing else []),
            *([folder.name] if keys.count(key) > 1 else []),
        ]
        yield f"{header.name} ({', '.join(remarks)})" if remarks else header.name


def _options(folder: Path) -> dict[str, str]:
    """Return the options of a run's command as text, those of the model among them."""
    command = read_stored_command(folder)
    every = dict(command.options) if command else {}
    of_model = every.pop("model_args", None)
    if isinstance(of_model, Mapping):
        every |= of_model
    return {name: str(value) for name, value in every.items() if name not in _NOT_SHOWN}


def _shorten(values: Sequence[str | None]) -> Mapping[str, str]:
    """Return the values as they are; paths without the folders that all of them share."""
    known = sorted({value for value in values if value is not None})
    parts = {value: PurePath(value).parts for value in known}
    if not all(PurePath(value).is_absolute() for value in known):
        return {value: value for value in known}
    shortest = min(map(len, parts.values())) - 1  # the last part is always shown
    n_shared = next(
        (n for n in range(shortest) if len({path[n] for path in parts.values()}) > 1), shortest
    )
    return {value: str(PurePath(*path[n_shared:])) for value, path in parts.items()}
