"""NIEH results as tables: by clues beside published rows, by depth, form of replies, repeats."""

from collections.abc import Iterator, Sequence

from infthor_eval.facets import facet_table
from infthor_eval.formats.own_folder import OWN_FRAMES
from infthor_eval.formats.published import (
    PUBLISHED_DATA,
    PublishedRow,
    PublishedTable,
    published_tables,
)
from infthor_eval.formats.question import ABSENCE
from infthor_eval.nieh.options import SHOWN
from infthor_eval.nieh.rescoring.report import sources_of
from infthor_eval.nieh.results.answer_form import form_notes
from infthor_eval.nieh.results.cells import Cell, both_intervals, mean_cell, percent
from infthor_eval.nieh.results.effective_length import effective_lengths
from infthor_eval.nieh.results.evidence_tables import (
    above_blind_cell,
    above_blind_notes,
    question_facet_tables,
    short_name,
)
from infthor_eval.nieh.results.facets import DEPTH, FILE
from infthor_eval.nieh.results.gains import (
    control_tables,
    frames_of,
    gains_table,
    without_alike_notes,
)
from infthor_eval.nieh.results.memory_tables import memory_tables
from infthor_eval.nieh.results.pair_tables import pair_overview, pair_tables
from infthor_eval.nieh.results.summary import (
    CLUE_COLUMNS,
    OPEN_ENDED,
    NiehSummary,
    TaskSummary,
    main_metric,
    named_tasks,
)
from infthor_eval.nieh.scoring import SCORERS
from infthor_eval.runs import RunSummary
from infthor_eval.tables import Column, Row, Table, TableCell, answered_cell

_NAMES = (Column("model", False), Column("task", False))
_METRIC = Column("scorer", False)
_LEFT_OUT = ("skipped", "failed", "not asked")
_LEGEND = (
    "total: all questions, with those on absences. Open-ended questions are in the columns by "
    "clues too.",
    "95 %: interval clustered by trajectory, valid near 0 and 100 %. bootstrap: interval over "
    "resampled trajectories, which assumes no distribution of the scores. If the two differ much, "
    "there are few trajectories.",
    "strict takes words that are 80 % alike (most plurals in -s) and the published synonyms, and "
    "drops no article; `infthor-eval show RUN --question ID` says why a reply got its score.",
)
_EQUAL = (
    "A score of 100.00 or 0.00 has an interval, too: a few trajectories, all alike, say little "
    "about others (Wilson's: 6 of 6 are 61.0 to 100.0)."
)
_ALONE = "Questions on one trajectory alone have no interval: nothing is known about others."
_EMBEDDED = (
    "Questions on frames of the embedded simulator: not comparable with the published rows, which "
    "are on AI2-THOR's own frames."
)
_WITHHELD = (
    "The answers of this set are withheld, so every score here is 0. Send the run to the owner of "
    "the set, who has the key."
)
_OF_REPEATS = (
    "asked",
    "questions",
    "mean",
    "95 %",
    "drawing",
    "consensus",
    "agreement",
    "always",
    "sometimes",
    "never",
    "within",
    "between",
)
_REPEATS_LEGEND = (
    "95 %: interval over other trajectories, with all that drawing adds. drawing: what the mean "
    "moves by if the same questions are asked again (95 %). consensus: score of each question's "
    "commonest answer; agreement: share of its answers that say it.",
    "always, sometimes, never: questions with full marks in all, some, none of their answers. "
    "within, between: standard deviation of the scores of one question, and of the questions' true "
    "means, in points.",
)


def tables(runs: Sequence[RunSummary]) -> list[Table]:
    """Return the tables of runs: by depth and clues, controls, gains over blank frames, form.

    Published rows by clues are below ours; a published table of other columns (question types,
    question files) is a table of its own beside runs in its context, with ours in it where they
    have its columns. The tables by depth and of gains need a task with depths, and a pair of runs
    on true and on blank frames. Those of the evidence, of the effective length and of memories are
    there if a task shows part of a trajectory.
    """
    # Of tasks on one's own data no published row is shown: it is on other questions.
    contexts = {task.context for _, _, task in named_tasks(runs) if task.simulator != OWN_FRAMES}
    others = [
        _beside(table, runs)
        for table in published_tables("nieh")
        if not _is_by_clues(table) and table.context in contexts
    ]
    return [
        *pair_tables(runs),
        *control_tables(runs),
        *_depth_table(runs),
        *others,
        clues_table(runs),
        *gains_table(runs),
        *question_facet_tables(runs),
        *effective_lengths(runs),
        *memory_tables(runs),
        *_repeat_tables(runs),
        _replies_table(runs),
    ]


def overview(runs: Sequence[RunSummary]) -> list[Table]:
    """Return each task's accuracy with intervals, and further tables as far as there are any:
    pairs, controls, gains, memories and repeats.

    A task that asked nothing is a line below the table.
    """
    tasks = list(named_tasks(runs))
    with_samples = [(run, name, task) for run, name, task in tasks if task.n]
    left_out = [_left_out(task) for *_, task in with_samples]
    shown = [at for at in range(len(_LEFT_OUT)) if any(counts[at] != "0" for counts in left_out)]
    rows = tuple(
        Row((run, *_name_and_total(name, task), *(counts[at] for at in shown)))
        for (run, name, task), counts in zip(with_samples, left_out, strict=True)
    )
    numbers = ("total", "95 %", "bootstrap", "n", *(_LEFT_OUT[at] for at in shown))
    notes = (
        *dict.fromkeys(_nothing_asked(name, task) for _, name, task in tasks if not task.n),
        *(
            f"{run}, {name}: {note}"
            for run, name, task in tasks
            for note in form_notes(task.format_failures, task.total.n_answered)
        ),
        *([_ALONE] if any(_is_alone(task) for *_, task in with_samples) else []),
        *([_EQUAL] if any(_is_alike(task) for *_, task in with_samples) else []),
        *_notes(runs),
    )
    table = Table("NIEH accuracy, %, strict scorer", (*_NAMES, *map(Column, numbers)), rows, notes)
    return [
        *pair_overview(runs),
        table,
        *control_tables(runs),
        *gains_table(runs),
        *memory_tables(runs),
        *_repeat_tables(runs),
    ]


def _is_alone(task: TaskSummary) -> bool:
    scores = task.total.scores.values()
    return any(score.n_trajectories == 1 for score in scores)


def _is_alike(task: TaskSummary) -> bool:
    return any(it.mean in (0, 1) and it.n_trajectories > 1 for it in task.total.scores.values())


def _name_and_total(name: str, task: TaskSummary) -> tuple[str, ...]:
    total = task.total
    metric = main_metric(task)
    name_and_metric = name if metric == "strict" else f"{name}, {metric}"
    return name_and_metric, mean_cell(total, metric), *both_intervals(total, metric), str(total.n)


def _left_out(task: TaskSummary) -> tuple[str, str, str]:
    """Return the cells of the columns `_LEFT_OUT`."""
    return str(task.skipped.n), str(task.total.n_failed), str(task.total.n_not_asked)


def _nothing_asked(name: str, task: TaskSummary) -> str:
    reasons = list(task.skipped.by_reason)
    more = f", and {len(reasons) - 1} more reasons" if len(reasons) > 1 else ""
    return (
        f"{name}: nothing asked, {task.skipped.n} "
        f"skipped{f': {reasons[0]}{more}' if reasons else ''}"
    )


def _is_by_clues(table: PublishedTable) -> bool:
    return set(table.columns) <= set(CLUE_COLUMNS)


# -- by number of clues


def clues_table(runs: Sequence[RunSummary]) -> Table:
    """Return accuracy by clues: a row per run, task and metric, then the published rows."""
    has_blind = any(
        score.mean is not None
        for *_, task in named_tasks(runs)
        for score in task.above_blind.values()
    )
    apart = (OPEN_ENDED, ABSENCE, *(("above blind",) if has_blind else ()))
    numbers = (*CLUE_COLUMNS, "95 %", "bootstrap", *apart, "n", *_LEFT_OUT)
    rows = [row for run in runs for row in _rows_of(run, has_blind=has_blind)]
    notes = [*_LEGEND, *above_blind_notes(runs)]
    is_own = all(task.simulator == OWN_FRAMES for *_, task in named_tasks(runs))
    for table in () if is_own else filter(_is_by_clues, published_tables("nieh")):
        rows += _published_rows(table, runs)
        notes += table.notes
    columns = (*_NAMES, _METRIC, *map(Column, numbers))
    return Table(
        "NIEH accuracy, % by number of clues (questions)",
        columns,
        tuple(rows),
        (*notes, *(() if is_own else (PUBLISHED_DATA,)), *_notes(runs)),
    )


def _notes(runs: Sequence[RunSummary]) -> list[str]:
    embedded = (
        [_EMBEDDED] if any(task.simulator == "embedded" for _, _, task in named_tasks(runs)) else []
    )
    is_withheld = any(
        config.withheld for run in runs for config in run.header.config.tasks.values()
    )
    sources = dict.fromkeys(
        source for run in runs for source in sources_of(run.header.config).items()
    )
    return [
        *embedded,
        *([_WITHHELD] if is_withheld else []),
        *without_alike_notes(runs),
        *(f"{metric}: {source}." for metric, source in sources if metric not in SCORERS),
    ]


def _rows_of(run: RunSummary, *, has_blind: bool) -> list[Row]:
    lines = [
        (name, task, metric) for _, name, task in named_tasks([run]) for metric in task.metrics
    ]
    return [
        Row(
            (run.header.label, name, metric, *_cells(task, metric, has_blind=has_blind)),
            ends_section=number == len(lines),
        )
        for number, (name, task, metric) in enumerate(lines, 1)
    ]


def _cells(task: TaskSummary, metric: str, *, has_blind: bool) -> list[str]:
    total = task.total
    by_clues = [_mean_of(task.by_clues[name], metric) for name in CLUE_COLUMNS[:-1]]
    apart = [_mean_of(task.by_clues[name], metric) for name in (OPEN_ENDED, ABSENCE)]
    above = above_blind_cell(task.above_blind.get(metric))
    return [
        *by_clues,
        mean_cell(total, metric),
        *both_intervals(total, metric),
        *apart,
        *([above] if has_blind else []),
        str(total.n),
        *_left_out(task),
    ]


def _mean_of(cell: Cell | None, metric: str) -> TableCell:
    if not cell or not cell.n:
        return TableCell("-", {"": "", "questions": ""})
    mean = mean_cell(cell, metric)
    return TableCell(f"{mean} ({cell.n})", {**mean.numbers, "questions": str(cell.n)})


def _published_rows(table: PublishedTable, runs: Sequence[RunSummary]) -> Iterator[Row]:
    """Yield the published rows, each followed by the differences of runs of its checkpoint."""
    for row in table.rows:
        values = dict(zip(table.columns, row.values, strict=True))
        cells = [f"{values[name]:.2f}" if name in values else "" for name in CLUE_COLUMNS]
        yield Row(
            (row.name, f"{table.title}, {table.context}", table.metric, *cells), is_published=True
        )
        for run in runs:
            yield from _differences(run, row, table)


def _differences(run: RunSummary, row: PublishedRow, table: PublishedTable) -> Iterator[Row]:
    """Yield the differences of a run of the published model from its row; = if its interval has the
    published value."""
    if not row.matches(run.header.config.model) or frames_of(run) != SHOWN:
        return
    for _, name, task in named_tasks([run]):
        # Frames that a simulator of ours rendered are another data set.
        if (
            task.context != table.context
            or task.simulator is not None
            or table.metric not in task.metrics
        ):
            continue
        values = dict(zip(table.columns, row.values, strict=True))
        cells = [
            _difference(task.by_clues[column], values.get(column), table.metric)
            for column in CLUE_COLUMNS
        ]
        yield Row(("  ours minus published", name, table.metric, *cells))


def _difference(cell: Cell, value: float | None, metric: str) -> str:
    ours = cell.scores.get(metric)
    if ours is None or value is None:
        return "-"
    within = (
        ours.low is not None
        and ours.high is not None
        and 100 * ours.low <= value <= 100 * ours.high
    )
    difference = f"{100 * ours.mean - value:+.2f}"
    return TableCell(f"{difference} =", {"": difference}) if within else difference


# -- published, by anything else


def _beside(table: PublishedTable, runs: Sequence[RunSummary]) -> Table:
    """Return the published rows, and the runs in the same context with one of the columns."""
    rows = [
        Row(
            (row.name, _made_by(row, table), table.metric, *map("{:.2f}".format, row.values)),
            is_published=True,
        )
        for row in table.rows
    ]
    for run, name, task in named_tasks([run for run in runs if frames_of(run) == SHOWN]):
        if task.context == table.context and table.metric in task.metrics:
            by_file = {short_name(file): cell for file, cell in task.by[FILE.name].items()}
            cells = task.by_clues | task.by["question_type"] | task.by["variant"] | by_file
            if not cells.keys() & set(table.columns):
                continue
            means = [mean_cell(cells.get(column), table.metric) for column in table.columns]
            rows.append(Row((run, name, table.metric, *means)))
    columns = (*_NAMES, _METRIC, *map(Column, table.columns))
    return Table(
        f"{table.title}: {table.source}",
        columns,
        tuple(rows),
        (*table.notes, PUBLISHED_DATA, *_notes(runs)),
    )


def _made_by(row: PublishedRow, table: PublishedTable) -> str:
    return ", ".join(filter(None, (row.task, row.source))) or table.context


# -- by depth


def _depth_table(runs: Sequence[RunSummary]) -> list[Table]:
    """Return a table if a task has depths."""
    rows = [
        ((run, name, metric), {depth: (cell, metric) for depth, cell in by_depth(task).items()})
        for run, name, task in named_tasks(runs)
        if by_depth(task)
        for metric in task.metrics
    ]
    return facet_table(
        "Accuracy, % by depth of the needle (questions)",
        ("model", "task", "scorer"),
        sorted({depth for _, cells in rows for depth in cells}),
        rows,
        lambda scores: _mean_of(*(scores or (None, ""))),
    )


def by_depth(task: TaskSummary) -> dict[str, Cell]:
    """Return the cells of a task's variants that are depths of the needle."""
    variants = task.by["variant"].items()
    return {name: cell for name, cell in variants if name.startswith(DEPTH)}


# -- form of the replies


def _replies_table(runs: Sequence[RunSummary]) -> Table:
    """Return bias to yes, reply length and replies that are no answer, a row per run and task."""
    thought = any(task.n_thought for _, _, task in named_tasks(runs))
    numbers = ["yes/no questions", "gold yes, %", "said yes, %", "tokens per right answer"]
    numbers += ["with thoughts"] if thought else []
    rows = []
    for run, name, task in named_tasks(runs):
        if not task.n:
            continue
        tokens = "-" if task.tokens_per_right is None else f"{task.tokens_per_right:.1f}"
        further = [tokens, str(task.n_thought)] if thought else [tokens]
        both = (task.yes_no.share_gold_yes, task.yes_no.share_said_yes)
        shares = list(map(percent, both))
        failures = ", ".join(f"{n} {reason}" for reason, n in task.format_failures.items()) or "-"
        rows.append(Row((run, name, str(task.yes_no.n), *shares, *further, failures)))
    columns = (*_NAMES, *map(Column, numbers), Column("not in the form asked for", False))
    return Table("Form of the replies", columns, tuple(rows))


# -- repeated answers


def _repeat_tables(runs: Sequence[RunSummary]) -> list[Table]:
    """Return the table of runs with repeated answers; none if there are none."""
    rows = []
    for run in runs:
        assert isinstance(run.summary, NiehSummary)
        for name, of_task in run.summary.repeats.items():
            task = run.summary.tasks[name]
            score = task.total.scores[main_metric(task)]  # repeats are summed up from answers alone
            interval = (
                "-"
                if score.low is None or score.high is None
                else f"{percent(score.low)}–{percent(score.high)}"
            )
            shares = (
                of_task.consensus,
                of_task.agreement,
                of_task.always,
                of_task.sometimes,
                of_task.never,
            )
            spreads = (of_task.variance_within**0.5, of_task.variance_between**0.5)
            cells = (
                f"{of_task.n_repeats}x",
                str(of_task.n_questions),
                answered_cell(percent(of_task.mean), of_task.n_questions, task.n),
                interval,
                f"±{percent(of_task.drawing)}",
                *map(percent, shares),
                *map(percent, spreads),
            )
            rows.append(Row((run.header.label, name, *cells)))
    if not rows:
        return []
    columns = (Column("model", False), Column("task", False), *map(Column, _OF_REPEATS))
    return [Table("Answers that repeat, %, strict scorer", columns, tuple(rows), _REPEATS_LEGEND)]
