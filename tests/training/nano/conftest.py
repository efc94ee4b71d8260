"""A small set to train on."""

import shutil

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.qa_csv import write_questions

from ...helpers.bundled import bundled_name


@pytest.fixture(scope="session")
def small_set(bundled_set, tmp_path_factory):
    """Two trajectories of the bundled set, and the questions on them."""
    root, names = (
        tmp_path_factory.mktemp("small"),
        (bundled_name("bedroom-1"), bundled_name("kitchen-2")),
    )
    for name in names:
        shutil.copytree(bundled_set / "metadata" / name, root / "metadata" / name)
    questions = [item for item in NiehSet(bundled_set).questions if item.traj_id in names]
    write_questions(root / "qa_set_small.csv", questions)
    return root
