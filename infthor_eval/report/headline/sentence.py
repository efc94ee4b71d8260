"""The results of runs in a sentence for each suite, true whatever runs there are."""

from collections.abc import Iterator, Sequence
from itertools import groupby

from infthor_eval.report.headline.results import TaskResult

_MOST_TASKS = 2  # tasks of a suite in its sentence
_MOST_RUNS = 3  # runs that are named in it; of more, the highest and the lowest


def headline(results: Sequence[TaskResult]) -> str:
    """Return what runs scored, a sentence for each suite; empty without runs."""
    suites: dict[str, dict[str, list[TaskResult]]] = {}
    for result in results:
        suites.setdefault(result.suite, {}).setdefault(result.task, []).append(result)
    return " ".join(map(_sentence, suites.values()))


def _sentence(by_task: dict[str, list[TaskResult]]) -> str:
    # The tasks of most runs come first, and of these the ones that `blind` never gets right.
    tasks = sorted(by_task, key=lambda task: (-len(by_task[task]), _may_be_blind(by_task[task])))
    clauses = [_clause(task, by_task[task]) for task in tasks[:_MOST_TASKS]]
    n_more = len(tasks) - _MOST_TASKS
    if n_more > 0:
        clauses.append(f"{n_more} more {'task is' if n_more == 1 else 'tasks are'} in the table")
    text = "; ".join(clauses)
    return f"{text[0].upper()}{text[1:]}."


def _may_be_blind(results: Sequence[TaskResult]) -> bool:
    return any(result.chance != 0.0 for result in results)


def _clause(task: str, results: Sequence[TaskResult]) -> str:
    scored = [result for result in results if result.rate is not None]
    parts = [f"on {task} {' and '.join(_groups(scored))}"] if scored else []
    unscored = [result for result in results if result.rate is None]
    if unscored:
        words = _without_score(task, unscored, is_first=not scored)
        parts.append(f"({words})" if scored else words)
    return " ".join(parts)


def _groups(scored: Sequence[TaskResult]) -> Iterator[str]:
    """Yield the scores of models, then of baselines, then of `blind` if it was not run."""
    models = [result for result in scored if not result.is_baseline]
    baselines = [result for result in scored if result.is_baseline]
    first = models or baselines
    n_runs = len(models) + len(baselines)
    kind = "" if models else "the baseline "
    # One predicate for all, after whoever is named first.
    finding = _in_order(first)[0].finding
    named = _named(first, kind, finding, has_interval=n_runs == 1)
    if models and baselines:
        named += _named(baselines, "the baseline ", "{}", has_interval=False)
    chances = sorted({round(100 * one.chance, 1) for one in scored if one.chance is not None})
    is_run = any(one.run == "blind" for one in baselines)
    if chances and not is_run and all(one.chance is not None for one in scored):
        ends = f"{chances[0]:.1f}\u00a0%"
        if len(chances) > 1:
            ends = f"{chances[0]:.1f} to {chances[-1]:.1f}\u00a0%, by the questions answered"
        named.append(f"blind {ends}")
    *rest, last = named
    if rest:
        # What has a comma within is closed by one.
        yield ", ".join(rest) + ("," if ", " in rest[-1] else "")
    yield last


def _in_order(results: Sequence[TaskResult]) -> list[TaskResult]:
    return sorted(results, key=lambda one: -(one.rate.mean if one.rate else 0.0))


def _named(
    results: Sequence[TaskResult], kind: str, finding: str, *, has_interval: bool
) -> list[str]:
    ordered = _in_order(results)
    if len(ordered) <= _MOST_RUNS:
        texts = [f"{kind}{one.run} {_share(one, has_interval=has_interval)}" for one in ordered]
        first = ordered[0]
        texts[0] = f"{kind}{first.run} {finding.format(_share(first, has_interval=has_interval))}"
        return texts
    highest, *_, lowest = ordered
    what = "baselines" if kind else "runs"
    share = finding.format(_share(highest, has_interval=False))
    ties = next(len(list(same)) for _, same in groupby(ordered, key=_shown))
    if ties == len(ordered):
        return [f"each of {ties} {what} {share}"]
    top = f"{kind}{highest.run}" if ties == 1 else f"each of the best {ties} {what}"
    return [
        f"{top} {share}, the highest of {len(ordered)} {what}",
        f"{kind}{lowest.run} {_share(lowest, has_interval=False)}, the lowest",
    ]


def _shown(result: TaskResult) -> str:
    return "" if result.rate is None else f"{100 * result.rate.mean:.1f}"


def _share(result: TaskResult, *, has_interval: bool) -> str:
    """Return a score in percent, over how many units if not over all, and its interval."""
    rate = result.rate
    assert rate is not None
    remarks = []
    if has_interval and rate.low is not None and rate.high is not None:
        remarks.append(f"95 % interval {100 * rate.low:.1f} to {100 * rate.high:.1f}")
    if rate.n_all is not None:
        remarks.append(f"{rate.n:,} of {rate.n_all:,} answered")
    remark = f" ({'; '.join(remarks)})" if remarks else ""
    return f"{_shown(result)}\u00a0%{remark}"


def _without_score(task: str, results: Sequence[TaskResult], *, is_first: bool) -> str:
    where = f"on {task} " if is_first else ""
    if len(results) > _MOST_RUNS:
        return f"{where}{len(results)} runs have no score: nothing was answered"
    names = " and ".join(result.run for result in results)
    has = "has" if len(results) == 1 else "have"
    n_all = sum(result.n_all for result in results)
    return f"{where}{names} {has} no score: none of {n_all:,} samples was answered"
