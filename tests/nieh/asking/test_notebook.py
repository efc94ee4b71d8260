"""Notes that the model takes itself: once per trajectory, kept by the journal, shown to every
question."""

import msgspec
import pytest
from PIL import Image

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.memory.texts import note_request
from infthor_eval.nieh.records import RECORDS
from infthor_eval.runs import execute, read_run
from model_adapters import Decoding, load
from model_adapters.hf.cached.model import TransformersModel

from ..watching import Watcher

TASK = "nieh_memory_notes"


@pytest.fixture(autouse=True)
def small_windows(task_files):
    """Two frames a note and six tokens each, so that the six frames of a trajectory make three
    short notes."""
    file = task_files / "nieh" / "contexts" / f"{TASK}.yaml"
    text = file.read_text().replace("{window: 20, tokens: 64}", "{window: 2, tokens: 6}")
    file.write_text(text)


@pytest.fixture
def model_requests(monkeypatch):
    """Every request that a model answers: its parts, and how many tokens it may answer."""
    requests, answer_each = [], TransformersModel.answer_each

    def spying(model, conversations, decoding):
        for (turn,) in conversations:
            requests.append((turn.parts, decoding.max_new_tokens))
        return answer_each(model, conversations, decoding)

    monkeypatch.setattr(TransformersModel, "answer_each", spying)
    return requests


@pytest.fixture
def taking_notes(prepare_run):
    def make(model="qwen2.5-vl-tiny", model_options=None, **changes):
        alone = {"batch_size": "1"} if model.endswith("-tiny") else None
        return prepare_run(model, model_options or alone, tasks=(TASK,), **changes)

    return make


def notes_of(outcome):
    lines = (outcome.folder / "journal" / "worker-0.jsonl").read_bytes().splitlines()[1:]
    artifacts = [
        line["payload"] for line in map(msgspec.json.decode, lines) if line["type"] == "artifact"
    ]
    return [artifact for artifact in artifacts if artifact["type"] == "nieh_note"]


def replies_by_key(outcome):
    """What a run found, without how long it took and what it found in its cache."""
    return {
        record.key: (record.payload.reply, record.failure, record.fingerprint)
        for record in outcome.records
    }


def numbers(parts):
    return [int(part.path.stem) for part in parts if not isinstance(part, str)]


def test_a_trajectory_is_read_once_window_by_window_and_every_question_sees_the_notes(
    taking_notes, model_requests
):
    outcome = execute(taking_notes())
    of_a = model_requests[:6]
    assert [numbers(parts) for parts, _ in of_a] == [[0, 1], [2, 3], [4, 5], [5], [5], [5]]
    assert [limit for _, limit in of_a] == [6, 6, 6, 50, 50, 50]
    assert len(model_requests) == 2 * 3 + 5
    notes = notes_of(outcome)
    assert [note["n_frames"] for note in notes] == [2] * 6
    windows = zip(("Steps 0-1", "Steps 2-3", "Steps 4-5"), notes[:3], strict=True)
    notes_text = "".join(f"{steps}: {' '.join(note['note'].split())}\n" for steps, note in windows)
    assert {parts[0] for parts, limit in of_a if limit == 50} == {notes_text}
    assert read_run(outcome.folder, RECORDS)[1] == outcome.records


def test_a_note_is_what_the_model_says_to_its_window_alone(taking_notes, data):
    notes = notes_of(execute(taking_notes()))
    frames = NiehSet(data).frames("traj_b")
    model = load("qwen2.5-vl-tiny", {"share_prefix": "false"}, 0)
    for number, first in enumerate((0, 2, 4)):
        conversation = model.conversation()
        conversation.append(*frames[first : first + 2], note_request(f"Steps {first}-{first + 1}"))
        assert notes[3 + number]["note"] == conversation.reply(Decoding(max_new_tokens=6)).text


@pytest.mark.parametrize("n_answered", [1, 2, 4, 7])
def test_a_run_stopped_anywhere_goes_on_with_the_same_notes(
    taking_notes, tmp_path, model_requests, monkeypatch, n_answered
):
    whole = execute(taking_notes(output=tmp_path / "whole"))
    n_all, answer_each = len(model_requests), TransformersModel.answer_each

    def stopping(*arguments):
        if len(model_requests) - n_all == n_answered:
            raise KeyboardInterrupt
        return answer_each(*arguments)

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(TransformersModel, "answer_each", stopping)
        execute(taking_notes())
    resumed = execute(taking_notes())
    assert len(model_requests) == 2 * n_all
    assert replies_by_key(resumed) == replies_by_key(whole)
    assert [note["note"] for note in notes_of(resumed)] == [
        note["note"] for note in notes_of(whole)
    ]


def test_a_changed_frame_has_its_note_taken_again_and_its_questions_asked_again(
    taking_notes, model_requests, data
):
    execute(taking_notes())
    model_requests.clear()
    path = data / "metadata" / "traj_a" / "img" / "000000002.png"
    size = path.stat().st_size
    for shade in range(256):  # one of the same size, so that the run stays the same
        Image.new("RGB", (56, 56), (shade, 3, 200)).save(path)
        if path.stat().st_size == size:
            break
    execute(taking_notes())
    (note, limit), *others = model_requests
    assert (numbers(note), limit) == ([2, 3], 6)
    assert len(others) in (0, 3)  # none, where a model of random weights notes the same


def test_questions_on_notes_that_cannot_be_taken_fail_by_name(taking_notes):
    outcome = execute(taking_notes(model_options={"max_tokens": "60"}))
    assert len(outcome.records) == 5
    assert all("is beyond the 60 tokens" in record.failure for record in outcome.records)
    assert notes_of(outcome) == []


def test_a_frame_that_cannot_be_read_fails_its_own_trajectory(taking_notes, data):
    frame = data / "metadata" / "traj_a" / "img" / "000000003.png"
    frame.write_bytes(frame.read_bytes()[:60])
    outcome = execute(taking_notes())
    assert {record.cluster for record in outcome.records if record.failure} == {"traj_a"}
    assert all(str(frame) in record.failure for record in outcome.records if record.failure)


def test_baselines_answer_without_notes(taking_notes):
    for model in ("oracle", "blind", "random"):
        outcome = execute(taking_notes(model))
        assert len(outcome.records) == 5
        assert {record.state for record in outcome.records} == {"answered"}
        assert notes_of(outcome) == []


def test_batches_see_the_same_notes(taking_notes):
    alone = execute(taking_notes())
    together = execute(taking_notes(model_options={"batch_size": "4"}))
    assert replies_by_key(together) == replies_by_key(alone)


def test_the_cost_says_that_what_is_recalled_is_not_counted(taking_notes):
    watcher = Watcher()
    execute(taking_notes(), watcher)
    (cost,) = watcher.work.costs
    assert cost.description.endswith("what a memory recalls for each question is not counted yet")
