from infthor_eval.formats.question import Question
from infthor_eval.nieh.samples import find_samples


def test_clue_frames_are_shown_in_time_order_whatever_the_files(make_nieh_set):
    question = Question("t", "Where was the mug?", (4, 1, 3), ("Shelf",))
    root = make_nieh_set([question], size=8)
    (sample,) = find_samples({"context": "clues", "data": str(root)}).samples
    assert sample.frames == (1, 3, 4)
    assert sample.question.clues == question.clues
