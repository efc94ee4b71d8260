"""Functions of a user's file as models and policies, through the registry and the command."""

import json

import pytest
from PIL import Image

from infthor_eval.errors import ModelError, UserCodeError
from infthor_eval.formats.frames import FrameRef
from model_adapters import Decoding, label, load
from model_adapters.own_function import read_function
from model_adapters.registry import check_options, options_of

SOURCE = """
def answer(images, text, mark="!", times: int = 1, note=None):
    return f"{len(images)}|{text}|{mark * times}|{note}"


def ordered(parts):
    return "".join(part if isinstance(part, str) else f"<{part.size[0]}>" for part in parts)


def nothing(images, text):
    pass


def fails(images, text):
    raise KeyError("shelf")


def act(image, instruction, forward: "float" = 0):
    return [forward, 0, 0, 0, 0, 0, 2]


def chunk(image, instruction):
    return [[0, 0, 0, 0, 0, 0, 1]] * 3


def words(image, instruction):
    return "up"


def beyond(image, instruction):
    return [0, 0, 0, 0, 0, 0, 10**400]


def few(image, instruction):
    return [0, 1]


def strange(images, words):
    return ""


def keyed(*, parts):
    return ""


def rest(images, text, *more):
    return ""


def listed(images, text, sizes=[1]):
    return ""
"""


@pytest.fixture
def own(tmp_path):
    """Loads a function of the file by name."""
    file = tmp_path / "mine.py"
    file.write_text(SOURCE)
    return lambda name, **options: load(f"{file}:{name}", options, 0)


@pytest.fixture
def frame(tmp_path):
    Image.new("RGB", (30, 20)).save(tmp_path / "frame.png")
    return FrameRef(tmp_path / "frame.png")


def reply(model, *parts, **decoding):
    talk = model.conversation()
    talk.append("You are tidy.", role="system")
    talk.append(*parts)
    return talk.reply(Decoding(max_new_tokens=9, **decoding)).text


def test_images_and_texts_are_given_apart(own, frame):
    model = own("answer", times="2", note="x")
    assert reply(model, frame, "Where?", frame) == "2|You are tidy.\nWhere?|!!|x"
    assert model.identity() == {"mark": "!", "times": 2, "note": "x"}


def test_parts_are_given_in_order(own, frame):
    assert reply(own("ordered"), "one", frame, "two") == "You are tidy.\none<30>two"


def test_a_reply_is_cut_at_a_stop_string(own, frame):
    assert reply(own("ordered"), "one", frame, "two", stop=("<",)) == "You are tidy.\none"


def test_several_continuations_are_answered(own):
    replies = own("ordered").conversation().replies([["a"], ["b"]], Decoding(max_new_tokens=2))
    assert [one.text for one in replies] == ["a", "b"]


def test_no_text_is_an_error_that_says_what_to_return(own):
    with pytest.raises(ModelError, match=r"nothing returned None; return a text"):
        reply(own("nothing"), "one")


def test_an_error_inside_has_its_place(own):
    with pytest.raises(UserCodeError, match=r"KeyError in mine.py:\d+ \(fails\): no 'shelf'"):
        reply(own("fails"), "one")


def test_it_draws_nothing(own):
    with pytest.raises(ModelError, match="decodes greedily only"):
        reply(own("ordered"), "one", temperature=1.0)


def test_an_arm_is_moved_by_seven_numbers_or_rows_of_them(own, frame):
    (step,) = own("act", forward="0.5").act(frame, "pick up the mug")
    assert (step.translation, step.rotation, step.gripper) == ((0.5, 0, 0), (0, 0, 0), 1.0)
    assert len(own("chunk").act(frame, "pick up the mug")) == 3


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("words", r"returned 'up' .*; return seven numbers"),
        ("beyond", r"too large.*; return seven numbers"),
        ("few", r"shape \[1, 2\]"),
    ],
)
def test_other_movements_are_errors(own, frame, name, message):
    with pytest.raises(ModelError, match=message):
        own(name).act(frame, "pick up the mug")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("strange", r"takes \(images, words\); write strange\(images, text\) or strange\(parts\)"),
        ("keyed", r"takes \(\*, parts\)"),
        ("rest", r"takes \(images, text, \*more\)"),
        ("listed", r"the default of sizes is \[1\]; make it a text"),
    ],
)
def test_other_functions_are_refused(own, name, message):
    with pytest.raises(ModelError, match=message):
        own(name)


def test_options_are_listed_and_checked(own, tmp_path):
    name = f"{tmp_path}/mine.py:answer"
    assert options_of(name)["times"].default == 1
    with pytest.raises(Exception, match="times"):
        check_options(name, {"times": "many"})
    assert label(name, {}) == "answer"


def test_a_form_may_have_no_further_parameters():
    own = read_function("f.py:f", lambda parts: "", [("parts",)])
    assert (own.takes, own.options()) == (("parts",), own.options())


def test_it_is_evaluated_by_the_command(own, tmp_path, run_cli):
    name = f"{tmp_path}/mine.py:answer"
    typed = ("--model", name, "--tasks", "nieh_mini_gt", "--limit", 3)
    code, out, err = run_cli(*typed, "--out", tmp_path / "out")
    assert code == 0, err
    (results,) = (tmp_path / "out").rglob("results.json")
    assert "answer" in json.dumps(json.loads(results.read_text()))
    assert "answer" in out
