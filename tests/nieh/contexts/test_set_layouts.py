"""A set in every layout that a published loader implies gives the same requests in every
context."""

import json
import shutil
from pathlib import Path

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.samples import find_samples
from infthor_eval.runs import Catalog

from ...helpers.bundled import BUNDLED, bundled_name
from ..test_requests import EXPECTED, as_text

NAME = bundled_name("kitchen-1")
# Haystacks of more frames than there are.
LONG = ("_16k", "_32k", "_64k", "_128k", "_256k", "_512k", "_1m")
TASKS = sorted(task for task in EXPECTED if not task.endswith((*LONG, "_mini_gt", "_mini_full")))
PUBLISHED_FIELDS = ("img_idx", "img_filename", "step", "object_log")


@pytest.fixture
def folder(tmp_path):
    """The folder of one trajectory in a set of its own, as it is bundled."""
    shutil.copytree(BUNDLED / "metadata" / NAME, tmp_path / "set" / "metadata" / NAME)
    lines = (BUNDLED / "qa_set_nieh_mini.csv").read_text().splitlines(keepends=True)
    (tmp_path / "set" / "qa_set_one.csv").write_text(
        lines[0] + "".join(row for row in lines if row.startswith(NAME))
    )
    return tmp_path / "set" / "metadata" / NAME


def requests(root: Path, task: str, **more) -> list[list[str]]:
    settings = dict(Catalog.find_packaged().tasks[task].settings["dataset_kwargs"])
    settings.pop("bundled", None)
    task_samples = find_samples(
        {"data": str(root), "tokens_per_frame": 121, "seed": 0, **settings, **more}
    )
    assert not [
        item.reason
        for item in task_samples.skipped
        if "fit" not in item.reason and "window" not in item.reason
    ]
    rows = []
    for sample in task_samples.samples:
        context, text = task_samples.request(sample)
        rows.append([sample.variant.replace("img_768", "img"), *map(as_text, context), text])
    return rows


def entries(folder: Path) -> list[dict]:
    """The published fields of the bundled log."""
    log = json.loads((folder / "metadata.json").read_text())
    return [{name: {"step": 0, **entry}[name] for name in PUBLISHED_FIELDS} for entry in log]


def as_list(folder: Path) -> None:
    (folder / "metadata.json").write_text(json.dumps(entries(folder)))


def as_columns(folder: Path) -> None:
    listed = entries(folder)
    (folder / "metadata.json").write_text(
        json.dumps({name: [e[name] for e in listed] for name in PUBLISHED_FIELDS})
    )


def as_numbers(folder: Path) -> None:
    (folder / "metadata.json").write_text(
        json.dumps({"img_idx": [entry["img_idx"] for entry in entries(folder)]})
    )


def as_objects(folder: Path, before_the_first: int | None = None) -> None:
    """The layout of `dev`: objects with `low_idx`, null or 0 before the first action."""
    frames = [
        {
            "low_idx": entry["step"] if number else before_the_first,
            "img_filename": entry["img_filename"],
        }
        for number, entry in enumerate(entries(folder))
    ]
    (folder / "metadata.json").write_text(json.dumps({"img_idx": frames, "traj_id": NAME}))


def as_large_images(folder: Path) -> None:
    as_list(folder)
    (folder / "img").rename(folder / "img_768")


def with_trajectories_apart(folder: Path) -> None:
    """As published: the trajectory is in a folder of its own, with the states in it."""
    as_columns(folder)
    trajectory = json.loads((folder / "traj_data.json").read_text())
    trajectory["state_summary"] = json.loads((folder / "state_summary.json").read_text())
    (folder / "traj_data.json").unlink()
    (folder / "state_summary.json").unlink()
    (folder.parents[2] / "apart").mkdir()
    (folder.parents[2] / "apart" / f"{NAME}.txt").write_text(json.dumps(trajectory))


LAYOUTS = [
    as_list,
    as_columns,
    as_numbers,
    as_objects,
    lambda at: as_objects(at, 0),
    as_large_images,
]


@pytest.mark.parametrize("task", TASKS)
def test_requests_do_not_depend_on_the_layout(folder, tmp_path, task):
    expected = requests(folder.parents[1], task)
    assert expected or "haystack" in task
    for number, layout in enumerate(LAYOUTS):
        root = tmp_path / f"layout {number}"
        shutil.copytree(folder.parents[1], root)
        layout(root / "metadata" / NAME)
        assert requests(root, task) == expected, layout
    with_trajectories_apart(folder)
    assert requests(folder.parents[1], task, trajectories=str(tmp_path / "apart")) == expected


@pytest.mark.parametrize("before_the_first", [None, 0])
def test_objects_tell_the_frames_of_actions_but_for_action_0_as_published(folder, before_the_first):
    logged = NiehSet(folder.parents[1]).action_frames(NAME)
    as_objects(folder, before_the_first)
    (folder / "expert_log.json").unlink()
    frames = NiehSet(folder.parents[1]).action_frames(NAME)
    assert frames == {action: places for action, places in logged.items() if action}


def test_another_layout_without_a_log_of_actions_says_so(folder):
    as_columns(folder)
    (folder / "expert_log.json").unlink()
    task_samples = find_samples({"data": str(folder.parents[1]), "context": "interleaved"})
    assert not task_samples.samples
    assert all("expert_log.json" in item.reason for item in task_samples.skipped)
