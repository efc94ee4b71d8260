"""Contexts part for part as the published code builds them."""

import gzip
import json
from pathlib import Path

import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.nieh.contexts import CONTEXTS, ContextSettings
from infthor_eval.nieh.samples import find_samples

GOLDEN = Path(__file__).parents[2] / "goldens" / "contexts.jsonl.gz"
QUESTION = Question("t", "Where is the mug?", (0,), ("Shelf",))
NAMES = {"full_traj": "trajectory"}  # of contexts that are called otherwise there


def call(action, *ids):
    return {
        "api_action": {
            "action": action,
            **dict(zip(("objectId", "receptacleObjectId"), ids, strict=False)),
        }
    }


TRAJECTORY = {
    "plan": {
        "low_actions": [
            call("RotateLeft"),
            call("PickupObject", "Mug|+00.1|+01.0|-00.3"),
            call("MoveAhead"),
            call("PutObject", "Mug|+00.1|+01.0|-00.3", "Fridge|-01.0|+00.0|+00.5"),
        ]
    },
    "sub_tasks": [{"task_desc": "get a mug"}, {"task_desc": "cool it"}],
    "sub_trajs": [{"low_pddl_idx": [0, 2]}, {"low_pddl_idx": [2, 4]}],
    "long_horizon_task": {},
    "state_summary": {"2": "two", "10": "ten"},
}
# The second action has two frames and the third none.
LOG = [(0, "000000001.png"), (1, "000000002.png"), (1, "000000003.png"), (3, "000000004.png")]
GOAL, STATE = "Your task goal: get a mug. ", " State: "
INTERLEAVED = [
    *(GOAL, STATE, 0, " Action: RotateLeft", STATE, 1, " Action: PickupObject Mug", STATE, 2, 3),
    *("Your task goal: cool it. ", STATE, 3, " Action: MoveAhead"),
    *(" Action: PutObject Mug Fridge", STATE, 4),
]


def parts(context, data, **settings):
    """What the context shows and tells: texts, and frames by number."""
    (sample,) = CONTEXTS[context].samples(data, QUESTION, ContextSettings(**settings))
    if isinstance(sample, SkippedQuestion):
        return sample.reason
    frames, text = CONTEXTS[context].request(data, sample)
    return [int(part.path.stem) if isinstance(part, FrameRef) else part for part in [*frames, text]]


@pytest.fixture
def make_set(make_nieh_set, tmp_path):
    """A set with a log of actions, and a folder of trajectories beside it."""

    def make(n_frames, log, trajectory, name="t.json"):
        root = make_nieh_set([QUESTION], n_frames=n_frames, size=8)
        images = [{"low_idx": action, "image_name": frame} for action, frame in log]
        (root / "metadata" / "t" / "expert_log.json").write_text(json.dumps({"images": images}))
        folder = tmp_path / "trajectories"
        folder.mkdir()
        (folder / name).write_text(json.dumps(trajectory))
        return NiehSet(root, folder)

    return make


@pytest.mark.parametrize("name", ["t.json", "t.txt"])
def test_both_modes_are_the_published_text(make_set, name):
    data = make_set(5, LOG, TRAJECTORY, name)
    assert parts("interleaved", data)[:-1] == INTERLEAVED
    assert parts("text_state", data)[:-1] == [" State: ten; Last agent's view: ", 4]


def test_contexts_equal_the_published_ones_part_for_part(make_set, tmp_path):
    with gzip.open(GOLDEN, "rt") as file:
        cases = [json.loads(line) for line in file]
    for number, case in enumerate(cases):
        frames = sorted({image["image_name"] for image in case["expert_log"]["images"]})
        log = [(image["low_idx"], image["image_name"]) for image in case["expert_log"]["images"]]
        root = tmp_path / str(number)
        root.mkdir()
        data = make_set(len(frames), log, case["trajectory"])
        sizes = {"ctx_size": case["kilo_tokens"], "tokens_per_frame": case["tokens_per_frame"]}
        assert parts(NAMES.get(case["mode"], case["mode"]), data, **sizes) == [
            part for _, part in case["parts"]
        ]
        for folder in ("set", "trajectories"):
            (tmp_path / folder).rename(root / folder)
    assert len(cases) == 48


def test_the_trajectory_in_the_set_is_read_where_no_folder_is_named(make_set):
    data = make_set(5, LOG, TRAJECTORY)
    inside = NiehSet(data.root)
    reason = "the trajectory's JSON is not in metadata/; give its folder with --trajectories"
    assert parts("interleaved", inside) == parts("text_state", inside) == reason
    (data.folder("t") / "traj_data.json").write_text(json.dumps(TRAJECTORY))
    assert parts("interleaved", inside) == parts("interleaved", data)


def test_states_of_a_trajectory_that_tells_none_are_those_beside_its_frames(make_set):
    data = make_set(5, LOG, TRAJECTORY | {"state_summary": None})
    assert parts("text_state", data) == "the trajectory has no state_summary"
    (data.folder("t") / "state_summary.json").write_text(json.dumps({"9": "nine", "10": "ten"}))
    assert parts("text_state", data)[0] == " State: ten; Last agent's view: "
    (data.folder("t") / "state_summary.json").write_text("[1]")
    with pytest.raises(DataError, match="not a mapping of low-level actions to states"):
        parts("text_state", data)


def test_a_final_task_that_stands_apart_is_the_last(make_set):
    apart = TRAJECTORY | {
        "sub_tasks": TRAJECTORY["sub_tasks"][:1],
        "long_horizon_task": TRAJECTORY["sub_tasks"][1],
    }
    assert parts("interleaved", make_set(5, LOG, apart))[:-1] == INTERLEAVED


def test_a_file_that_is_no_trajectory_is_named(make_set):
    far = TRAJECTORY | {"sub_trajs": [{"low_pddl_idx": [0, 9]}]}
    data = make_set(5, LOG, far)
    with pytest.raises(DataError, match=r"t\.json: sub_trajs reach outside"):
        parts("interleaved", data)
    with pytest.raises(DataError, match="no such folder; give the folder of the trajectories"):
        NiehSet(data.root, Path("nowhere"))


def test_another_trajectory_is_another_identity(make_set):
    data = make_set(5, LOG, TRAJECTORY)
    config = {
        "context": "interleaved",
        "data": str(data.root),
        "trajectories": str(data.trajectories),
    }
    first = find_samples(config).sources
    (data.trajectories / "t.json").write_text(json.dumps(TRAJECTORY | {"state_summary": {}}))
    assert find_samples(config).sources != first
    assert find_samples(config | {"trajectories": None}).sources != first
