"""Notes that the model takes itself: once per trajectory, kept by the journal, shown to every question."""

import shutil

import msgspec
import pytest
from PIL import Image

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.prompts import note_text
from infthor_eval.runs import Catalog, execute, plan, read_journal
from model_adapters import load
from model_adapters.hf.model import TransformersModel

TASK = "nieh_memory_notes"


def silent(ready, budgets):
    return lambda record, resumed: None


@pytest.fixture(autouse=True)
def small_windows(tmp_path, monkeypatch):
    """Two frames a note and six tokens each, so that the six frames of a trajectory make three short notes."""
    folder = tmp_path / "tasks"
    shutil.copytree(Catalog.packaged().folder, folder)
    file = folder / "nieh" / "contexts" / f"{TASK}.yaml"
    text = file.read_text().replace("note_window: 20", "note_window: 2").replace("note_tokens: 64", "note_tokens: 6")
    file.write_text(text)
    monkeypatch.setattr(Catalog, "packaged", classmethod(lambda cls: cls(folder)))


@pytest.fixture
def asked(monkeypatch):
    """Every request that a model answers: its parts, and how many tokens it may answer."""
    found, answer_each = [], TransformersModel.answer_each

    def spying(model, prompts, max_new_tokens, stop):
        found.extend((parts, max_new_tokens) for parts in prompts)
        return answer_each(model, prompts, max_new_tokens, stop)

    monkeypatch.setattr(TransformersModel, "answer_each", spying)
    return found


@pytest.fixture
def request_notes(make_request):
    def make(**changes):
        return make_request(**{"model": "qwen2.5-vl-tiny", "tasks": (TASK,), **changes})

    return make


def notes_of(outcome):
    lines = (outcome.folder / "journal.jsonl").read_bytes().splitlines()[1:]
    return [line for line in map(msgspec.json.decode, lines) if "note" in line]


def told(outcome):
    """What a run found, without how long it took and what it found in its cache."""
    return {record.key: (record.reply, record.failure, record.fingerprint) for record in outcome.records}


def numbers(parts):
    return [int(part.path.stem) for part in parts if not isinstance(part, str)]


def test_a_trajectory_is_read_once_window_by_window_and_every_question_sees_the_notes(request_notes, asked):
    outcome = execute(plan(request_notes()), silent)
    of_a = asked[:6]
    assert [numbers(parts) for parts, _ in of_a] == [[0, 1], [2, 3], [4, 5], [5], [5], [5]]
    assert [limit for _, limit in of_a] == [6, 6, 6, 50, 50, 50]
    assert len(asked) == 2 * 3 + 5
    notes = notes_of(outcome)
    assert [(note["traj_id"], note["steps"]) for note in notes] == [
        (traj_id, steps) for traj_id in ("traj_a", "traj_b") for steps in ("Steps 0-1", "Steps 2-3", "Steps 4-5")
    ]
    shown = "".join(f"{note['steps']}: {' '.join(note['note'].split())}\n" for note in notes[:3])
    assert {parts[0] for parts, limit in of_a if limit == 50} == {shown}
    assert read_journal(outcome.folder / "journal.jsonl")[1] == outcome.records


def test_a_note_is_what_the_model_says_to_its_window_alone(request_notes):
    request = request_notes()
    notes = notes_of(execute(plan(request), silent))
    frames = NiehSet(request.data).frames("traj_b")
    model = load("qwen2.5-vl-tiny", {"share_prefix": "false"}, 0)
    for number, first in enumerate((0, 2, 4)):
        conversation = model.conversation()
        conversation.append(*frames[first : first + 2], note_text(f"Steps {first}-{first + 1}"))
        assert notes[3 + number]["note"] == conversation.reply(6).text


@pytest.mark.parametrize("n_answered", [1, 2, 4, 7])
def test_a_run_stopped_anywhere_goes_on_with_the_same_notes(request_notes, tmp_path, asked, monkeypatch, n_answered):
    whole = execute(plan(request_notes(output=tmp_path / "whole")), silent)
    n_all, answer_each = len(asked), TransformersModel.answer_each

    def stopping(*arguments):
        if len(asked) - n_all == n_answered:
            raise KeyboardInterrupt
        return answer_each(*arguments)

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(TransformersModel, "answer_each", stopping)
        execute(plan(request_notes()), silent)
    resumed = execute(plan(request_notes()), silent)
    assert len(asked) == 2 * n_all
    assert told(resumed) == told(whole)
    assert [note["note"] for note in notes_of(resumed)] == [note["note"] for note in notes_of(whole)]


def test_a_changed_frame_has_its_note_taken_again_and_its_questions_asked_again(request_notes, asked):
    request = request_notes()
    execute(plan(request), silent)
    asked.clear()
    path = request.data / "metadata" / "traj_a" / "img" / "000000002.png"
    size = path.stat().st_size
    for shade in range(256):  # one of the same size, so that the run stays the same
        Image.new("RGB", (56, 56), (shade, 3, 200)).save(path)
        if path.stat().st_size == size:
            break
    execute(plan(request), silent)
    (note, limit), *others = asked
    assert (numbers(note), limit) == ([2, 3], 6)
    assert len(others) in (0, 3)  # none, where a model of random weights notes the same


def test_questions_on_notes_that_cannot_be_taken_fail_by_name(request_notes):
    outcome = execute(plan(request_notes(model_options={"max_tokens": "60"})), silent)
    assert len(outcome.records) == 5
    assert all("is beyond the 60 tokens" in record.failure for record in outcome.records)
    assert notes_of(outcome) == []


def test_a_frame_that_cannot_be_read_fails_its_own_trajectory(request_notes):
    request = request_notes()
    frame = request.data / "metadata" / "traj_a" / "img" / "000000003.png"
    frame.write_bytes(frame.read_bytes()[:60])
    outcome = execute(plan(request), silent)
    assert {record.traj_id for record in outcome.records if record.failure} == {"traj_a"}
    assert all(str(frame) in record.failure for record in outcome.records if record.failure)


def test_bounds_answer_without_notes(request_notes):
    for model in ("oracle", "blind"):
        outcome = execute(plan(request_notes(model=model)), silent)
        assert all(record.reply for record in outcome.records)
        assert notes_of(outcome) == []
    assert all(record.reply for record in execute(plan(request_notes(model="oracle")), silent).records)


def test_batches_see_the_same_notes(request_notes):
    alone = execute(plan(request_notes()), silent)
    together = execute(plan(request_notes(model_options={"batch_size": "4"})), silent)
    assert told(together) == told(alone)


def test_the_budget_covers_the_notes_to_come(request_notes):
    budgets = []
    outcome = execute(plan(request_notes()), lambda _, found: budgets.extend(found) or (lambda *_: None))
    (budget,) = budgets
    longest = max(record.n_context_tokens for record in outcome.records) + 50
    # Three notes of six tokens at most; half a character, which random weights write, is three tokens when read again.
    assert longest - 2 * 3 * 6 <= budget.longest <= longest + 3 * 6
    assert budget.n_contexts == 2
    execute(
        plan(request_notes(model_options={"max_tokens": "60"})),
        lambda _, found: budgets.extend(found) or (lambda *_: None),
    )
    assert budgets[1].n_refused == 2
