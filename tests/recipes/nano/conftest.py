"""A small set to train on, and a few views."""

import shutil

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.workers import WorkerSettings
from recipes.nano.architecture import PATCH_SIDE, PATCHES
from recipes.nano.views.generate import ViewJob, generate_views

from ...helpers.bundled import BUNDLED, bundled_name


@pytest.fixture(scope="session")
def small_set(tmp_path_factory):
    """Two trajectories of the bundled set, and the questions on them."""
    root, names = (
        tmp_path_factory.mktemp("small"),
        (bundled_name("bedroom-1"), bundled_name("kitchen-2")),
    )
    for name in names:
        shutil.copytree(BUNDLED / "metadata" / name, root / "metadata" / name)
    questions = [item for item in NiehSet(BUNDLED).questions if item.traj_id in names]
    write_questions(root / "qa_set_small.csv", questions)
    return root


@pytest.fixture(scope="session")
def small_views(tmp_path_factory):
    """Views of two rooms."""
    side = PATCHES * PATCH_SIDE
    jobs = [ViewJob(scene, 0, 1, 12, side, PATCHES) for scene in ("bedroom-301", "kitchen-302")]
    folder = tmp_path_factory.mktemp("views")
    generated = generate_views(jobs, embedded_launch(), folder, WorkerSettings())
    assert not generated.failures
    return generated.paths
