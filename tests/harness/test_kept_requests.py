"""`--cache_requests`: what lm-eval kept of one set is not asked about another."""

import pytest
from lm_eval import caching, evaluator
from lm_eval.tasks import TaskManager

from infthor_eval.harness import registration
from infthor_eval.storage.folders import packaged_folder
from infthor_eval.storage.once import forget_files


@pytest.fixture
def ask(tmp_path, monkeypatch):
    """Asks a tiny model the first task about a set, with kept requests; gives the samples."""
    monkeypatch.setattr(caching.cache, "PATH", str(tmp_path / "kept"))
    monkeypatch.setattr(registration, "_references", False)
    registration.register()

    def ask(data):
        forget_files()
        tasks = TaskManager(
            include_path=str(packaged_folder("tasks")),
            include_defaults=False,
            metadata={"data": str(data)},
        )
        results = evaluator.simple_evaluate(
            model="infthor",
            model_args={"adapter": "qwen2.5-vl-tiny"},
            tasks=["nieh_gt"],
            task_manager=tasks,
            cache_requests=True,
        )
        return results["samples"]["nieh_gt"]

    return ask


def asked_and_scored(samples):
    """Words of each question as it was asked, and as its doc, by which it is scored, has it."""
    return [
        (sample["arguments"][0][0].rpartition("Question: ")[2], sample["doc"]["question"])
        for sample in samples
    ]


def test_another_set_is_asked_its_own_questions(ask, make_nieh_set):
    first = make_nieh_set(name="a", size=56)
    before = asked_and_scored(ask(first))
    second = make_nieh_set(name="b", size=56)
    (path,) = second.glob("qa_set*.csv")
    path.write_text(path.read_text().replace("?", " today?"))
    for asked, scored in asked_and_scored(ask(second)):
        assert scored.endswith(" today?")
        assert scored in asked
    assert asked_and_scored(ask(first)) == before


def test_the_same_set_is_asked_what_was_kept(ask, make_nieh_set, monkeypatch):
    data = make_nieh_set(name="a", size=56)
    before = asked_and_scored(ask(data))
    made_again = []
    monkeypatch.setattr("infthor_eval.harness.nieh_task.doc_to_text", made_again.append)
    assert asked_and_scored(ask(data)) == before
    assert made_again == []


def test_a_set_with_one_question_more_is_asked_it(ask, make_nieh_set):
    data = make_nieh_set(name="a", size=56)
    (path,) = data.glob("qa_set*.csv")
    whole = path.read_text()
    path.write_text("".join(whole.splitlines(keepends=True)[:-1]))
    few = ask(data)
    path.write_text(whole)
    assert len(ask(data)) == len(few) + 1
