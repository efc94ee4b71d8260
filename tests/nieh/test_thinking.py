"""Models that think before they answer: what is scored, what is kept, what it takes."""

import json

import pytest

from infthor_eval.formats.question import Question
from model_adapters import Reply
from model_adapters.built_in import BUILT_IN, BuiltIn
from tests.helpers.command_line import assert_refused, option_words, read_success
from tests.model_adapters.toy_adapter import Talk, Toy

QUESTIONS = tuple(
    Question("traj_a", text, (number,), ("mug",), "put_action")
    for number, text in enumerate(("What first?", "What now?", "What then?", "What at last?"))
)
SAYS = {
    "first": "<think>a cup? no</think>mug",
    "now": "<think>a cup, or was it",
    "then": "so it was</think><answer>mug</answer>",
    "last": "cup",
}


LIMITS = []


class Thinker(Talk):
    def reply(self, decoding):
        LIMITS.append((decoding.max_new_tokens, decoding.stop))
        text = next(answer for word, answer in SAYS.items() if word in self.turns[-1].parts[-1])
        return Reply(text, n_reply_tokens=len(text.split()), n_context_tokens=10)


@pytest.fixture(autouse=True)
def installed(monkeypatch):
    monkeypatch.setitem(
        BUILT_IN, "toy", BuiltIn(f"{Toy.__module__}:Toy", f"{Toy.__module__}:Options")
    )
    monkeypatch.setattr(Toy, "conversation", lambda self: Thinker())
    LIMITS.clear()


def answers_of(output):
    (shard,) = output.rglob("worker-0.jsonl")
    lines = [json.loads(line) for line in shard.read_text().splitlines()]
    payloads = [line["payload"] for line in lines if line["type"] == "unit"]
    return {payload["question"]: payload for payload in payloads}


def test_thoughts_are_taken_off_and_kept(make_nieh_set, tmp_path, run_cli):
    data = make_nieh_set(QUESTIONS, size=56)
    words = option_words(model="toy", tasks="nieh_gt", data=data, out=tmp_path / "out")
    read_success(run_cli(*words))
    answers = answers_of(tmp_path / "out")
    assert {question: payload.get("thinking") for question, payload in answers.items()} == {
        "What first?": "a cup? no",
        "What now?": "a cup, or was it",
        "What then?": "so it was",
        "What at last?": None,
    }
    assert [payload["reply"] for payload in answers.values()].count("mug") == 2
    assert (answers["What now?"]["reply"], answers["What now?"]["scores"]["strict"]) == ("", 0.0)
    (results,) = (tmp_path / "out").rglob("results.json")
    task = json.loads(results.read_text())["summary"]["tasks"]["nieh_gt"]
    assert task["format_failures"] == {"cut off while thinking": 1}
    assert (task["n_thought"], task["failures"]) == (3, [])
    n_tokens = sum(len(text.split()) for text in SAYS.values())
    assert task["tokens_per_right"] == n_tokens / 2
    note = "nieh_gt: 1 replies reached the token limit before any answer, and are wrong; --max-thi"
    assert note in " ".join(run_cli("show", results.parent)[1].split())
    assert {limit for limit, _ in LIMITS} == {50}


def test_thoughts_have_a_budget_of_their_own(make_nieh_set, tmp_path, run_cli):
    data = make_nieh_set(QUESTIONS, size=56)
    arguments = option_words(model="toy", tasks="nieh_gt", data=data, out=tmp_path / "out")
    assert run_cli(*arguments, "--max-thinking-tokens", 1000)[0] == 0
    assert {limit for limit, _ in LIMITS} == {1050}
    assert "0 evaluated now" not in run_cli(*arguments)[2]  # another run
    assert_refused(
        run_cli(*arguments, "--max-thinking-tokens", 0),
        "--max-thinking-tokens 0: give a whole number from 1",
        after_notes=True,
    )


def test_a_stop_string_ends_the_answer_and_not_the_thoughts(
    make_nieh_set, tmp_path, run_cli, monkeypatch
):
    monkeypatch.setitem(SAYS, "first", "<think>a\ncup</think>mug\ncup")
    data = make_nieh_set(QUESTIONS[:1], size=56)
    task = tmp_path / "own.yaml"
    task.write_text(
        "include: _nieh.yaml\ntask: own\ndataset_kwargs: {context: clues}\n"
        'generation_kwargs: {until: ["\\n"], max_gen_toks: 20, do_sample: false}\n'
    )
    arguments = option_words(
        model="toy", tasks="own", include_path=tmp_path, data=data, out=tmp_path / "out"
    )
    read_success(run_cli(*arguments, "--max-thinking-tokens", 100))
    assert LIMITS == [(120, ())]
    assert answers_of(tmp_path / "out")["What first?"]["reply"] == "mug"
