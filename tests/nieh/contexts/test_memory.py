import pytest

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.question import Question
from infthor_eval.harness import registration
from infthor_eval.harness.nieh_task import dataset, doc_to_image, doc_to_text
from infthor_eval.nieh.contexts import CONTEXTS
from infthor_eval.nieh.docs import doc_parts, sample_of
from infthor_eval.nieh.notes import Notes, NoteSettings
from infthor_eval.nieh.samples import find_samples

QUESTION = Question("t", "Is there a mug?", (1,), ("yes",))


def notes(n_frames, window):
    frames = tuple(FrameRef(f"{index}.png") for index in range(n_frames))
    return Notes("t", frames, NoteSettings(window, 8))


def test_windows_hold_every_frame_once_and_the_last_one_what_is_left():
    windows = notes(45, 20).windows
    assert [window.steps for window in windows] == ["Steps 0-19", "Steps 20-39", "Steps 40-44"]
    assert tuple(frame for window in windows for frame in window.frames) == notes(45, 20).frames
    assert [window.steps for window in notes(21, 20).windows] == ["Steps 0-19", "Step 20"]
    *frames, text = windows[2].request
    assert frames == [FrameRef(f"{index}.png") for index in range(40, 45)]
    assert text.startswith("\nSteps 40-44 of an embodied agent's trajectory")


def test_the_notes_are_a_line_each_in_time_order():
    text = notes(5, 2).text(["a mug\non the  table", "", "the sink "])
    assert text == "Steps 0-1: a mug on the table\nSteps 2-3: \nStep 4: the sink\n"


def test_the_context_is_the_notes_the_last_frame_and_the_question(make_nieh_set):
    root = make_nieh_set([QUESTION], n_frames=5, size=56)
    found = find_samples({"context": "memory_notes", "data": str(root), "note_window": 3, "note_tokens": 7})
    (sample,) = found.samples
    frames = found.data.frames("t")
    context, text = CONTEXTS["memory_notes"].request(found.data, sample)
    assert context == [Notes("t", frames, NoteSettings(3, 7)), frames[-1]]
    assert text.endswith("Question: Is there a mug?")


@pytest.fixture
def references(monkeypatch):
    """As when lm-eval's model is ours, which has notes taken."""
    monkeypatch.setattr(registration, "_references", True)


def test_a_doc_carries_how_notes_are_taken(make_nieh_set, references):
    root = make_nieh_set([QUESTION], n_frames=5, size=56)
    config = {"context": "memory_notes", "data": str(root), "note_window": 3, "note_tokens": 7}
    (doc,) = dataset(**config)["test"]
    assert doc_parts(doc)[0].settings == NoteSettings(3, 7)
    assert doc_to_text(doc).startswith("<notes><image>\nAnswer the question given your notes")
    assert doc_to_image(doc) == []
    assert sample_of(doc) == find_samples(config).samples[0]


def test_a_runner_that_has_no_notes_taken_is_told_so(make_nieh_set, monkeypatch):
    monkeypatch.setattr(registration, "_references", False)
    root = make_nieh_set([QUESTION], size=56)
    with pytest.raises(UsageError, match="run the task with `infthor-eval run`") as caught:
        dataset(context="memory_notes", data=str(root))
    assert "\n" not in str(caught.value)
