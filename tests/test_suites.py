"""Suites and tasks that come from other packages."""

import json
import os
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from infthor_eval.errors import InfthorError, UsageError
from infthor_eval.report.plain import PlainPresenter
from infthor_eval.runs import Catalog
from infthor_eval.suites import find_presenter, find_suite, options_class, suite_code, suite_names
from tests.helpers.command_line import option_words

ROOT = Path(__file__).parents[1]
SUITE = """
from dataclasses import dataclass
from typing import Annotated
from infthor_eval.report.plain import PlainPresenter
from infthor_eval.settings import Setting
from tests.helpers.toy_suite import ToySuite

@dataclass(frozen=True)
class Options:
    abacus: Annotated[str, Setting(help="What it is made of.")] = "wood"

class SumsSuite(ToySuite):
    name, options = "sums", Options

class Shown(PlainPresenter):
    title = "Sums!"

class Renamed(SumsSuite):
    name = "other"

class Limited(SumsSuite):
    @dataclass(frozen=True)
    class options:
        limit: str = ""
"""
TASK = "task: sums\nmetadata: {suite: sums, version: 1}\n"


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A distribution with a suite and its task, as pip would leave it; its folder."""
    (tmp_path / "sums_suite.py").write_text(SUITE)
    tasks = tmp_path / "sums_tasks" / "here"
    tasks.mkdir(parents=True)
    (tasks / "sums.yaml").write_text(TASK)
    info = tmp_path / "Sums-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: Sums\nVersion: 1.0\n")
    points = (
        "[infthor_eval.suites]\n"
        "sums = sums_suite:SumsSuite\n"
        "[infthor_eval.tasks]\n"
        "sums = sums_tasks.here\n"
    )
    (info / "entry_points.txt").write_text(points)
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def command(package, *arguments):
    """Our command in a process of its own, which imports every suite for its options."""
    code = "import sys; from infthor_eval.cli import main; main(sys.argv[1:])"
    env = os.environ | {"PYTHONPATH": f"{package}{os.pathsep}{ROOT}"}
    words = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(words, check=False, capture_output=True, text=True, env=env, cwd=package)


def test_a_suite_of_another_package_runs_with_its_task_and_its_options(package):
    done = command(
        package, *option_words(model="adder", tasks="sums", abacus="bone", out=package / "out")
    )
    assert done.returncode == 1, done.stderr  # two of its sums cannot be done
    assert "the abacus is broken" in done.stderr
    (results,) = (package / "out").rglob("results.json")
    identity = json.loads(results.read_text())["config"]
    assert identity["suite"] == "sums"
    assert identity["suite_code"].keys() == {"package", "version", "source"}
    for file_format in ("every-eval-ever", "inspect"):
        words = ("--format", file_format, "--out", package / file_format)
        done = command(package, "export", results.parent, *words)
        assert (done.returncode, "2 of 4 failed" in done.stderr) == (0, True), done.stderr
    helped = command(package, "run", "--help").stdout
    assert "Options of sums: --abacus TEXT What it is made of." in " ".join(helped.split())


def test_it_is_found_by_name_behind_the_built_in_ones(package):
    assert suite_names() == ("nieh", "manipulation", "plans", "sums")
    assert find_suite("sums").name == "sums"
    assert list(options_class("sums").__dataclass_fields__) == ["abacus"]
    assert suite_code("nieh") == {}
    before = suite_code("sums")
    (package / "sums_suite.py").write_text(SUITE + "\n")
    assert suite_code("sums") != before
    assert Catalog.find_installed().tasks["sums"].suite == "sums"
    assert "sums" not in Catalog.find_packaged().tasks


@pytest.fixture
def add_presenter(package):
    """Names a class the presenter of the package's suite."""

    def add_presenter(target):
        file = package / "Sums-1.0.dist-info" / "entry_points.txt"
        file.write_text(f"{file.read_text()}[infthor_eval.presenters]\nsums = {target}\n")

    return add_presenter


@pytest.fixture
def point(package, monkeypatch):
    """Makes another target the suite `sums`, or the folder of the tasks."""

    def point(target, group="infthor_eval.suites"):
        entry_points_of_test = [EntryPoint("sums", target, group)]
        for module in ("infthor_eval.plugins", "infthor_eval.runs.catalog"):
            monkeypatch.setattr(
                f"{module}.entry_points",
                lambda group: [one for one in entry_points_of_test if one.group == group],
            )

    return point


@pytest.mark.parametrize(
    ("target", "expected"),
    [
        ("no_such_module:A", "the suite sums cannot be imported from no_such_module:A"),
        ("sums_suite:Nothing", "the suite sums cannot be imported"),
        ("sums_suite:Options", "the suite sums of another package lacks name, needs"),
        ("sums_suite:Renamed", "calls itself 'other'; give it one name"),
    ],
)
def test_what_is_no_suite_is_refused_in_one_line(point, target, expected):
    point(target)
    with pytest.raises(InfthorError, match=expected) as caught:
        find_suite("sums")
    assert "\n" not in str(caught.value)


def test_a_fault_in_the_module_of_a_suite_is_told_with_its_place(point, package):
    (package / "broken_suite.py").write_text("limits = {}\nhighest = limits['sums']\n")
    point("broken_suite:Sums")
    with pytest.raises(UsageError) as caught:
        find_suite("sums")
    place = "KeyError in broken_suite.py:2 (<module>): no 'sums'"
    assert str(caught.value) == (
        f"the suite sums cannot be imported from broken_suite:Sums ({place}); fix its package, or "
        "uninstall it"
    )


def test_a_suite_without_a_presenter_has_the_plain_one_and_a_package_may_bring_one(
    package, add_presenter
):
    assert type(find_presenter("sums")) is PlainPresenter
    assert find_presenter("nieh").title == "Questions"
    add_presenter("sums_suite:Shown")
    assert find_presenter("sums").title == "Sums!"


@pytest.mark.parametrize(
    ("target", "expected"),
    [
        ("sums_suite:Nothing", "the presenter sums cannot be imported from sums_suite:Nothing"),
        ("sums_suite:Options", "the presenter sums of another package lacks title, measure"),
    ],
)
def test_what_is_no_presenter_is_refused_in_one_line(package, add_presenter, target, expected):
    add_presenter(target)
    with pytest.raises(InfthorError, match=expected) as caught:
        find_presenter("sums")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("target", ["no_such_package.tasks", "sums_tasks.nowhere", "sums_suite"])
def test_a_package_without_the_folder_that_it_names_is_told(point, target):
    point(target, "infthor_eval.tasks")
    with pytest.raises(UsageError, match=f"the tasks sums of another package are not in {target}"):
        Catalog.find_installed()


def test_an_option_that_every_run_has_is_refused(package):
    (package / "Sums-1.0.dist-info" / "entry_points.txt").write_text(
        "[infthor_eval.suites]\nsums = sums_suite:Limited\n"
    )
    done = command(package, "--model", "adder", "--tasks", "sums")
    assert (done.returncode, done.stderr) == (
        2,
        "infthor-eval: the option limit of the suite sums is one of every run; give it another "
        "name\n",
    )


def test_no_package_can_take_a_built_in_name(monkeypatch):
    monkeypatch.setattr(
        "infthor_eval.plugins.entry_points", lambda group: [EntryPoint("nieh", "json:loads", group)]
    )
    assert type(find_suite("nieh")).__name__ == "NiehSuite"
