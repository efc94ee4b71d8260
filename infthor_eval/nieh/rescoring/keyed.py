"""Replies to the public part of a private set, with the key that has its answers."""

from collections.abc import Sequence

from msgspec.structs import replace

from infthor_eval.errors import DataError
from infthor_eval.formats.replies.answer_key import AnswerKey
from infthor_eval.nieh.guessing.blind import find_floor, visible_knowledge
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.rescoring.rescore import Source
from infthor_eval.nieh.twins import twin_of_reply
from infthor_eval.runs import UnitRecord


def with_key(source: Source, key: AnswerKey) -> Source:
    """Return a run on the public part as one on the set with the answers, not yet scored."""
    tasks = source.header.config.tasks
    for name, task in tasks.items():
        if task.data != key.public:
            raise DataError(
                f"{source.header.name}: {name} was asked on another set than the public part of "
                f"{key.data.root}; give the key of that set"
            )
    keyed = {
        name: replace(task, data=key.data.fingerprint, withheld=False)
        for name, task in tasks.items()
    }
    config = replace(source.header.config, tasks=keyed)
    contexts = {name: task.context for name, task in tasks.items()}
    records = [_keyed(record, key, contexts[record.task]) for record in source.records]
    return Source(replace(source.header, config=config), records, source.requests)


def _keyed(record: UnitRecord[NiehAnswer], key: AnswerKey, context: str) -> UnitRecord[NiehAnswer]:
    payload = keyed_payload(record.payload, record.id, key, None)
    blind = find_floor(key.data, visible_knowledge(context))
    question = key.question(record.id)
    return replace(
        record,
        cluster=question.cluster,
        payload=replace(payload, blind=blind.get(question.id)),
    )


def keyed_payload(
    payload: NiehAnswer, public_id: str, key: AnswerKey, shown: Sequence[int] | None
) -> NiehAnswer:
    """Return a payload with the answers of the key, and what its question is paired with.

    Args:
        payload: the payload of a question of the public part.
        public_id: id of that question.
        key: the key.
        shown: positions of the shown frames; None if they are not known.
    """
    question = key.question(public_id)
    return replace(
        NiehAnswer.of(
            question, None, payload.shown_clues, twin_of_reply(key.data, question, shown)
        ),
        recall=payload.recall,
        reply=payload.reply,
        thinking=payload.thinking,
        n_watched=payload.n_watched,
    )
