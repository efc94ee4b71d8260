import pytest

from infthor_eval.errors import DataError, UsageError
from infthor_eval.runs import Catalog
from infthor_eval.runs.catalog import KEYS


def test_the_packaged_tasks_are_those_that_lm_eval_sees():
    from lm_eval.tasks import TaskManager

    catalog = Catalog.find_packaged()
    manager = TaskManager(include_path=str(catalog.folder), include_defaults=False)
    assert sorted([*catalog.tasks, *catalog.groups]) == sorted({*manager.all_tasks} - {"infthor"})
    assert [task.name for task in catalog.expand(["nieh"])] == ["nieh_gt", "nieh_full"]
    twice = catalog.expand(["nieh_mini_full", "nieh_mini"])
    assert [task.name for task in twice] == ["nieh_mini_full", "nieh_mini_gt"]
    assert {task.suite for task in catalog.tasks.values()} == {"nieh", "plans", "manipulation"}
    assert catalog.tasks["nieh_gt"].settings["generation_kwargs"]["max_gen_toks"] == 50


def test_the_known_keys_are_those_that_lm_eval_reads():
    from dataclasses import fields

    from lm_eval.config.group import GroupConfig
    from lm_eval.config.task import TaskConfig

    read = {field.name for kind in (TaskConfig, GroupConfig) for field in fields(kind)}
    assert {*KEYS} == read | {"include"}


def test_each_task_says_what_distinguishes_it_and_that_is_no_setting():
    tasks = Catalog.find_packaged().tasks.values()
    descriptions = [task.description for task in tasks]
    assert all(descriptions)
    assert len(set(descriptions)) == len(descriptions)
    assert {tuple(task.settings["metadata"]) for task in tasks} == {("version", "suite")}


@pytest.mark.parametrize(
    ("name", "near"), [("nieh_ful", "'nieh_full'"), ("neih", "'nieh'"), ("xyz", "nieh_gt")]
)
def test_an_unknown_name_is_answered_with_the_nearest(name, near):
    with pytest.raises(UsageError) as caught:
        Catalog.find_packaged().expand([name])
    assert near in str(caught.value)


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("task: [", "not YAML"),
        ("- a", "not a mapping"),
        ("output_type: generate_until", "neither a task nor a group name"),
        ("task: a\noutput_type: generate_until", "no suite; write it as metadata"),
        ("group: g\ntask: a", "must be a list"),
        ("include: none.yaml\ntask: a", "cannot be read"),
        ("task: a\nmetric_lst: []", "metric_lst is not known; did you mean metric_list?"),
        ("task: a\nxyz: 1", "xyz is not known; leave it out, or put it under metadata"),
    ],
)
def test_a_broken_task_file_is_named(tmp_path, content, expected):
    (tmp_path / "a.yaml").write_text(content)
    with pytest.raises(DataError, match=expected) as caught:
        Catalog(tmp_path).expand(["a"])
    assert "yaml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_key_that_the_suite_needs_is_named(tmp_path):
    (tmp_path / "a.yaml").write_text("task: a\nmetadata: {suite: nieh}\ntest_split: test")
    (task,) = Catalog(tmp_path).expand(["a"])
    task.require("test_split")
    with pytest.raises(
        DataError,
        match=r"a\.yaml: no dataset_kwargs; tasks of nieh need test_split, dataset_kwargs",
    ):
        task.require("test_split", "dataset_kwargs")
