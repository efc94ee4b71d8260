"""Runs beside each other are told apart by what differs."""

import pytest
import yaml

from infthor_eval.run import Run, with_distinct_names
from infthor_eval.runs import RunConfig, RunHeader


def names_of(runs):
    return [run.name for run in with_distinct_names(runs)]


@pytest.fixture
def stored(tmp_path):
    """Gives a run with these options."""

    def stored(folder, name="A", suite="nieh", tasks=("t",), **options):
        place = tmp_path / folder
        place.mkdir()
        (place / "run.yaml").write_text(
            yaml.safe_dump({"model": "m", "output": folder, "workers": 1, **options})
        )
        config = RunConfig(
            tasks={task: {} for task in tasks}, frames=options.get("frames", "shown")
        )
        return Run(place, RunHeader(suite=suite, name=name, config=config, n_units=0))

    return stored


def test_names_that_differ_are_enough(stored):
    assert names_of([stored("a", seed=1), stored("b", "B", seed=2)]) == ["A", "B"]
    assert names_of([stored("c", seed=1), stored("d", suite="plans", seed=2)]) == ["A", "A"]


def test_options_that_differ_are_shown_and_no_others(stored):
    runs = [
        stored("a", seed=1, model_args={"dtype": "float16", "rope": "yarn:4"}),
        stored("b", seed=1, model_args={"rope": "yarn:4"}),
        stored("c", seed=2, model_args={"rope": "yarn:4"}),
    ]
    assert names_of(runs) == ["A (dtype=float16, seed=1)", "A (seed=1)", "A (seed=2)"]


def test_where_nothing_differs_the_folder_tells(stored):
    assert names_of([stored("a"), stored("b"), stored("c", limit=2)]) == [
        "A (a)",
        "A (b)",
        "A (limit=2)",
    ]


def test_one_model_on_two_tasks_has_a_label_for_each(stored):
    assert names_of([stored("a", tasks=("t",)), stored("b", tasks=("u",))]) == ["A (t)", "A (u)"]


def test_options_tasks_and_folders_tell_in_this_order(stored):
    runs = [
        stored("a", seed=1),
        stored("b", tasks=("u",), seed=1),
        stored("c", tasks=("u",), seed=1),
        stored("d", seed=2),
    ]
    assert names_of(runs) == ["A (seed=1) (t)", "A (seed=1) (b)", "A (seed=1) (c)", "A (seed=2)"]


def test_what_replaces_the_frames_is_said_by_the_label_alone(stored):
    runs = [stored("a", seed=1), stored("b", seed=1, frames="blank"), stored("c", seed=2)]
    named = with_distinct_names(runs)
    assert [run.name for run in named] == ["A (seed=1)", "A (seed=1)", "A (seed=2)"]
    assert [run.label for run in named] == ["A (seed=1)", "A (seed=1), blank frames", "A (seed=2)"]


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
        names_of([stored(str(place), **options) for place, options in enumerate(options_of_runs)])
        == labels
    )


def test_a_run_of_an_earlier_version_has_no_options(stored, tmp_path):
    runs = [stored("a", seed=1), stored("b", seed=1)]
    (tmp_path / "b" / "run.yaml").unlink()
    assert names_of(runs) == ["A (model=m, seed=1)", "A"]
