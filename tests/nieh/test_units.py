"""The units of NIEH: what `blind` says to a question is learned for its record, and no question
waits for it."""

import pytest

from infthor_eval.nieh import units
from infthor_eval.nieh.records import BlindGuess
from infthor_eval.questions.asking import BaselineReplier
from infthor_eval.runs import Unit, execute
from infthor_eval.runs.work.binding import bind_run


class _Guesses(dict):
    def get(self, key, default=None):
        return BlindGuess(form=key, scores={}, form_scores={})


@pytest.fixture
def events(monkeypatch):
    """What happens, in order: a question is "asked", what `blind` says is "learned"."""
    happened = []
    answer = BaselineReplier.answer
    monkeypatch.setattr(units, "find_floor", lambda *_: happened.append("learned") or _Guesses())
    monkeypatch.setattr(
        BaselineReplier,
        "answer",
        lambda *arguments: happened.append("asked") or answer(*arguments),
    )
    return happened


def test_a_question_is_asked_before_blind_is_learned(prepare_run, events):
    outcome = execute(prepare_run())
    assert events[0] == "asked"
    assert [record.payload.blind.form for record in outcome.records] == [
        record.id for record in outcome.records
    ]


def test_every_record_of_a_unit_has_what_blind_says(prepare_run, events):
    unit = bind_run(prepare_run()).evaluation.workload.groups[0].units[0]
    assert unit.payload.blind is None
    assert events == []
    elsewhere = unit.without_inputs()
    assert type(elsewhere) is Unit
    records = [
        unit.record("", unit.payload.with_reply("yes", {}, None)),
        unit.record_failure("a fault"),
        unit.record_exclusion("a reason", ""),
        elsewhere.record_failure("a lost worker"),
    ]
    assert {record.payload.blind.form for record in records} == {unit.key.id}
    assert records[1].payload == records[3].payload
