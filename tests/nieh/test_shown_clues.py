"""How much of the evidence each context shows, counted by hand."""

import json

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.nieh.contexts import CONTEXTS, ContextSettings, QuestionVariant
from infthor_eval.nieh.records import ShownClues
from infthor_eval.nieh.samples import TaskSamples, find_samples, open_set
from infthor_eval.nieh.units import shown_clues


@pytest.fixture
def clues_shown_by(make_nieh_set):
    """Asks a question with these clues; returns what each sample shows of them, and the samples."""

    def clues_shown_by(context, clues, n_frames=10, prepare=lambda root: None, **settings):
        question = Question("t", "Where was the mug?", clues, ("Shelf",))
        root = make_nieh_set([question], n_frames=n_frames, size=8)
        prepare(root)
        open_set.cache_clear()
        task_samples = find_samples({"context": context, "data": str(root), **settings})
        return [shown_clues(task_samples, sample) for sample in task_samples.samples]

    return clues_shown_by


def clues(n_shown, n_clues, n_after):
    return ShownClues(n_shown=n_shown, n_clues=n_clues, n_after=n_after)


@pytest.mark.parametrize(
    ("numbers", "expected"),
    [
        ((8, 7), clues(2, 2, 1)),
        ((5, 6), clues(1, 2, 3)),
        ((1, 4, 2), clues(0, 3, 5)),
        ((9, 9, 3), clues(1, 2, 0)),
    ],
    ids=["all", "some", "none", "a clue twice"],
)
def test_the_end_of_a_trajectory_shows_late_clues(clues_shown_by, numbers, expected):
    # 2 * 1024 tokens hold four frames of 512: the last four of ten are 6 to 9.
    assert clues_shown_by("truncate_head", numbers, ctx_size=2, tokens_per_frame=512) == [expected]


@pytest.mark.parametrize("context", ["clues", "trajectory"])
def test_clue_frames_and_whole_trajectories_show_all(clues_shown_by, context):
    assert clues_shown_by(context, (5, 2)) == [clues(2, 2, 4)]


def test_the_haystack_shows_its_needle_at_every_depth(clues_shown_by):
    settings = {"n_frames": 30, "ctx_size": 10, "tokens_per_frame": 1000}
    assert clues_shown_by("haystack", (12,), **settings) == [clues(1, 1, 17)] * 5


def test_clues_that_follow_each_other_can_reach_out_of_the_haystack(clues_shown_by):
    # Three and more lie at the last depth: a window of five frames starts four before the first of
    # five clues.
    settings = {"ctx_size": 5, "tokens_per_frame": 1000, "depths": [0.0]}
    assert clues_shown_by("haystack", (4, 5, 6, 7, 8), **settings) == [clues(1, 5, 1)]


def test_retrieved_frames_show_the_clues_among_them(make_nieh_set):
    question = Question("t", "Where was the mug?", (4, 5, 7), ("Shelf",))
    data, context = (
        NiehSet(make_nieh_set([question], n_frames=10, size=8)),
        CONTEXTS["clip_retrieval"],
    )
    retrieved = QuestionVariant(question, (1, 4, 7))  # as the retriever gives them, in time order
    assert shown_clues(
        TaskSamples(data, "clip_retrieval", context, [], [], {}), retrieved
    ) == clues(2, 3, 2)


# A frame a second of a film of 50 frames would be five, and is rounded down to four: 0, 16, 33 and
# 49.
@pytest.mark.parametrize(
    ("fps", "numbers", "expected"),
    [
        (1, (16, 17, 33), clues(2, 3, 16)),
        # Positions in the film that is shown, not in the trajectory.
        (1, (1, 2, 3), clues(0, 3, 46)),
        (10, (16, 17, 33), clues(3, 3, 16)),
    ],
)
@pytest.mark.parametrize("has_film", [True, False])
def test_a_video_shows_the_frames_sampled_from_it(
    clues_shown_by, write_video, has_film, fps, numbers, expected
):
    def prepare(root):
        if has_film:
            write_video(root / "metadata" / "t" / "t_10fps.mp4", range(0, 250, 5))

    assert clues_shown_by("video", numbers, n_frames=50, prepare=prepare, fps=fps) == [expected]


def test_frames_are_counted_by_their_place_not_their_number(clues_shown_by):
    def number_by_tens(root):
        path = root / "metadata" / "t" / "metadata.json"
        entries = [
            entry | {"img_idx": 10 * entry["img_idx"]} for entry in json.loads(path.read_text())
        ]
        path.write_text(json.dumps(entries))

    settings = {"ctx_size": 2, "tokens_per_frame": 512, "prepare": number_by_tens}
    assert clues_shown_by("truncate_head", (50, 70), **settings) == [clues(1, 2, 2)]


def test_an_absence_has_no_evidence(make_nieh_set):
    absent = Question("t", "Is there any sink in this room?", (1, 2), ("no",), absence=True)
    data, context = NiehSet(make_nieh_set([absent], size=8)), CONTEXTS["clues"]
    (sample,) = context.samples(data, absent, ContextSettings())
    assert sample.frames == (1, 2)
    assert shown_clues(TaskSamples(data, "clues", context, [sample], [], {}), sample) is None


def test_a_set_without_frames_does_not_tell(make_nieh_set, tmp_path):
    root = make_nieh_set()
    alone = tmp_path / "alone"
    alone.mkdir()
    (root / "qa_set_test.csv").rename(alone / "qa_set_test.csv")
    task_samples = find_samples({"context": "clues", "data": str(alone)})
    assert [shown_clues(task_samples, sample) for sample in task_samples.samples] == [None] * 5
