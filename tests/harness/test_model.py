"""Our model class for lm-eval, without its command."""

import pytest
from lm_eval.api.instance import Instance

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.harness import nieh_task, registration
from infthor_eval.harness.model import InfthorLM
from model_adapters.hf.model import TransformersModel

KWARGS = {"until": [], "max_gen_toks": 6, "do_sample": False, "temperature": 0.0}


@pytest.fixture(autouse=True)
def this_process_forgets(monkeypatch):
    monkeypatch.setattr(registration, "_references", False)


@pytest.fixture
def requests(make_nieh_set):
    registration.say_model_takes_references()
    docs = nieh_task.dataset(context="clues", data=str(make_nieh_set(size=56)))["test"]
    return [
        Instance("generate_until", dict(doc), (nieh_task.doc_to_text(doc), KWARGS), number, metadata=("t", number, 1))
        for number, doc in enumerate(docs)
    ]


def test_replies_come_in_the_order_of_the_requests_and_are_found_again(requests, tmp_path, monkeypatch):
    first = InfthorLM("qwen2.5-vl-tiny", journal=str(tmp_path)).generate_until(requests)
    assert len(set(first)) > 1

    def refuse(*_):
        raise AssertionError("asked again")

    monkeypatch.setattr(TransformersModel, "answer_each", refuse)
    again = InfthorLM("qwen2.5-vl-tiny", journal=str(tmp_path))
    assert again.generate_until(requests[::-1]) == first[::-1]
    assert (again.tokenizer_name, again.get_model_info()["model_source"]) == ("qwen2.5-vl-tiny", "infthor")


def test_what_lm_eval_says_by_default_is_not_taken_for_a_wish(requests):
    model = InfthorLM("qwen2.5-vl-tiny", batch_size=1, max_batch_size=None, device="cuda:0")
    assert model._model.capabilities.batch_size == 1
    assert InfthorLM("qwen2.5-vl-tiny", batch_size="4", device="cpu")._model.capabilities.batch_size == 4
    with pytest.raises(UsageError, match="device=nowhere"):
        InfthorLM("qwen2.5-vl-tiny", device="nowhere")


def test_what_it_cannot_do_is_said_in_one_line(requests):
    with pytest.raises(UsageError, match="blind reads the answer key; run it with infthor-eval --model blind"):
        InfthorLM("blind")
    model = InfthorLM("qwen2.5-vl-tiny")
    foreign = Instance("generate_until", {"question": "2+2?"}, ("2+2?", KWARGS), 0, metadata=("gsm8k", 0, 1))
    with pytest.raises(ModelError, match="gsm8k: infthor-eval's models answer its own tasks"):
        model.generate_until([foreign])
    for method in (model.loglikelihood, model.loglikelihood_rolling):
        with pytest.raises(ModelError, match="use a task with output_type generate_until"):
            method(requests)
