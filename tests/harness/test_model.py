"""Our model class for lm-eval, without its command."""

import json
from importlib.metadata import EntryPoint

import pytest
from lm_eval.api.instance import Instance

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.harness import nieh_task, registration
from infthor_eval.harness.model import InfthorLM
from infthor_eval.runs import read_run
from model_adapters.hf.cached.model import TransformersModel
from model_adapters.options.checkpoints import HfOptions
from tests.helpers.toy_suite import Prepared, Sums, ToySuite

KWARGS = {"until": [], "max_gen_toks": 6, "do_sample": False, "temperature": 0.0}


@pytest.fixture(autouse=True)
def this_process_forgets(monkeypatch):
    monkeypatch.setattr(registration, "_references", False)


@pytest.fixture
def requests(make_nieh_set):
    registration.say_model_takes_references()
    docs = nieh_task.dataset(context="clues", data=str(make_nieh_set(size=56)))["test"]
    return [
        Instance(
            "generate_until",
            dict(doc),
            (nieh_task.doc_to_text(doc), KWARGS),
            number,
            metadata=("t", number, 1),
        )
        for number, doc in enumerate(docs)
    ]


def test_replies_come_in_the_order_of_the_requests_and_are_found_again(
    requests, tmp_path, monkeypatch
):
    first = InfthorLM("qwen2.5-vl-tiny", journal=str(tmp_path)).generate_until(requests)
    assert len(set(first)) > 1

    def refuse(*_):
        raise AssertionError("asked again")

    monkeypatch.setattr(TransformersModel, "answer_each", refuse)
    again = InfthorLM("qwen2.5-vl-tiny", journal=str(tmp_path))
    assert again.generate_until(requests[::-1]) == first[::-1]
    assert (again.tokenizer_name, again.get_model_info()["model_source"]) == (
        "qwen2.5-vl-tiny",
        "infthor",
    )


def test_what_lm_eval_says_by_default_is_not_taken_for_a_wish(requests):
    model = InfthorLM("qwen2.5-vl-tiny", batch_size=1, max_batch_size=None, device="cuda:0")
    assert model._model.capabilities.batch_size == HfOptions.batch_size > 1
    assert (
        InfthorLM("qwen2.5-vl-tiny", batch_size="4", device="cpu")._model.capabilities.batch_size
        == 4
    )
    with pytest.raises(UsageError, match="device=nowhere"):
        InfthorLM("qwen2.5-vl-tiny", device="nowhere")


def test_what_it_cannot_do_is_said_in_one_line(requests):
    with pytest.raises(
        UsageError, match="blind is a baseline, not a model; run it with infthor-eval --model blind"
    ):
        InfthorLM("blind")
    model = InfthorLM("qwen2.5-vl-tiny")
    foreign = Instance(
        "generate_until", {"question": "2+2?"}, ("2+2?", KWARGS), 0, metadata=("gsm8k", 0, 1)
    )
    with pytest.raises(ModelError, match="gsm8k: infthor-eval's models answer its own tasks"):
        model.generate_until([foreign])
    for method in (model.loglikelihood, model.loglikelihood_rolling):
        with pytest.raises(ModelError, match="use a task with output_type generate_until"):
            method(requests)


class SumRequests:
    """How lm-eval's requests reach the toy suite: a doc is a sum."""

    def prepare(self, task, docs, generation_kwargs, seed):
        return Prepared(Sums)

    def doc_id(self, doc):
        return f"{doc['a']}+{doc['b']}"

    def doc_id_of_unit(self, key, cluster):
        return key.id

    def response(self, records):
        return json.dumps([record.payload.answer for record in records])


class Incomplete:
    doc_id = None


def sum_requests(*sums):
    docs = [{"suite": "toy", "a": a, "b": b} for a, b in sums]
    return [
        Instance("generate_until", doc, ("", KWARGS), number, metadata=("sums", number, 1))
        for number, doc in enumerate(docs)
    ]


@pytest.fixture
def install(monkeypatch):
    """Makes the toy suite another package's, with an adapter for lm-eval of that name in this
    module, or none."""

    def install(adapter):
        points = [EntryPoint("toy", "tests.helpers.toy_suite:ToySuite", "infthor_eval.suites")]
        if adapter is not None:
            points.append(EntryPoint("toy", f"{__name__}:{adapter}", "infthor_eval.lm_eval"))
        monkeypatch.setattr(
            "infthor_eval.plugins.entry_points",
            lambda group: [point for point in points if point.group == group],
        )

    return install


def test_a_suite_of_another_package_answers_its_docs_and_no_others(install, requests, tmp_path):
    install("SumRequests")
    model = InfthorLM("qwen2.5-vl-tiny", journal=str(tmp_path))
    nieh = requests[:1]
    sums = sum_requests((1, 4), (1, 3))
    alone = model.generate_until(nieh)
    assert model.generate_until([sums[0], *nieh, sums[1]]) == ["[5]", *alone, "[4]"]
    assert [record.id for record in read_run(tmp_path / "toy", ToySuite.records)[1]] == [
        "1+3",
        "1+4",
    ]
    assert model.generate_until(sum_requests((1, 3))) == ["[4]"]  # each call closes what it opened


@pytest.mark.parametrize(
    ("adapter", "expected"),
    [
        (None, "unknown lm-eval adapter of suite 'toy'; there are manipulation, nieh, plans"),
        (
            "Incomplete",
            "adapter of suite toy of another package lacks prepare, doc_id_of_unit, response; see "
            "docs/",
        ),
    ],
)
def test_a_suite_that_lm_eval_cannot_reach_is_refused_in_one_line(install, adapter, expected):
    install(adapter)
    with pytest.raises(UsageError) as caught:
        InfthorLM("qwen2.5-vl-tiny").generate_until(sum_requests((1, 3)))
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)
