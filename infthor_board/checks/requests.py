"""What was shown: the hash of each request, made again from our set."""

from collections import Counter
from collections.abc import Iterator

from msgspec.structs import replace

from infthor_board.case import Case, Remark, check
from infthor_board.expected import Expected
from infthor_eval.errors import InfthorError
from infthor_eval.nieh.contexts import MEMORY, RETRIEVED
from infthor_eval.nieh.rescoring.rebuilt_requests import RequestRebuilder


@check("frames")
def same_requests(case: Case) -> Iterator[str]:
    """The hash of each request is that of our frames, words and decoding: a reply counts for the
    frames that were shown, and for no others."""
    for task in case.tasks:
        if task.config is None:
            text = f"{task.name}: an export has no hashes of frames; what was shown is not checked"
            yield Remark(text)
        elif task.run.header.config.model.get("imported"):
            text = f"{task.name}: imported replies have no hashes of frames; not checked"
            yield Remark(text)
        elif task.config.context == RETRIEVED:
            text = f"{task.name}: its frames were retrieved by a model; they are not checked"
            yield Remark(text)
        else:
            yield from _of_task(task)


def _of_task(task: Expected) -> Iterator[str]:
    reasons = _reasons(task)
    if reasons:
        (reason, _), *_ = reasons.most_common(1)
        yield (
            f"{task.name}: {reasons.total():,} of {len(task.records):,} requests are not those "
            f"of our set ({reason})"
        )


def _reasons(task: Expected) -> Counter[str]:
    assert task.config is not None
    decoding = task.stated.decoding
    if not isinstance(decoding.get("seed"), int):
        return Counter({"its decoding has no seed": len(task.records)})
    ours = replace(task.config, decoding=decoding)
    config = replace(task.run.header.config, tasks={task.name: ours})
    reasons: Counter[str] = Counter()
    try:
        rebuilder = RequestRebuilder(replace(task.run.header, config=config), task.name, task.data)
    except InfthorError as error:
        return Counter({str(error): len(task.records)})
    for record in task.records:
        if record.payload.reply is None or record.key not in task.units:
            continue  # nothing to believe, or refused elsewhere
        if task.config.context == MEMORY and record.payload.recall is None:
            reasons["what its memory recalled is not recorded"] += 1
            continue
        answers = task.units[record.key].payload.answers
        own = replace(record, payload=replace(record.payload, answers=answers))
        try:
            rebuilder.rebuild(own)
        except InfthorError as error:
            reasons[str(error)] += 1
    return reasons
