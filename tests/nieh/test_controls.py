"""Frame ablations of twins and of memories: both worlds see the same, and records say what."""

import json
import shutil
from dataclasses import replace

import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.outline import read_outline
from infthor_eval.formats.pictures.video import Video
from infthor_eval.formats.qa_csv import read_questions, write_questions
from infthor_eval.formats.question import Question
from infthor_eval.nieh.asking.recalling import recall_all
from infthor_eval.nieh.contexts import QuestionVariant
from infthor_eval.nieh.other_homes import draw_other_home
from infthor_eval.nieh.samples import find_samples, open_set
from infthor_eval.nieh.twins import twin_side
from infthor_eval.nieh.units import shown_clues
from infthor_eval.runs import read_header

from ..helpers.bundled import BUNDLED
from ..helpers.command_line import assert_refused, option_words, read_success
from ..helpers.twin_homes import CLUES, N_FRAMES, write_twin_homes

FRAMES_OF_CONTROLS = ("shown", "no-clue", "blank", "other")
FLOOR_PLANS = ("kitchen-501", "kitchen-502", "bedroom-501", "bedroom-502", "kitchen-503")


@pytest.fixture
def twins(tmp_path):
    return write_twin_homes(tmp_path / "twins", FLOOR_PLANS)


def find(root, frames, context="trajectory", **settings):
    return find_samples({"data": str(root), "frames": frames, "context": context, **settings})


def pictures(parts):
    """Names of the pictures of a request, in order."""
    frames = []
    for part in parts:
        frames += part.frames if isinstance(part, Video) else [part]
    return [frame.path.name for frame in frames if isinstance(frame, FrameRef)]


def by_world(task_samples, samples=None):
    """Pictures of each world's request, by its name."""
    return {
        sample.question.traj_id: pictures(task_samples.request(sample)[0])
        for sample in samples or task_samples.samples
    }


def own_pictures(root, name):
    return [frame.path.name for frame in open_set(str(root)).frames(name)]


# -- none


@pytest.mark.parametrize(
    ("context", "intro"),
    [
        ("interleaved_plans", "given the state and action sequence"),
        ("interleaved", "given the state and action sequence"),
        ("text_state", "given the description of the environment and the agent's state."),
        ("trajectory", "Answer the question. "),
        ("clues", "Answer the question. "),
    ],
)
@pytest.mark.parametrize("moment", [None, 40])
def test_texts_alone_speak_of_no_frame(context, intro, moment, tmp_path):
    root = shutil.copytree(BUNDLED, tmp_path / "set")
    (file,) = root.glob("qa_set*.csv")
    asked = [replace(it, moment=moment) for it in read_questions(file) if max(it.clues) <= 40]
    write_questions(file, asked)
    task_samples = find(root, "none", context)
    shown = find(root, "shown", context)
    assert len(task_samples.samples) == len(shown.samples) > 10
    for sample in task_samples.samples[::7]:
        parts, text = task_samples.request(sample)
        with_frames, _ = shown.request(sample)
        texts = [part for part in with_frames if isinstance(part, str)]
        assert [part.removesuffix("; Last agent's view: ") for part in texts] == parts
        assert intro in text
        assert "image" not in text and not any("view" in part for part in parts)
        assert task_samples.positions(sample) == task_samples.true_positions(sample) == []
    # What is said until a moment is the beginning of what is said in the end.
    if context == "interleaved_plans" and moment is not None:
        sample = task_samples.samples[0]
        whole = "".join(find(BUNDLED, "none", context).request(replace_moment(sample))[0])
        assert whole.startswith("".join(task_samples.request(sample)[0]))


def replace_moment(sample):
    """The sample of the same question at the end of its trajectory."""
    name = sample.question.traj_id
    samples = find(BUNDLED, "none", "interleaved_plans").samples
    return next(it for it in samples if it.question.traj_id == name)


def test_texts_that_are_recalled_come_without_the_view(run_cli, tmp_path):
    words = option_words(
        model="oracle", tasks="nieh_memory", data=BUNDLED, memory="text-log", out=tmp_path / "out"
    )
    read_success(run_cli(*words, "--frames", "none"))
    (file,) = (tmp_path / "out").rglob("samples_*.jsonl")
    sample = json.loads(file.read_text().splitlines()[0])
    assert "views, in time order." in json.dumps(sample)
    assert "last image" not in json.dumps(sample)


# -- no-clue


@pytest.mark.parametrize("context", ["trajectory", "video"])
def test_the_clues_of_both_worlds_are_taken_out_on_both_sides(twins, context):
    for name, seen in by_world(find(twins, "no-clue", context, fps=10)).items():
        own = own_pictures(twins, name)
        assert seen == [own[at] for at in range(N_FRAMES) if at not in CLUES]


def test_the_same_picture_at_another_step_is_no_clue(twins):
    (question, *_) = open_set(str(twins)).questions
    own = own_pictures(twins, question.traj_id)
    assert own[0] == own[1]
    on_one = replace(question, clues=(1,))
    task_samples = find(twins, "no-clue")
    parts, _ = task_samples.request(QuestionVariant(on_one, tuple(range(N_FRAMES))))
    assert pictures(parts) == [own[0], *own[2:]]


def test_clues_are_blank_where_nothing_else_is_shown(twins):
    seen = by_world(find(twins, "no-clue", "clues"))
    assert seen == dict.fromkeys(seen, ["8x8.png"] * len(CLUES))


def test_a_film_on_disk_loses_the_clues_among_its_sampled_frames(make_nieh_set, write_video):
    # A frame a second of 50 steps are steps 0, 16, 33 and 49; the second is a clue, as is 20, which
    # nobody sees.
    root = make_nieh_set(
        [Question("t", "Is there a mug?", (16, 20), ("yes",))], n_frames=50, size=8
    )
    write_video(root / "metadata" / "t" / "t_10fps.mp4", range(0, 250, 5))
    shown, without = (find(root, frames, "video") for frames in ("shown", "no-clue"))
    (sample,) = without.samples
    (all_seen,) = by_world(shown).values()
    (seen,) = by_world(without).values()
    assert seen == [*all_seen[:1], *all_seen[2:]] and len(seen) == 3
    assert shown_clues(without, sample).n_shown == 0
    assert shown_clues(shown, shown.samples[0]).n_shown == 1


def test_a_film_that_is_not_of_its_steps_is_refused(make_nieh_set, write_video):
    root = make_nieh_set([Question("t", "Is there a mug?", (1,), ("yes",))], n_frames=20, size=8)
    write_video(root / "metadata" / "t" / "t_10fps.mp4", range(0, 250, 5))
    task_samples = find(root, "no-clue", "video", fps=10)
    with pytest.raises(DataError, match="it is not known which are clues"):
        task_samples.request(task_samples.samples[0])


def test_nothing_is_taken_from_an_absence_or_changed_in_text(make_nieh_set):
    questions = [
        Question("a", "Is there a mug?", (1, 2), ("no",), absence=True),
        Question("a", "Is there a pan?", (3,), ("yes",)),
    ]
    root = make_nieh_set(questions, n_frames=5, size=8)
    asked = {}
    for frames in ("shown", "no-clue"):
        task_samples = find(root, frames)
        asked[frames] = [task_samples.request(sample) for sample in task_samples.samples]
    absence, presence = asked["no-clue"]
    assert absence == asked["shown"][0]
    assert pictures(presence[0]) == [f"{at:09d}.png" for at in (0, 1, 2, 4)]
    assert presence[1] == asked["shown"][1][1]


def test_records_say_that_no_clue_was_shown(twins):
    for context in ("trajectory", "clues", "video"):
        task_samples = find(twins, "no-clue", context, fps=10)
        for sample in task_samples.samples:
            side = twin_side(task_samples, sample)
            assert shown_clues(task_samples, sample).n_shown == 0
            assert side.n_frames == len(pictures(task_samples.request(sample)[0]))
            # Frames 3 and 5 differ, and 5 is a clue.
            assert side.n_differing == (0 if context == "clues" else 1)


@pytest.mark.parametrize("memory", ["last", "uniform", "random", "oracle"])
def test_a_memory_observes_and_shows_blank_frames_in_the_place_of_clues(twins, memory):
    task_samples = find(twins, "no-clue", "memory", memory=memory, memory_args={"k": 6})
    for sample in recall_all(task_samples):
        own = own_pictures(twins, sample.question.traj_id)
        expected = ["8x8.png" if at in CLUES else own[at] for at in sample.frames]
        assert pictures(task_samples.request(sample)[0]) == expected
        assert shown_clues(task_samples, sample).n_shown == 0
        assert set(CLUES) & set(sample.frames)


def test_a_memory_observes_anew_for_a_question_with_other_clues(make_nieh_set, tmp_path):
    questions = [
        Question("a", f"Where is the {name}?", (clue,), ("sofa",))
        for name, clue in (("mug", 1), ("pan", 3))
    ]
    root = make_nieh_set(questions, n_frames=5, size=8)
    path = tmp_path / "watcher.py"
    path.write_text(WATCHER)
    task_samples = find(root, "no-clue", "memory", memory=f"{path}:Watcher")
    first, second = (sample.recalled for sample in recall_all(task_samples))
    names = [f"{at:09d}" for at in range(4)]
    assert first == (" ".join([names[0], "8x8", *names[2:]]),)
    assert second == (" ".join([*names[:3], "8x8"]),)


WATCHER = """
from infthor_eval.memory import MemoryCapabilities


class Watcher:
    capabilities = MemoryCapabilities()

    def identity(self):
        return {}

    def begin(self, facts):
        self.seen = []

    def observe(self, step):
        self.seen.append(step.frame.path.stem)

    def recall(self, query, budget):
        return [" ".join(self.seen)]
"""


# -- another home


def test_both_worlds_see_the_same_other_home_of_their_kind(twins):
    data = open_set(str(twins))
    for seed in range(8):
        for question in data.questions:
            number = int(question.traj_id[0])
            other = draw_other_home(data, question, seed)
            alike = {at for at in range(5) if at != number}
            alike &= {0, 1, 4} if number in (0, 1, 4) else {2, 3}
            assert int(other[0]) in alike
    drawn = {draw_other_home(data, data.questions[0], seed) for seed in range(20)}
    assert len(drawn) == 4


@pytest.mark.parametrize("context", ["trajectory", "clues", "video"])
def test_what_is_shown_of_another_home_is_equal_in_both_worlds(twins, context):
    task_samples = find(twins, "other", context, fps=10)
    seen = by_world(task_samples)
    for number in range(5):
        assert seen[f"{number}-one"] == seen[f"{number}-two"]
    other = draw_other_home(task_samples.data, task_samples.samples[0].question, 0)
    places = CLUES if context == "clues" else range(N_FRAMES)
    assert seen["0-one"] == [own_pictures(twins, other)[at] for at in places]
    sides = [twin_side(task_samples, sample) for sample in task_samples.samples]
    assert {side.n_differing for side in sides} == {0}


@pytest.mark.parametrize("memory", ["random", "uniform", "oracle"])
def test_a_memory_of_another_home_is_equal_in_both_worlds(twins, memory):
    task_samples = find(twins, "other", "memory", memory=memory, memory_args={"k": 3})
    seen = by_world(task_samples, recall_all(task_samples))
    for number in range(5):
        assert seen[f"{number}-one"] == seen[f"{number}-two"]
        assert not set(seen[f"{number}-one"]) & set(own_pictures(twins, f"{number}-one"))


def test_the_only_home_of_its_kind_sees_another_kind_and_the_run_says_so(tmp_path, run_cli):
    root = write_twin_homes(tmp_path / "lonely", ("kitchen-501", "kitchen-502", "bedroom-501"))
    data = open_set(str(root))
    assert draw_other_home(data, data.questions[-1], 0)[0] in "01"
    words = option_words(model="blind", tasks="nieh_twins", data=root, out=tmp_path / "out")
    output, _ = read_success(run_cli(*words, "--controls"))
    configs = [read_header(path.parent).config for path in tmp_path.rglob("journal")]
    said = {
        config.frames: config.tasks["nieh_twins"].get("without_alike", ()) for config in configs
    }
    assert said == {**dict.fromkeys(FRAMES_OF_CONTROLS, ()), "other": ["2-one", "2-two"]}
    assert "other: 2-one, 2-two: the set has no other home of this kind of room" in output
    # It is set beside the other runs all the same.
    assert "Controls: memory of this home, and knowledge of homes" in output


def test_a_set_that_does_not_tell_its_rooms_has_every_other_home(make_nieh_set):
    questions = [Question(name, "Is there a mug?", (1,), ("yes",)) for name in "abc"]
    data = open_set(str(make_nieh_set(questions, size=8)))
    drawn = {draw_other_home(data, data.questions[0], seed) for seed in range(20)}
    assert drawn == {"b", "c"}


# -- another order


@pytest.mark.parametrize("context", ["trajectory", "clues"])
def test_frames_are_in_the_same_order_in_both_worlds(twins, context):
    task_samples = find(twins, "shuffled", context)
    orders = []
    for name in ("0-one", "0-two"):
        own = own_pictures(twins, name)
        seen = by_world(task_samples)[name]
        places = CLUES if context == "clues" else range(N_FRAMES)
        assert sorted(seen) == sorted(own[at] for at in places) and seen != [
            own[at] for at in places
        ]
        orders.append([own.index(picture) for picture in seen])
    assert orders[0] == orders[1]


# -- the flag


def test_the_flag_is_a_run_with_each_control(twins, tmp_path, run_cli):
    words = option_words(
        model="oracle",
        tasks="nieh_twins",
        data=twins,
        out=tmp_path / "out",
        context="trajectory",
    )
    output, _ = read_success(run_cli(*words, "--controls"))
    configs = [read_header(path.parent).config for path in tmp_path.rglob("journal")]
    assert sorted(config.frames for config in configs) == sorted(FRAMES_OF_CONTROLS)
    assert "of which memory" in output
    # Each is the run that its own --frames would be.
    _, _, err = run_cli(*words, "--frames", "no-clue")
    assert "0 evaluated now, 10 resumed" in err


def test_the_flag_beside_frames_and_for_other_suites_is_refused(twins, tmp_path, run_cli):
    words = option_words(model="oracle", tasks="nieh_twins", data=twins, out=tmp_path / "out")
    assert_refused(
        run_cli(*words, "--controls", "--frames", "blank"),
        "--controls and --frames: the first is --frames shown,no-clue,blank,other; give one",
    )
    words = option_words(model="scripted", tasks="infthor_plans_mini", out=tmp_path / "out")
    assert_refused(run_cli(*words, "--controls"), "--controls is for tasks of nieh")


@pytest.mark.parametrize(
    ("scene", "expected"),
    [
        ({"floor_plan": "kitchen-501"}, "kitchen-501"),
        ({"floor_plan": "FloorPlan5", "scene_num": 9}, "FloorPlan5"),
        # As the published saver writes them.
        ({"floor_plan": "", "scene_num": 12}, "FloorPlan12"),
        ({"floor_plan": None, "scene_num": "FloorPlan12"}, "FloorPlan12"),
        ({}, None),
        (None, None),
    ],
)
def test_a_trajectorys_file_tells_its_scene(tmp_path, scene, expected):
    path = tmp_path / "t.json"
    path.write_text(json.dumps({"plan": {"low_actions": []}, "scene": scene}))
    assert read_outline(path).floor_plan == expected
