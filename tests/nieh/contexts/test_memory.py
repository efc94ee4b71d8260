"""Questions on what a memory recalls: what is observed, recalled, shown and kept."""

import json

import pytest

from infthor_eval.errors import UsageError
from infthor_eval.formats.question import Question
from infthor_eval.harness import registration
from infthor_eval.harness.nieh_task import dataset, doc_to_image, doc_to_text
from infthor_eval.nieh.asking.recalling import Recaller, recall_all
from infthor_eval.nieh.docs import doc_of, doc_parts, sample_of
from infthor_eval.nieh.records import NiehRecall
from infthor_eval.nieh.samples import find_samples, open_set

from ...helpers.questions import make_question

QUESTIONS = [
    make_question(),
    Question("t", "Where was the plate?", (0, 5), ("Sink",)),
    Question("u", "Is there a mug?", (2,), ("no",)),
]


@pytest.fixture
def find_memory_samples(make_nieh_set):
    root = make_nieh_set(QUESTIONS, n_frames=6, size=56)

    def find(memory="last", **settings):
        return find_samples({"context": "memory", "memory": memory, "data": str(root), **settings})

    return find


def shown_parts(task_samples):
    """Names of the frames, and the texts, of each request."""
    requests = [task_samples.request(sample) for sample in recall_all(task_samples)]
    return [
        [part if isinstance(part, str) else int(part.path.stem) for part in parts]
        for parts, _ in requests
    ]


def test_the_last_view_is_shown_after_what_is_recalled_of_those_before(find_memory_samples):
    assert shown_parts(find_memory_samples(memory_args={"k": 2})) == [[3, 4, 5]] * 3
    assert shown_parts(find_memory_samples(memory_args={"k": 99})) == [[0, 1, 2, 3, 4, 5]] * 3
    assert shown_parts(find_memory_samples(budget=30, tokens_per_frame=10)) == [[2, 3, 4, 5]] * 3
    assert shown_parts(find_memory_samples(budget=9, tokens_per_frame=10)) == [[5]] * 3
    assert shown_parts(find_memory_samples("oracle", memory_args={"k": 1})) == [
        [1, 5],
        [0, 5],
        [2, 5],
    ]


def test_words_tell_of_views_alone_or_of_what_was_recalled(find_memory_samples, own):
    frames, texts = find_memory_samples(), find_memory_samples(own(recalled='"a mug"'))
    (_, of_frames), (parts, of_texts) = (
        item.request(recall_all(item)[0]) for item in (frames, texts)
    )
    assert "\nAnswer the question given the agent's views in time order. " in of_frames
    assert of_texts.startswith(
        "\nAnswer the question given what was recalled of the agent's views, in time order, and"
    )
    assert (parts[0], len(parts)) == ("a mug", 2)


def test_a_sample_that_nothing_was_recalled_for_has_a_mark(find_memory_samples):
    task_samples = find_memory_samples()
    parts, _ = task_samples.request(task_samples.samples[0])
    assert (parts[0], len(parts)) == ("<memory>", 2)


OBSERVES = """
from infthor_eval.memory import MemoryCapabilities

SEEN = []


class Observes:
    capabilities = MemoryCapabilities(privileged={privileged})

    def identity(self):
        return {{}}

    def begin(self, facts):
        SEEN.append(("begin", facts.name))

    def observe(self, step):
        SEEN.append((step.number, step.frame.path.stem, step.log is not None))

    def recall(self, query, budget):
        SEEN.append((query.text, query.present.number, query.clues, query.present.log is not None))
        return [{recalled}]
"""


@pytest.fixture
def own(tmp_path):
    """Writes a memory that tells what it is given; returns its name and the list that it fills."""

    def write(privileged=False, recalled=""):
        path = tmp_path / f"observes_{privileged}_{len(recalled)}.py"
        path.write_text(OBSERVES.format(privileged=privileged, recalled=recalled))
        return f"{path}:Observes"

    return write


@pytest.mark.parametrize("privileged", [False, True])
def test_a_memory_sees_the_steps_before_the_question_and_metadata_only_if_privileged(
    find_memory_samples, own, privileged
):
    from model_adapters.own_file import load_from_file

    name = own(privileged)
    recall_all(find_memory_samples(name))
    seen = load_from_file(name).begin.__globals__["SEEN"]
    steps = [(number, f"{number:09d}", privileged) for number in range(5)]
    queries = [
        (question.text, 5, question.clues if privileged else None, privileged)
        for question in QUESTIONS
    ]
    assert seen == [("begin", "t"), *steps, *queries[:2], ("begin", "u"), *steps, queries[2]]


@pytest.mark.parametrize(
    ("recalled", "words"),
    [
        ("query.present", "which is neither a text nor a step that it has observed"),
        ("3", "recalls 3, which is neither a text nor a step"),
        ('" "', "recalls an empty text"),
        ("1 / 0", "(recall): division by zero); fix it"),
        ('"x" * 400', "recalls 100 tokens where the budget is 50"),
    ],
)
def test_a_wrong_recall_is_one_line(find_memory_samples, own, recalled, words):
    with pytest.raises(UsageError) as caught:
        recall_all(find_memory_samples(own(recalled=recalled), budget=50, tokens_per_frame=10))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_was_recalled_is_found_again_by_its_inputs(find_memory_samples):
    kept = {}

    def recall(task_samples):
        recaller = Recaller(task_samples, None, kept.get, kept.__setitem__)
        return [recaller.recall(sample) for sample in task_samples.samples]

    first = recall(find_memory_samples())
    assert len(kept) == 3
    assert recall(find_memory_samples()) == first
    assert len(kept) == 3
    recall(find_memory_samples(memory_args={"k": 2}))
    assert len(kept) == 6
    assert all(isinstance(item, NiehRecall) and item.build_s >= 0 for item in kept.values())


@pytest.mark.parametrize(
    ("frames", "same"), [("blank", False), ("other", False), ("shuffled", True), ("shown", True)]
)
def test_an_ablation_is_what_a_memory_observes(find_memory_samples, own, frames, same):
    task_samples = find_memory_samples(own(recalled="str(query.present.frame.path)"), frames=frames)
    true = str(task_samples.data.frames("t")[-1].path)
    for sample in recall_all(task_samples)[:2]:
        parts, _ = task_samples.request(sample)
        assert (parts[0] == true) == same


def test_blank_frames_are_shown_in_place_of_those_recalled(find_memory_samples):
    task_samples = find_memory_samples(frames="blank")
    parts, _ = task_samples.request(recall_all(task_samples)[0])
    assert len(parts) == 6
    assert {part.path.name for part in parts} == {"56x56.png"}


def test_docs_carry_what_was_recalled_and_how(find_memory_samples):
    task_samples = find_memory_samples(
        "oracle", memory_args={"k": 2}, budget=40, tokens_per_frame=10
    )
    for sample in (task_samples.samples[0], *recall_all(task_samples)):
        doc = json.loads(json.dumps(doc_of(task_samples, sample)))
        assert sample_of(doc) == sample
        parts, text = task_samples.request(sample)
        assert doc_parts(doc) == [*parts, text]


def test_another_host_gets_docs_with_what_was_recalled(find_memory_samples, monkeypatch):
    monkeypatch.setattr(registration, "_references", False)
    root = find_memory_samples().data.root
    docs = dataset(context="memory", memory="last", memory_args={"k": 2}, data=str(root))["test"]
    assert [doc["frames"] for doc in docs] == [[3, 4, 5]] * 3
    assert len(doc_to_image(docs[0])) == 3
    assert doc_to_text(docs[0]).startswith("<image><image><image>\nAnswer")


def test_another_host_is_told_that_it_cannot_write_notes(find_memory_samples, monkeypatch):
    monkeypatch.setattr(registration, "_references", False)
    root = find_memory_samples().data.root
    with pytest.raises(UsageError, match="run the task with `infthor-eval run`") as caught:
        dataset(context="memory", memory="notes", data=str(root))
    assert "\n" not in str(caught.value)


def test_our_model_under_another_host_recalls_itself(find_memory_samples, monkeypatch):
    monkeypatch.setattr(registration, "_references", True)
    root = find_memory_samples().data.root
    (doc, *_) = dataset(context="memory", memory="notes", data=str(root))["test"]
    assert doc_to_text(doc).startswith("<memory><image>\nAnswer the question")
    assert sample_of(doc).recalled is None


def test_actions_and_goals_come_from_log_and_trajectory(find_memory_samples):
    open_set.cache_clear()
    task_samples = find_samples(
        {"context": "memory", "memory": "text-log", "bundled": "nieh_mini"}, limit=1
    )
    (sample,) = recall_all(task_samples)
    (text,) = (item for item in sample.recalled if isinstance(item, str))
    lines = text.splitlines()
    steps = task_samples.data.frames(sample.question.traj_id)
    assert lines[0].startswith("Step 0: goal: ")
    assert sum(": goal: " in line for line in lines) >= 2
    assert any("PickupObject" in line and "; holds " in line for line in lines)
    assert int(lines[-1].split()[1].rstrip(":")) == len(steps) - 1
