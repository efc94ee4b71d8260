import json

import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.pictures.video import Video
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import CONTEXTS, ContextSettings
from infthor_eval.nieh.docs import doc_of, doc_parts, doc_prompt, sample_of
from infthor_eval.nieh.samples import find_samples, open_set

from ...helpers.questions import make_question

QUESTIONS = [make_question("a"), Question("b", "Is there a sink?", (0,), ("no",))]


@pytest.fixture
def root(make_nieh_set):
    return make_nieh_set(QUESTIONS, n_frames=5, size=56)


def video_of(root, traj_id):
    return root / "metadata" / traj_id / f"{traj_id}_10fps.mp4"


def samples_of(root, **settings):
    open_set.cache_clear()
    return find_samples({"context": "video", "data": str(root), **settings})


def test_the_video_is_shown_where_there_is_one_and_else_the_frames(root, write_video):
    write_video(video_of(root, "a"), range(0, 250, 5))  # 5 s
    context, task_samples = CONTEXTS["video"], samples_of(root)
    assert {sample.question.traj_id: sample.variant for sample in task_samples.samples} == {
        "a": "source=mp4",
        "b": "source=frames",
    }
    with_video, without = task_samples.samples
    (video,), text = context.request(task_samples.data, with_video)
    # Four of 50 frames, at least: the first, the last and two between them.
    assert [frame.load().getpixel((9, 9))[0] for frame in video.frames] == pytest.approx(
        [0, 80, 165, 245], abs=4
    )
    assert video.fps == pytest.approx(4 / 5)
    assert text.startswith(
        "\nAnswer the question given the video showing the agent's trajectory over time. Do not "
    )
    (video,), _ = context.request(task_samples.data, without)
    assert video == Video(
        tuple(task_samples.data.frames("b")[at] for at in (0, 1, 3, 4)), 4 / 5 * 10
    )


def test_the_rate_is_a_setting(root, write_video):
    write_video(video_of(root, "a"), range(80))
    n_frames = []
    for fps in (1, 2):
        task_samples = samples_of(root, fps=fps)
        (video,), _ = CONTEXTS["video"].request(task_samples.data, task_samples.samples[0])
        n_frames.append(len(video.frames))
    assert n_frames == [8, 16]
    for wrong in (0, 11, "x"):
        with pytest.raises(
            DataError, match=r"fps is .*; it is a number of frames per second above 0, at most 10"
        ):
            samples_of(root, fps=wrong)


def test_frames_of_a_video_can_be_ablated(root):
    plain, blank = (samples_of(root, frames=frames) for frames in ("shown", "blank"))
    (video,), _ = plain.request(plain.samples[1])
    (grey,), _ = blank.request(blank.samples[1])
    assert (len(grey.frames), grey.fps) == (len(video.frames), video.fps)
    assert {frame.load().getcolors()[0][1] for frame in grey.frames} == {(128, 128, 128)}


def test_docs_of_lm_eval_give_the_same_frames_as_images(root):
    task_samples = samples_of(root, fps=2)
    for sample in task_samples.samples:
        (video,), text = task_samples.request(sample)
        doc = json.loads(json.dumps(doc_of(task_samples, sample)))
        assert sample_of(doc).fps == 2
        assert doc_parts(doc) == [*video.frames, text]
        assert doc_prompt(doc) == "<image>" * len(video.frames) + text


def test_a_broken_video_has_its_questions_skipped_by_name_and_is_looked_at_once(root, monkeypatch):
    import cv2

    opened, capture = [], cv2.VideoCapture
    monkeypatch.setattr(cv2, "VideoCapture", lambda *where: opened.append(where) or capture(*where))
    video_of(root, "a").write_bytes(b"no video")
    task_samples = samples_of(root)
    assert [sample.question.traj_id for sample in task_samples.samples] == ["b"]
    (skipped,) = task_samples.skipped
    assert skipped.reason.startswith(f"{video_of(root, 'a')}: not a video that OpenCV can decode")
    assert skipped.variant == "source=mp4"
    assert len(opened) == 1


def test_the_identity_changes_with_a_video(root, write_video):
    def sources():
        return CONTEXTS["video"].sources(NiehSet(root), ContextSettings())

    identities = [sources()]
    write_video(video_of(root, "a"), [9] * 20)
    identities.append(sources())
    assert sources() == identities[-1]
    write_video(video_of(root, "a"), [99] * 20)
    identities.append(sources())
    video_of(root, "a").write_bytes(b"no video")
    identities.append(sources())
    assert len({str(each) for each in identities}) == 4
