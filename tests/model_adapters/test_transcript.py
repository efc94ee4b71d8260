import pytest

from infthor_eval.formats.frames import FrameRef
from model_adapters import Transcript


def test_touching_texts_are_one(frames: list[FrameRef]) -> None:
    talk = Transcript()
    talk.append("a", "b", "", frames[0])
    talk.append("", "c")
    talk.append("d")
    assert talk.parts == ("ab", frames[0], "cd")


def test_a_mark_serves_many_rewinds() -> None:
    talk = Transcript()
    talk.append("a")
    mark = talk.mark()
    for text in "bc":
        talk.append(text)
        assert talk.parts == ("a" + text,)
        talk.rewind(mark)
        assert talk.parts == ("a",)


def test_nested_marks_unwind_in_order() -> None:
    talk = Transcript()
    outer = talk.mark()
    talk.append("a")
    inner = talk.mark()
    talk.append("b")
    talk.rewind(inner)
    talk.rewind(outer)
    assert talk.parts == ()
    with pytest.raises(ValueError, match="mark"):
        talk.rewind(inner)


def test_a_mark_of_another_conversation_is_refused() -> None:
    talk, other = Transcript(), Transcript()
    talk.mark()
    with pytest.raises(ValueError, match="another conversation"):
        talk.rewind(other.mark())


def test_a_late_mark_stays_dead_after_growing_back() -> None:
    talk = Transcript()
    start = talk.mark()
    talk.append("a")
    late = talk.mark()
    talk.rewind(start)
    talk.append("b")
    with pytest.raises(ValueError, match="rewound"):
        talk.rewind(late)


def test_a_refused_part_leaves_nothing_behind() -> None:
    talk = Transcript()
    with pytest.raises(TypeError, match="int"):
        talk.append("a", 3)  # type: ignore[arg-type]
    assert talk.parts == ()
