"""Audit tables: what guessers get by file, form, type and clues, and runs above `blind`."""

from collections.abc import Sequence

from infthor_eval.nieh.guessing.audit import Audit, Group
from infthor_eval.nieh.guessing.balancing import MARGIN, Balanced
from infthor_eval.nieh.results.cells import percent
from infthor_eval.nieh.results.summary import main_metric, named_tasks
from infthor_eval.runs import RunSummary
from infthor_eval.tables import Column, Row, Table

_HEADS = {
    "file": "file",
    "answers": "kind of answer",
    "clues": "number of clues",
    "type": "type of question",
    "form": "form of question",
}


def guessers_table(audited: Audit) -> Table:
    """Return what each guesser gets on each file, and of its pairs of twins if it has any."""
    means: dict[str, tuple[float, ...]] = {}
    for group in audited.groups("file"):
        means[group.name] = group.means()
        if of_pairs := group.pair_means():
            means[f"{group.name}, pairs"] = of_pairs
    rows = tuple(
        Row((name, *(f"{100 * column[number]:.2f}" for column in means.values())))
        for number, name in enumerate(audited.guessers)
    )
    note = (
        "Each question is guessed from questions on other trajectories in its file (of a single "
        "trajectory, from its other questions); nobody sees a frame. blind: of each form a "
        "constant or a guesser by words and number of frames, chosen on other trajectories, too."
    )
    title = "What can be guessed, % by guesser and file (strict scorer)"
    return Table(title, (Column("guesser", False), *map(Column, means)), rows, (note,))


def audit_tables(audited: Audit) -> list[Table]:
    """Return a table for each way to group the questions."""
    tables = []
    numbers = (
        "questions",
        "answers",
        "entropy, bits",
        "yes, %",
        "chance, %",
        "other scenes, %",
        "blind, %",
        "best guesser, %",
    )
    note = (
        "chance: an answer drawn from those of the form; other scenes: the best guesser, "
        "from questions in other scenes alone. best guesser: the highest on these very questions."
    )
    for by, head in _HEADS.items():
        rows = tuple(Row(_cells(group)) for group in audited.groups(by))
        columns = (Column(head, False), *map(Column, numbers), Column("by", False))
        tables.append(Table(f"By {head}", columns, rows, (note,)))
    return tables


def _cells(group: Group) -> tuple[str, ...]:
    name, mean = group.best()
    return (
        group.name,
        str(len(group.questions)),
        str(len(group.answers)),
        f"{group.entropy:.2f}",
        percent(group.share_yes),
        percent(group.chance),
        percent(group.best_without_scene()),
        percent(group.means()[-1]),
        percent(mean),
        name,
    )


def runs_table(runs: Sequence[RunSummary]) -> Table:
    """Return the scores of runs by form beside that of `blind`; forms that it solves are marked."""
    rows = []
    for run, name, task in named_tasks(runs):
        above = task.above_blind.get(main_metric(task))
        if above is None:
            continue
        for number, (form, score) in enumerate(above.forms.items(), 1):
            mark = " (solved)" if form in above.solved_forms else ""
            shares = (percent(score.score), f"{percent(score.blind)}{mark}")
            points = f"{100 * (score.score - score.blind):+.1f}"
            cells = (run, name, form, str(score.n), *shares, points)
            rows.append(Row(cells, ends_section=number == len(above.forms)))
    heads = [Column(name, False) for name in ("model", "task", "form of question")]
    note = "solved: blind gets nearly all of it, so it is not in the score above blind."
    columns = (*heads, *map(Column, ("questions", "score, %", "blind, %", "points above")))
    return Table("Runs beside blind, by form", columns, tuple(rows), (note,))


def balanced_table(balanced: Balanced) -> Table:
    """Return what a balanced part kept of each form."""
    rows = [Row((name, str(kept), str(n))) for name, (kept, n) in balanced.kept.items()]
    rows.append(
        Row(("all", str(len(balanced.questions)), str(sum(n for _, n in balanced.kept.values()))))
    )
    note = (
        f"Best guesser on the part: {balanced.best}, {100 * balanced.best_score:.1f} %; chance "
        f"{100 * balanced.chance:.1f} %. In no form is a guesser more than {100 * MARGIN:.0f} "
        "points above chance."
    )
    columns = (Column("form of question", False), Column("kept"), Column("of"))
    return Table("The balanced part", columns, tuple(rows), (note,))
