import json

import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.nieh.contexts import CONTEXTS, ContextSettings

QUESTION = Question("t", "Where is it?", (1,), ("Shelf",))


def shown_parts(context, root):
    """What the context shows: texts, and frames by number."""
    data = NiehSet(root)
    (sample,) = CONTEXTS[context].samples(data, QUESTION, ContextSettings())
    if isinstance(sample, SkippedQuestion):
        return sample.reason
    parts, _ = CONTEXTS[context].request(data, sample)
    return [int(part.path.stem) if isinstance(part, FrameRef) else part for part in parts]


@pytest.fixture
def folder(make_nieh_set):
    root = make_nieh_set([QUESTION], n_frames=3, size=56)
    folder = root / "metadata" / "t"
    (folder / "traj.txt").write_text(
        "<|goal|>A<|goal|><image><|act|>Go<|act|><image><|goal|>B<|goal|><image><|act|>Take<|act|><image>\n"
    )
    return folder


def test_puts_each_frame_where_the_text_has_it(folder):
    assert shown_parts("interleaved_plans", folder.parents[1]) == [
        *("<|goal|>A<|goal|>", 0, "<|act|>Go<|act|>", 1),
        *("<|goal|>B<|goal|>", 1, "<|act|>Take<|act|>", 2),
    ]


def test_takes_the_last_of_several_frames_of_an_action(folder):
    (folder / "traj.txt").write_text("Goal<image><|act|>Go<|act|><image>")
    log = {
        "images": [
            {"low_idx": 0, "image_name": "000000001.png"},
            {"low_idx": 0, "image_name": "000000002.png"},
        ]
    }
    (folder / "expert_log.json").write_text(json.dumps(log))
    assert shown_parts("interleaved_plans", folder.parents[1]) == ["Goal", 0, "<|act|>Go<|act|>", 2]
    (folder / "traj.txt").write_text("Goal<image>")
    assert "traj.txt has 0 actions" in shown_parts("interleaved_plans", folder.parents[1])
    (folder / "expert_log.json").write_text("{}")
    with pytest.raises(DataError, match=r"expert_log\.json: not in its documented form"):
        shown_parts("interleaved_plans", folder.parents[1])
