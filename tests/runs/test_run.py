import json
from collections import Counter

import pytest

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.formats.question import Question
from infthor_eval.runs import execute, plan, read_journal
from model_adapters import Reply


def silent(ready, budgets):
    return lambda record, resumed: None


def test_oracle_is_right_everywhere_and_lm_eval_agrees(make_request):
    outcome = execute(plan(make_request()), silent)
    assert Counter(record.task for record in outcome.records) == {"nieh_gt": 5, "nieh_full": 5}
    assert all(record.reply == ", ".join(map(str, record.answers)) for record in outcome.records)
    (results,) = outcome.folder.glob("lm_eval/*/results_*.json")
    measured = json.loads(results.read_text())["results"]
    assert {task: measured[task]["strict,none"] for task in measured} == {"nieh_gt": 1.0, "nieh_full": 1.0}
    assert len(list(outcome.folder.glob("lm_eval/*/samples_nieh_*.jsonl"))) == 2


def test_the_same_command_goes_on_and_another_starts_anew(make_request):
    resumed = []
    first = execute(plan(make_request()), lambda *_: lambda record, found: resumed.append(found))
    again = execute(plan(make_request()), lambda *_: lambda record, found: resumed.append(found))
    assert resumed == [False] * 10 + [True] * 10
    assert again == first
    for changes in ({"seed": 1}, {"limit": 1}, {"tasks": ("nieh_gt",)}, {"model": "blind"}):
        other = execute(plan(make_request(**changes)), silent)
        assert other.folder != first.folder
    identity, records = read_journal(first.folder / "journal.jsonl")
    assert identity == first.identity
    assert records == first.records


def test_a_changed_frame_of_the_same_size_is_noticed(make_request):
    request = make_request(tasks=("nieh_gt",))
    execute(plan(request), silent)
    frame = request.data / "metadata" / "traj_a" / "img" / "000000001.png"
    content = bytearray(frame.read_bytes())
    content[-20] ^= 1
    frame.write_bytes(bytes(content))
    resumed = Counter()
    execute(plan(request), lambda *_: lambda record, found: resumed.update([(record.question, found)]))
    made = {question for question, found in resumed if not found}
    assert made == {"Is there a mug?", "Where was the mug before you put it?"}


class Recorder:
    """A scripted model that keeps what it was asked."""

    name = "recorder"
    max_tokens = None

    def __init__(self):
        self.asked = []

    def identity(self):
        return {}

    def tokens_per_frame(self, frame):
        return 100

    def conversation(self):
        return Talk(self)

    def close(self):
        pass


class Talk:
    def __init__(self, model):
        self.model, self.parts = model, []

    @property
    def n_tokens(self):
        return len(self.parts)

    def append(self, *parts):
        self.parts += parts

    def mark(self):
        return len(self.parts)

    def rewind(self, mark):
        del self.parts[mark:]

    def reply(self, max_new_tokens, stop=()):
        assert max_new_tokens == 50
        self.model.asked.append(list(self.parts))
        for part in self.parts[:-1]:
            part.load()
        return Reply("first line\nmug", (1, 2), len(self.parts), 0)


@pytest.fixture
def recorder(monkeypatch):
    model = Recorder()
    monkeypatch.setattr("infthor_eval.runs.run.load", lambda *_: model)
    return model


def test_a_model_is_asked_by_trajectory_and_in_the_published_words(make_request, recorder):
    outcome = execute(plan(make_request(tasks=("nieh_full",))), silent)
    names = [[part.path.parts[-3] for part in parts[:-1]] for parts in recorder.asked]
    assert names == [["traj_a"] * 6] * 3 + [["traj_b"] * 6] * 2
    assert recorder.asked[0][-1] == (
        "\nAnswer the question given the agent's views in time order. Do not include explanation or reasoning in the "
        "answer. Answer with a single word or words.\nQuestion: Is there a mug?"
    )
    assert {record.reply for record in outcome.records} == {"first line\nmug"}


def test_a_unit_that_fails_is_recorded_and_the_run_goes_on(make_request, recorder):
    request = make_request()
    frame = request.data / "metadata" / "traj_a" / "img" / "000000001.png"
    frame.write_bytes(frame.read_bytes()[:60])
    outcome = execute(plan(request), silent)
    failed = [record for record in outcome.records if record.failure]
    assert len(outcome.records) == 10
    assert Counter(record.task for record in failed) == {"nieh_gt": 2, "nieh_full": 3}
    assert all(str(frame) in record.failure for record in failed)


def test_a_frame_that_is_no_image_is_left_out_of_the_contexts_that_need_it(make_request):
    request = make_request()
    (request.data / "metadata" / "traj_b" / "img" / "000000002.png").write_text("text")
    left_out = {task.name: len(task.resolved.left_out) for task in plan(request).tasks}
    assert left_out == {"nieh_gt": 1, "nieh_full": 2}


def test_a_task_without_its_data_or_without_a_question_is_refused(make_request, make_nieh_set):
    with pytest.raises(UsageError, match="give its folder with --data"):
        plan(make_request(data=None))
    empty = make_nieh_set([Question("t", "q", (99,), ("a",))], name="empty")
    with pytest.raises(UsageError, match=r"can be asked \(clue 99 is outside trajectory t"):
        plan(make_request(data=empty))


def test_the_tiny_model_runs_through_and_shares_prefixes(make_request):
    outcome = execute(plan(make_request(model="qwen2.5-vl-tiny", tasks=("nieh_full",))), silent)
    assert all(record.reply is not None for record in outcome.records)
    by_trajectory = {}
    for record in outcome.records:
        by_trajectory.setdefault(record.traj_id, []).append(record)
    for records in by_trajectory.values():
        assert records[0].n_cached_tokens < records[1].n_cached_tokens


def test_batches_give_the_same_replies_and_one_that_fails_takes_no_other_with_it(make_request, monkeypatch):
    tasks = ("nieh_full",)
    alone = execute(plan(make_request(model="qwen2.5-vl-tiny", tasks=tasks)), silent)
    together = execute(
        plan(make_request(model="qwen2.5-vl-tiny", tasks=tasks, model_options={"batch_size": "4"})), silent
    )
    assert {r.key: r.reply for r in together.records} == {r.key: r.reply for r in alone.records}

    def replies(talk, endings, max_new_tokens, stop=()):
        raise ModelError("out of memory on a batch")

    monkeypatch.setattr("model_adapters.backend.BackendConversation.replies", replies)
    options = {"batch_size": "3"}
    survived = execute(plan(make_request(model="qwen2.5-vl-tiny", tasks=tasks, model_options=options)), silent)
    assert {r.key: r.reply for r in survived.records} == {r.key: r.reply for r in alone.records}
