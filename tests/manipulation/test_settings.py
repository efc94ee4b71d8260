"""What a task file and the command line can say, and what is refused before anything is done."""

import pytest

from infthor_eval.cli.options.run import expand_suite_options
from infthor_eval.errors import DataError, UsageError
from infthor_eval.manipulation.conversion import Conversion
from infthor_eval.manipulation.environment import Grasp
from infthor_eval.manipulation.kinds import ManipulationKind
from infthor_eval.manipulation.options import ManipulationOptions
from infthor_eval.manipulation.trajectories import ArmEpisode

from ..helpers.refusals import assert_raises_one_line, read_one_line
from .arena import task_of

PICK = ArmEpisode(4, ManipulationKind.PICKUP, "AppleSliced")
PUT = ArmEpisode(9, ManipulationKind.PUT, "ButterKnife", "SinkBasin")


# -- what a policy is told


@pytest.mark.parametrize(("kind", "template", "episode", "expected"), [
    ("pickup", None, PICK, "pick up the sliced apple"),
    ("put", None, PUT, "put the butter knife in the sink"),
    ("pickup", "short", PICK, "Pick-up"),
    ("put", "short", PUT, "Put"),
    ("pickup", "grasp {object}!", PICK, "grasp sliced apple!"),
    ("put", "{receptacle}: {object}, {object}", PUT, "sink: butter knife, butter knife"),
    ("put", "put the {object} down", PUT, "put the butter knife down"),
    ("pickup", "{{{object}}}", PICK, "{sliced apple}"),
])  # fmt: skip
def test_what_a_policy_is_told(data, kind, template, episode, expected):
    settings = {} if template is None else {"instruction": template}
    by_file = task_of(data, kind=kind, **settings)
    by_option = task_of(data, ManipulationOptions(instruction=template), kind=kind)
    assert by_file.instruction(episode) == by_option.instruction(episode) == expected


@pytest.mark.parametrize("template", [
    "", "pick it up", "{{object}}", "{}", "{0}", "{object", "object}", "{object!r}", "{object:>9}",
    "{object.real}",
    "{object[0]}", "{object} to {receptacle}", "{object} {colour}", "Short", "{Object}",
    "{object:{object}}",
])  # fmt: skip
@pytest.mark.parametrize("by", ["file", "option"])
def test_words_that_do_not_tell_the_object_are_refused(data, template, by):
    settings = {"instruction": template} if by == "file" else {}
    options = ManipulationOptions(instruction=template if by == "option" else None)
    with pytest.raises(UsageError, match="a_task: the instruction ") as caught:
        task_of(data, options, kind="pickup", **settings)
    assert "must have {object}, and nothing else in braces" in read_one_line(caught)


def test_words_of_puts_may_have_a_receptacle_and_must_have_an_object(data):
    with pytest.raises(UsageError, match=r"must have \{object\} and may have \{receptacle\}"):
        task_of(data, kind="put", instruction="into the {receptacle}")


# -- radii


@pytest.mark.parametrize(
    "radius", ["0.039", "0.51", "0", "-0.1", "nan", "inf", "wide", "0,06", "6 cm"]
)
def test_a_radius_that_no_hand_has_is_refused(radius):
    valid = r"--radius .*: give a number of metres from 0\.04, at most 0\.5"
    with pytest.raises(UsageError, match=valid) as caught:
        expand_suite_options("manipulation", {"radius": radius}, ["manipulation"])
    read_one_line(caught)


@pytest.mark.parametrize("radius", [0.039, 0.6, 5])
def test_nor_may_a_task_file_have_it(data, radius):
    with pytest.raises(DataError, match=f"radius is {radius}; it is a number of metres from 0.04"):
        task_of(data, radius=radius)


def test_the_command_line_goes_before_the_file(data):
    assert task_of(data, radius=0.1).settings.grasp.radius == 0.1
    typed = {"radius": "0.04,0.5,6e-2"}
    given = expand_suite_options("manipulation", typed, ["manipulation"])
    radii = [task_of(data, options, radius=0.1).settings.grasp.radius for options in given]
    assert radii == [0.04, 0.5, 0.06]


@pytest.mark.parametrize("frames", ["", "Blank", "black", "shown,blank"])
def test_frame_ablations_for_frames_that_do_not_exist_are_refused(frames):
    with pytest.raises(UsageError, match="give shown or blank"):
        ManipulationOptions(frames=frames)


# -- settings


def test_settings_have_defaults_and_all_of_them_act(data):
    plain = task_of(data).settings
    assert plain.grasp == Grasp(0.5, takes_all=False, at_palm=False, threshold=0.5)
    assert plain.conversion == Conversion(1.0, 0.1, rotation=True, return_to_start=True)
    assert (plain.camera, plain.max_steps, plain.reward) == ((300, 60.0), 60, 2.0)
    changed = task_of(
        data, radius=0.06, grasps="all", hold="palm", gripper_threshold=0.7, translation_scale=2,
        max_step=0.05,
        rotation=False, return_to_start=False, image_size=224, field_of_view=90, max_steps=9,
        reward=1,
    ).settings  # fmt: skip
    assert changed.grasp == Grasp(0.06, takes_all=True, at_palm=True, threshold=0.7)
    assert changed.conversion == Conversion(2, 0.05, rotation=False, return_to_start=False)
    assert (changed.camera, changed.max_steps, changed.reward) == ((224, 90), 9, 1)


@pytest.mark.parametrize(("settings", "expected"), [
    ({"kind": "throw"}, "kind is 'throw'; it is pickup or put"),
    ({"radios": 0.5}, "radios is not known; did you mean radius?"),
    ({"colour": "red"}, "colour is not known; there are bundled, closing"),
    ({"grasps": "some"}, "grasps is 'some'; it is target or all"),
    ({"hold": "tight"}, "hold is 'tight'; it is middle or palm"),
    ({"max_steps": 0}, "max_steps is 0; it is a whole number from 1"),
    ({"max_steps": 2.5}, "max_steps is 2.5; it is a whole number from 1"),
    ({"max_step": -0.1}, "max_step is -0.1; it is a number above 0"),
    ({"max_step": float("inf")}, "max_step is inf; it is a number above 0"),
    ({"translation_scale": "big"}, "translation_scale is 'big'; it is a number above 0"),
    ({"rotation": "off"}, "rotation is 'off'; it is true or false"),
    ({"rotation": 0}, "rotation is 0; it is true or false"),
    ({"instruction": 7}, "instruction is 7; it is a text"),
    ({"radius": True}, "radius is True; it is a number of metres from 0.04, at most 0.5"),
    ({"field_of_view": 180}, "field_of_view is 180; it is a number of degrees above 0, below 180"),
    ({"gripper_threshold": 1.5}, "gripper_threshold is 1.5; it is a number above 0, at most 1"),
    ({"bundled": "nothing"}, "the installation lacks its data folder 'sets/nothing'"),
])  # fmt: skip
def test_a_setting_that_would_not_act_is_refused(data, settings, expected):
    assert_raises_one_line(lambda: task_of(data, **settings), expected, (DataError, UsageError))


# -- trajectories


def test_a_tasks_episodes_are_of_its_kind(data):
    assert [episode.index for _, episode in task_of(data, kind="pickup").episodes] == [9]
    assert [episode.index for _, episode in task_of(data, kind="put").episodes] == [21]
    (_, put), *_ = task_of(data, kind="put").episodes
    assert (put.object_type, put.receptacle_type) == ("Mug", "Desk")


def test_no_trajectories_are_refused(data, tmp_path):
    empty = tmp_path / "empty"
    empty.mkdir()
    for place, error, expected in (
        (None, UsageError, "this task has no trajectories of its own; give them as --data"),
        (tmp_path / "nowhere", UsageError, "there is no such file or folder"),
        (empty, DataError, "no .json, .jsonl, .jsonl.gz file"),
    ):
        with pytest.raises(error, match=expected) as caught:
            task_of(place)
        read_one_line(caught)
