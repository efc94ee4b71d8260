import pytest

from infthor_eval.formats.question import Question
from infthor_eval.nieh.samples import find_samples


def test_clue_frames_are_shown_in_time_order_whatever_the_files(make_nieh_set):
    question = Question("t", "Where was the mug?", (4, 1, 3), ("Shelf",))
    root = make_nieh_set([question], size=8)
    (sample,) = find_samples({"context": "clues", "data": str(root)}).samples
    assert sample.frames == (1, 3, 4)
    assert sample.question.clues == question.clues


@pytest.mark.parametrize(
    ("tokens_per_frame", "frames"),
    [(512, (4, 5)), (1024, (5,)), (1025, (5,)), (10**6, (5,)), (100, tuple(range(6)))],
)
def test_the_last_frame_is_shown_though_it_be_larger_than_the_context(
    tokens_per_frame, frames, make_nieh_set
):
    root = make_nieh_set([Question("t", "Where was the mug?", (1,), ("Shelf",))], size=8)
    settings = {"ctx_size": 1, "tokens_per_frame": tokens_per_frame}
    found = find_samples({"context": "truncate_head", "data": str(root), **settings})
    (sample,) = found.samples
    assert (sample.frames, sample.n_cut) == (frames, 6 - len(frames))
