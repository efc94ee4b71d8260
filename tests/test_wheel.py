"""A wheel works away from the checkout: what it needs beside the code is in it."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from .docs.commands import code_of
from .helpers.benchmarks import load_benchmark
from .helpers.command_line import option_words

BUILDING = load_benchmark("wheel_size")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    return BUILDING.build_wheel(tmp_path_factory.mktemp("built"))


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    target = tmp_path_factory.mktemp("installed")
    BUILDING.pip("install", "--target", target, wheel)
    return target


@pytest.fixture
def environment(installed):
    """The environment of a shell in which the wheel's commands are those that are found."""
    folders = (str(installed / "bin"), str(Path(sys.executable).parent), os.environ["PATH"])
    return {**os.environ, "PYTHONPATH": str(installed), "PATH": os.pathsep.join(folders)}


@pytest.fixture
def command(environment, tmp_path):
    """Runs the installed command in an empty folder, where no checkout is in sight."""

    def command(*words):
        done = subprocess.run(
            ["infthor-eval", *words],
            check=False,
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    return command


def test_all_data_of_the_packages_is_in_it(wheel):
    packed = set(zipfile.ZipFile(wheel).namelist())
    root = BUILDING.ROOT
    files = [
        path for name in BUILDING.SOURCES for path in (root / name).rglob("*") if path.is_file()
    ]
    ours = {str(path.relative_to(root)) for path in files}
    moved = {
        f"infthor_eval/{path}" if path.startswith(("tasks/", "results/")) else path for path in ours
    }
    missing = {path for path in moved - packed if "__pycache__" not in path}
    assert missing == set()
    assert not [name for name in packed if name.startswith("infthor_board")]


def test_what_runs_is_the_installed_code(installed, tmp_path):
    code = (
        "import infthor_eval, infthor_sim, model_adapters as other\n"
        "print(infthor_eval.__file__, infthor_sim.__file__, other.__file__)"
    )
    env = {**os.environ, "PYTHONPATH": str(installed)}
    module_paths = subprocess.check_output(
        [sys.executable, "-c", code], cwd=tmp_path, env=env, text=True
    ).split()
    assert all(Path(path).is_relative_to(installed) for path in module_paths)


def test_it_runs_in_an_empty_folder(command, tmp_path):
    assert "nieh_haystack_{8k,...,1m}" in command("ls", "tasks")
    assert (Path(command("ls", "tasks", "--path").strip()) / "nieh" / "nieh_mini_gt.yaml").is_file()
    words = (
        *option_words(model="blind,oracle,qwen2.5-vl-nano", tasks="nieh_mini_gt", limit="20"),
        "--full",
    )
    table = command(*words)
    assert "Qwen2.5-VL 7B" in table  # the published numbers came with it
    # The first: $XDG_CACHE_HOME.
    assert {path.name for path in tmp_path.iterdir()} - {"cache"} == {"results"}


@pytest.mark.parametrize("page", ["README.md", "docs/tutorial.md", "docs/howto/lm-eval.md"])
def test_every_command_of_a_page_runs_as_typed(page, environment, tmp_path):
    """Those that need weights, a server or files of the reader's have a reason."""
    commands = [command for code in code_of(page) for command in code.commands]
    typed = [command for command in commands if command.reason is None]
    assert typed
    for command in typed:
        done = subprocess.run(
            ["bash", "-c", command.text],
            check=False,
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
        )
        assert done.returncode == command.exit_code, f"{command.text}\n{done.stderr}"


def test_lm_evals_command_knows_its_tasks(command):
    words = ("--model", "infthor", "--model_args", "adapter=qwen2.5-vl-tiny", "--limit", "2")
    assert "nieh_mini_gt" in command("lm-eval", "run", *words, "--tasks", "nieh_mini_gt")


def test_the_simulator_runs_by_itself(installed, tmp_path):
    code = "from infthor_sim import Controller\nwith Controller(): print('started')"
    env = {**os.environ, "PYTHONPATH": str(installed), "HOME": str(tmp_path)}
    printed = subprocess.check_output([sys.executable, "-c", code], cwd=tmp_path, env=env)
    assert printed == b"started\n"


def test_plans_and_scenes_run_too(command, tmp_path):
    command("--model", "planner", "--tasks", "infthor_plans_mini", "--limit", "1")
    command("scenes", "show", "kitchen-7", "--out", "kitchen.png")
    assert (tmp_path / "kitchen.png").is_file()
