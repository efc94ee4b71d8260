"""Sequences of the published trainers behind the table of final tasks, against what their classes
gave.

The golden file has a small trajectory made by hand, and for each sequence the turns, the frames in
order, and the texts with loss (`tests/goldens/README.md`).
"""

import itertools
import json
from pathlib import Path

import msgspec
import pytest
from PIL import Image

from infthor_eval.errors import UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.object_ids import Words
from infthor_eval.plans.published.system_prompts import system_prompt
from infthor_eval.training.data import read_history, read_training_data
from infthor_eval.training.encoding import Encoder, SkippedSequence
from infthor_eval.training.final_sequences import goals_of_actions
from infthor_eval.training.recipe import ActionData, Recipe, read_recipe
from infthor_eval.training.starting_model import load_starting_model
from model_adapters.hf.prompting.prompt import Frame

from ..helpers.files import read_json_lines
from ..helpers.prompts import join_parts
from .twins import trained_texts

GOLDEN = Path(__file__).parents[1] / "goldens" / "final_sequences.jsonl.gz"
SIZE = 28


@pytest.fixture(scope="module")
def golden():
    return read_json_lines(GOLDEN)


@pytest.fixture(scope="module")
def encoder():
    return Encoder(load_starting_model("qwen2.5-vl-tiny", {}, "chat", seed=0))


@pytest.fixture
def make_set(tmp_path, golden):
    """Writes the golden trajectory, with changes, as a set whose frames all differ; returns the
    folder."""

    def make(**changes):
        document = golden[0]["trajectory"] | changes
        folder = tmp_path / "set" / "metadata" / "t"
        (folder / "img").mkdir(parents=True)
        images = [{"low_idx": 0, "image_name": "000000000.png"}, *golden[0]["trajectory"]["images"]]
        last = {image["low_idx"]: number for number, image in enumerate(images)}
        entries = []
        for number, image in enumerate(images):
            name, action = image["image_name"], image["low_idx"]
            Image.new("RGB", (SIZE, SIZE), (number, 7, 9)).save(folder / "img" / name)
            entry = {"img_idx": number, "img_filename": name, "step": action, "object_log": {}}
            entries.append(entry | ({"action": "did"} if number and last[action] == number else {}))
        (folder / "metadata.json").write_text(json.dumps(entries))
        (folder / "expert_log.json").write_text(json.dumps({"images": images}))
        (folder / "traj_data.json").write_text(json.dumps(document))
        return tmp_path / "set"

    return make


def recipe(form, limit=32768):
    return Recipe(
        title="-", model="-", prompt="chat", max_tokens=limit, actions=ActionData(form=form)
    )


def read_sequence(encoder, sequence):
    """The text of a sequence with a mark for each frame, and the names of its frames."""
    pieces = [piece if isinstance(piece, int) else None for piece in sequence.pieces]
    runs = itertools.groupby(pieces, key=lambda piece: piece is None)
    text = "".join(
        "<image>" * len(list(run)) if frame else encoder._tokenizer.decode(list(run))
        for frame, run in runs
    )
    return text, [piece.ref.path.name for piece in sequence.pieces if isinstance(piece, Frame)]


def written(turns):
    """Turns as Qwen's template writes them."""
    image = "<|vision_start|><image><|vision_end|>"
    return "".join(
        f"<|im_start|>{role}\n{text.replace('<image>', image)}<|im_end|>\n" for role, text in turns
    )


@pytest.mark.parametrize("limit", [131072, 1900, 1200, 900, 620])
def test_windows_of_goals_are_those_of_the_published_class(golden, make_set, limit):
    expected = [line for line in golden if line.get("form") == "goals" and line["limit"] == limit]
    _, segments = read_history(NiehSet(make_set(), needs_questions=False), "t", Words.PUBLISHED)
    windows = [
        parts
        for parts in goals_of_actions(segments, limit, 144)
        if any("<|act|>" in str(part) for part in parts)
    ]
    assert len(windows) == len(expected)
    for parts, line in zip(windows, expected, strict=True):
        turns = [["system", system_prompt("goals")], ["user", join_parts(parts)]]
        assert turns == line["messages"]
        assert [part.path.name for part in parts if isinstance(part, FrameRef)] == line["frames"]


@pytest.mark.parametrize("form", ["goals", "text", "frames"])
def test_sequences_are_those_of_the_published_classes(golden, make_set, encoder, form):
    expected = [
        line for line in golden if line.get("form") == form and line.get("limit", 131072) == 131072
    ]
    data = read_training_data(recipe(form), encoder, [make_set()])
    assert data.skipped == []
    assert len(data.sequences) == len(expected) > 0
    for sequence, line in zip(data.sequences, expected, strict=True):
        text, frames = read_sequence(encoder, sequence)
        of_turns = written(line["messages"])
        # A turn without a reply is asked for one; behind a reply the line break is left out.
        # Neither matters.
        assert text == (
            f"{of_turns}<|im_start|>assistant\n" if form == "goals" else of_turns.removesuffix("\n")
        )
        assert frames[:-1] == line["frames"][:-1]
        assert form == "frames" or frames[-1] == line["frames"][-1]
        of_loss = [text_of_loss.removesuffix("\n") for text_of_loss in line["trained"]]
        assert trained_texts(encoder, sequence) == of_loss


def test_the_current_frame_is_the_one_before_the_action_where_the_published_class_takes_another(
    golden, make_set, encoder
):
    """Its loop over N retrieved frames overwrites the number of the action with N - 1."""
    trajectory = golden[0]["trajectory"]
    last = {image["low_idx"]: image["image_name"] for image in trajectory["images"]}
    last[-1] = "000000000.png"
    published = [line["frames"][-1] for line in golden if line.get("form") == "frames"]
    data = read_training_data(recipe("frames"), encoder, [make_set()])
    ours = [read_sequence(encoder, sequence)[1][-1] for sequence in data.sequences]
    retrieved = trajectory["retrieved_image"]
    actions = {int(action): entry["top20"] for action, entry in retrieved.items()}
    assert ours == [last[action - 1] for action in actions]
    assert published == [
        last[(len(names) - 1 if names else action) - 1] for action, names in actions.items()
    ]
    assert ours != published


@pytest.mark.parametrize(
    ("form", "changes", "reason"),
    [
        ("text", {"state_summary": None}, "no state_summary, which actions of the form text need"),
        (
            "frames",
            {"retrieved_image": None},
            "no retrieved_image, which actions of the form frames",
        ),
        ("frames", {"retrieved_image": {"2": {"top5": []}}}, "is no list top20 for each action"),
        ("frames", {"images": [1]}, "images is no list of low_idx and image_name"),
    ],
)
def test_a_trajectory_without_a_memory_is_left_out_and_told(
    make_set, encoder, form, changes, reason
):
    with pytest.raises(Exception, match="no sequence to train on") as caught:
        read_training_data(recipe(form), encoder, [make_set(**changes)])
    assert reason in str(caught.value)


def test_actions_that_cannot_be_used_are_left_out_and_told(make_set, encoder, golden):
    retrieved = golden[0]["trajectory"]["retrieved_image"]
    # 7 is between two tasks.
    wrong = {"7": {"top20": []}, "99": {"top20": []}, "3": {"top20": ["000000099.png"]}}
    data = read_training_data(
        recipe("frames"), encoder, [make_set(retrieved_image=retrieved | wrong)]
    )
    assert len(data.sequences) == len(retrieved)
    assert set(data.skipped) == {
        SkippedSequence("t, action 7", "belongs to no task"),
        SkippedSequence("t, action 99", "belongs to no task"),
        SkippedSequence("t, action 3", "its retrieved frame '000000099.png' is not in the set"),
    }


def test_what_is_too_long_is_left_out_and_told(make_set, encoder):
    folder = make_set()
    whole = read_training_data(recipe("frames"), encoder, [folder])
    lengths = sorted(sequence.n_tokens for sequence in whole.sequences)
    data = read_training_data(recipe("frames", lengths[-2]), encoder, [folder])
    assert [item.reason for item in data.skipped] == [f"longer than {lengths[-2]} tokens"]
    with pytest.raises(Exception, match="max_tokens is 1, too few for one action and its frame"):
        read_training_data(recipe("goals", 1), encoder, [folder])


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({"prompt": "plain"}, "of the form goals follow a system prompt; set prompt to chat"),
        ({"actions.form": "plans"}, "sequences of plans have no turns; set prompt to plain"),
        ({"words": "natural"}, "of the form goals are in the published words; leave words out"),
        ({"actions.form": "goal"}, "Invalid enum value 'goal'"),
    ],
)
def test_settings_that_do_not_fit_are_told(settings, expected):
    with pytest.raises(UsageError, match=expected):
        read_recipe("final_goals", settings)


def test_the_recipes_have_the_published_settings():
    forms = {name: read_recipe(f"final_{name}") for name in ("goals", "text", "frames")}
    for name, settings in forms.items():
        assert settings.actions == ActionData(form=name)
        optimizer, sizes = settings.optimizer, settings.model_args
        assert (optimizer.lr, optimizer.warmup_ratio, settings.epochs) == (1e-5, 0.03, 3)
        assert sizes["min_pixels"] == sizes["max_pixels"] == str(336 * 336)
    assert (forms["goals"].max_tokens, forms["goals"].parallel.context) == (131072, 16)
    assert forms["text"].max_steps == forms["frames"].max_steps == 60000
    own = {"title": "", "source": "", "actions": None, "questions": {}}
    text, frames = (msgspec.structs.replace(forms[name], **own) for name in ("text", "frames"))
    assert text == frames
