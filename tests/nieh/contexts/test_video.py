import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import CONTEXTS, Settings
from infthor_eval.nieh.work import find_work, open_set

QUESTIONS = [Question("a", "Is there a mug?", (1,), ("yes",)), Question("b", "Is there a sink?", (0,), ("no",))]


@pytest.fixture
def root(make_nieh_set):
    return make_nieh_set(QUESTIONS, n_frames=5, size=56)


def video_of(root, traj_id):
    return root / "metadata" / traj_id / f"{traj_id}_10fps.mp4"


def work_of(root):
    open_set.cache_clear()
    return find_work({"context": "video", "data": str(root)})


def test_the_video_is_shown_where_there_is_one_and_else_the_frames(root, write_video):
    write_video(video_of(root, "a"), range(0, 250, 5))  # 5 s
    context, work = CONTEXTS["video"], work_of(root)
    assert {question.traj_id: case.variant for question, case in work.cases} == {
        "a": "source=mp4",
        "b": "source=frames",
    }
    ((_, with_video), (_, without)) = work.cases
    *frames, text = context.request(work.data, QUESTIONS[0], with_video)
    assert [frame.load().getpixel((9, 9))[0] for frame in frames] == pytest.approx([0, 50, 100, 150, 200], abs=4)
    assert text.startswith("\nAnswer the question given the video showing the agent's trajectory over time. Do not ")
    *frames, _ = context.request(work.data, QUESTIONS[1], without)
    assert frames == list(work.data.frames("b"))


def test_a_broken_video_leaves_its_questions_out_by_name_and_is_looked_at_once(root, monkeypatch):
    import cv2

    opened, capture = [], cv2.VideoCapture
    monkeypatch.setattr(cv2, "VideoCapture", lambda *where: opened.append(where) or capture(*where))
    video_of(root, "a").write_bytes(b"no video")
    work = work_of(root)
    assert [question.traj_id for question, _ in work.cases] == ["b"]
    (left_out,) = work.left_out
    assert left_out.reason.startswith(f"{video_of(root, 'a')}: not a video that OpenCV can decode")
    assert left_out.variant == "source=mp4"
    assert len(opened) == 1


def test_the_identity_changes_with_a_video(root, write_video):
    def sources():
        return CONTEXTS["video"].sources(NiehSet(root), Settings())

    found = [sources()]
    write_video(video_of(root, "a"), [9] * 20)
    found.append(sources())
    assert sources() == found[-1]
    write_video(video_of(root, "a"), [99] * 20)
    found.append(sources())
    video_of(root, "a").write_bytes(b"no video")
    found.append(sources())
    assert len({str(each) for each in found}) == 4
