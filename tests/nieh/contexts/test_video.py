import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import CONTEXTS, ContextSettings
from infthor_eval.nieh.samples import find_samples, open_set

QUESTIONS = [Question("a", "Is there a mug?", (1,), ("yes",)), Question("b", "Is there a sink?", (0,), ("no",))]


@pytest.fixture
def root(make_nieh_set):
    return make_nieh_set(QUESTIONS, n_frames=5, size=56)


def video_of(root, traj_id):
    return root / "metadata" / traj_id / f"{traj_id}_10fps.mp4"


def samples_of(root):
    open_set.cache_clear()
    return find_samples({"context": "video", "data": str(root)})


def test_the_video_is_shown_where_there_is_one_and_else_the_frames(root, write_video):
    write_video(video_of(root, "a"), range(0, 250, 5))  # 5 s
    context, found = CONTEXTS["video"], samples_of(root)
    assert {sample.question.traj_id: sample.variant for sample in found.samples} == {
        "a": "source=mp4",
        "b": "source=frames",
    }
    with_video, without = found.samples
    frames, text = context.request(found.data, with_video)
    assert [frame.load().getpixel((9, 9))[0] for frame in frames] == pytest.approx([0, 50, 100, 150, 200], abs=4)
    assert text.startswith("\nAnswer the question given the video showing the agent's trajectory over time. Do not ")
    frames, _ = context.request(found.data, without)
    assert frames == list(found.data.frames("b"))


def test_a_broken_video_has_its_questions_skipped_by_name_and_is_looked_at_once(root, monkeypatch):
    import cv2

    opened, capture = [], cv2.VideoCapture
    monkeypatch.setattr(cv2, "VideoCapture", lambda *where: opened.append(where) or capture(*where))
    video_of(root, "a").write_bytes(b"no video")
    found = samples_of(root)
    assert [sample.question.traj_id for sample in found.samples] == ["b"]
    (skipped,) = found.skipped
    assert skipped.reason.startswith(f"{video_of(root, 'a')}: not a video that OpenCV can decode")
    assert skipped.variant == "source=mp4"
    assert len(opened) == 1


def test_the_identity_changes_with_a_video(root, write_video):
    def sources():
        return CONTEXTS["video"].sources(NiehSet(root), ContextSettings())

    found = [sources()]
    write_video(video_of(root, "a"), [9] * 20)
    found.append(sources())
    assert sources() == found[-1]
    write_video(video_of(root, "a"), [99] * 20)
    found.append(sources())
    video_of(root, "a").write_bytes(b"no video")
    found.append(sources())
    assert len({str(each) for each in found}) == 4
