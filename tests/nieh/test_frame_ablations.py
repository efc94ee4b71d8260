import json

import pytest
from PIL import Image

from infthor_eval.errors import UsageError
from infthor_eval.formats.question import Question
from infthor_eval.nieh.docs import doc_of, doc_parts
from infthor_eval.nieh.samples import find_samples

QUESTIONS = [
    Question(traj_id, f"Is there a {name}?", clues, ("yes",))
    for traj_id in ("a", "b", "c")
    for name, clues in (("mug", (1,)), ("plate", (0, 2, 4)))
]


@pytest.fixture
def requests(make_nieh_set):
    """All requests of a context: a list of frames, by trajectory and number, and the text, for each
    sample."""
    root = make_nieh_set(QUESTIONS, n_frames=6, size=24)

    def find(frames, context="trajectory", seed=0):
        task_samples = find_samples(
            {"context": context, "data": str(root), "frames": frames, "seed": seed}
        )
        requests_sent = []
        for sample in task_samples.samples:
            parts, text = task_samples.request(sample)
            assert doc_parts(json.loads(json.dumps(doc_of(task_samples, sample)))) == [*parts, text]
            requests_sent.append((sample.question.traj_id, parts, text))
        return requests_sent

    return find


def names(parts):
    return [f"{part.path.parent.parent.name}{int(part.path.stem)}" for part in parts]


def test_blank_frames_have_the_size_of_those_they_stand_for(requests):
    plain, blank = requests("shown"), requests("blank")
    assert [text for *_, text in blank] == [text for *_, text in plain]
    frames = {frame for _, parts, _ in blank for frame in parts}
    (frame,) = frames
    image = frame.load()
    assert (image.size, image.getcolors()) == ((24, 24), [(24 * 24, (128, 128, 128))])
    assert [len(parts) for _, parts, _ in blank] == [6] * 6


def test_each_frame_has_a_blank_of_its_own_size(requests):
    (_, (first, *_), _), *_ = requests("shown")
    Image.new("RGB", (40, 30)).save(first.path.parent / "000000003.png")
    (_, parts, _), *_ = requests("blank")
    assert [part.load().size for part in parts] == [(24, 24)] * 3 + [(40, 30)] + [(24, 24)] * 2


def test_a_frame_that_cannot_be_read_stands_for_itself(requests):
    (_, (first, *_), _), *_ = requests("shown")
    first.path.write_bytes(b"\x89PNG\r\n\x1a\n")
    (_, parts, _), *_ = requests("blank")
    assert parts[0] == first


def test_shuffled_frames_are_the_same_in_another_order_for_every_question(requests):
    plain, shuffled = requests("shown"), requests("shuffled")
    for (_, parts, _), (_, others, _) in zip(plain, shuffled, strict=True):
        assert sorted(names(others)) == names(parts) != names(others)
    assert shuffled[0][1] == shuffled[1][1]
    assert shuffled == requests("shuffled")
    assert shuffled != requests("shuffled", seed=1)
    assert [len(parts) for _, parts, _ in requests("shuffled", "clues")] == [1, 3] * 3


def test_other_frames_are_those_at_the_same_places_of_another_trajectory(requests):
    for (traj_id, parts, _), (_, others, _) in zip(
        requests("shown", "clues"), requests("other", "clues"), strict=True
    ):
        assert {name[0] for name in names(others)} < {"a", "b", "c"} - {traj_id}
        assert [name[1:] for name in names(others)] == [name[1:] for name in names(parts)]
    assert requests("other") == requests("other")
    assert any(requests("other", seed=seed) != requests("other") for seed in range(1, 9))


def test_other_frames_on_one_trajectory_are_refused(make_nieh_set):
    root = make_nieh_set(QUESTIONS[:2], name="one")
    with pytest.raises(UsageError, match="on one trajectory only"):
        find_samples({"context": "clues", "data": str(root), "frames": "other"})
