"""Runs beside each other are told apart by what differs."""

import pytest
import yaml

from infthor_eval.runs import RunConfig, RunHeader
from infthor_eval.runs.stored.labels import label_runs


@pytest.fixture
def stored(tmp_path):
    """Gives folder and header of a run with these options."""

    def stored(folder, name="A", suite="nieh", tasks=("t",), **options):
        place = tmp_path / folder
        place.mkdir()
        (place / "run.yaml").write_text(
            yaml.safe_dump({"model": "m", "output": folder, "workers": 1, **options})
        )
        return place, RunHeader(
            suite=suite, name=name, config=RunConfig(tasks={task: {} for task in tasks})
        )

    return stored


def test_names_that_differ_are_enough(stored):
    assert label_runs([stored("a", seed=1), stored("b", "B", seed=2)]) == ["A", "B"]
    assert label_runs([stored("c", seed=1), stored("d", suite="plans", seed=2)]) == ["A", "A"]


def test_options_that_differ_are_shown_and_no_others(stored):
    runs = [
        stored("a", seed=1, model_args={"dtype": "float16", "rope": "yarn:4"}),
        stored("b", seed=1, model_args={"rope": "yarn:4"}),
        stored("c", seed=2, model_args={"rope": "yarn:4"}),
    ]
    assert label_runs(runs) == ["A (dtype=float16, seed=1)", "A (seed=1)", "A (seed=2)"]


def test_where_nothing_differs_the_folder_tells(stored):
    assert label_runs([stored("a"), stored("b"), stored("c", limit=2)]) == [
        "A (a)",
        "A (b)",
        "A (limit=2)",
    ]


def test_one_model_on_two_tasks_has_one_label(stored):
    assert label_runs([stored("a", tasks=("t",)), stored("b", tasks=("u",))]) == ["A", "A"]


def test_what_the_table_shows_itself_is_left_out(stored):
    runs = [stored("a", seed=1), stored("b", seed=1, frames="blank"), stored("c", seed=2)]
    assert label_runs(runs, ignore={"frames"}) == ["A (seed=1)", "A (seed=1)", "A (seed=2)"]
    assert label_runs(runs) == ["A (seed=1)", "A (frames=blank, seed=1)", "A (seed=2)"]


@pytest.mark.parametrize(
    ("paths", "labels"),
    [
        (["/r/a/model", "/r/b/model"], ["A (pretrained=a/model)", "A (pretrained=b/model)"]),
        (["/r/model", None], ["A (pretrained=model)", "A"]),
        (["/r", "/r/model"], ["A (pretrained=r)", "A (pretrained=r/model)"]),
        (["org/model", "/r/model"], ["A (pretrained=org/model)", "A (pretrained=/r/model)"]),
    ],
)
def test_paths_are_shown_from_where_they_part(stored, paths, labels):
    options_of_runs = [
        {} if path is None else {"model_args": {"pretrained": path}} for path in paths
    ]
    assert (
        label_runs([stored(str(place), **options) for place, options in enumerate(options_of_runs)])
        == labels
    )


def test_a_run_of_an_earlier_version_has_no_options(stored, tmp_path):
    runs = [stored("a", seed=1), stored("b", seed=1)]
    (tmp_path / "b" / "run.yaml").unlink()
    assert label_runs(runs) == ["A (model=m, seed=1)", "A"]
