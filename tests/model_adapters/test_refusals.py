import pytest

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters import Capabilities, Turn, Video, check_decoding, check_turns

from .asking import up_to, user


@pytest.mark.parametrize(
    ("able", "settings"),
    [
        ({}, {}),
        ({}, {"top_p": 0.5, "seed": 3, "stop": ("x",)}),  # greedy all the same
        ({"sampling": True}, {"temperature": 0.5, "top_p": 0.5}),
        ({"choices": True}, {"choices": ("yes", "no")}),
    ],
)
def test_what_a_model_can_do_is_let_through(able, settings):
    check_decoding("m", Capabilities(**able), up_to(3, **settings))


@pytest.mark.parametrize(
    ("able", "settings", "complaint"),
    [
        (
            {"choices": True},
            {"temperature": 0.5},
            "m decodes greedily only, not at temperature 0.5; ask at",
        ),
        (
            {"sampling": True},
            {"choices": ("yes", "no")},
            r"m does not support choices \(2 given\); ask without choices",
        ),
    ],
)
def test_what_it_cannot_do_is_refused(able, settings, complaint):
    with pytest.raises(ModelError, match=complaint):
        check_decoding("m", Capabilities(**able), up_to(3, **settings))


def test_only_a_users_turn_can_be_replied_to():
    check_turns("m", Capabilities(), user("What?"))
    with pytest.raises(
        ModelError, match="m has nothing to reply to: the conversation is empty; append a user turn"
    ):
        check_turns("m", Capabilities(), ())
    with pytest.raises(
        ModelError,
        match="nothing to reply to: the last turn is the assistant's; append a user turn",
    ):
        check_turns("m", Capabilities(), (*user("What?"), Turn("assistant", ("This.",))))


def test_a_video_needs_a_video_input(tmp_path):
    turns = user(Video((FrameRef(tmp_path / "a.png"),), 1.0), "What?")
    check_turns("m", Capabilities(video_input=True), turns)
    with pytest.raises(
        ModelError, match="m has no video input; give it the video's frames as images"
    ):
        check_turns("m", Capabilities(), turns)


def test_frames_need_an_image_input(tmp_path):
    frame = FrameRef(tmp_path / "a.png")
    blind = Capabilities(image_input=False)
    check_turns("m", blind, user("What?"))
    for part in (frame, Video((frame,), 1.0)):
        with pytest.raises(ModelError, match="m reads text alone, and this context has frames"):
            check_turns("m", blind, user(part, "What?"))
