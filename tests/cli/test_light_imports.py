"""Commands import nothing that takes seconds and that they do not need, or not yet."""

import importlib
import os
import pkgutil
import subprocess
from pathlib import Path
from typing import Any

import click
import pytest

from infthor_eval import suites
from infthor_eval.cli import commands
from infthor_eval.cli.main import _NAMES, _infthor_eval

from ..helpers.processes import run_python

ROOT = Path(__file__).parents[2]
HEAVY = {"torch", "transformers", "numpy", "scipy", "ai2thor", "lm_eval", "datasets", "matplotlib"}
PROGRAM = """
import sys
from infthor_eval.cli import main
try:
    main(sys.argv[1:])
except SystemExit as ended:
    assert not ended.code
print(*sorted({name.partition(".")[0] for name in sys.modules}), file=sys.stderr)
"""


def run(program: str, typed: str, **options: Any) -> "subprocess.CompletedProcess[str]":
    """What a program does with the words that are typed."""
    done = run_python(program, *typed.split(), **options)
    assert done.returncode == 0, done.stderr
    return done


LISTINGS = ["ls", "ls models", "ls tasks", "ls scenes", "ls runs tests"]


@pytest.mark.parametrize("typed", ["--help", "run --help", "--version", *LISTINGS])
def test_listings_and_help_are_printed_at_once(typed: str) -> None:
    done = run(PROGRAM, typed)
    assert done.stdout
    assert not HEAVY & set(done.stderr.splitlines()[-1].split())


# Runs a command up to its first question, and prints what is imported by then.
FIRST_QUESTION = """
import sys
from infthor_eval.cli import main
from infthor_eval.cli.own_code import end_process
from infthor_eval.questions import asking

def print_modules(*_):
    print(*sorted(sys.modules), file=sys.__stdout__, flush=True)  # not that of a run
    end_process(0)

asking.ModelReplier.answer = asking.BaselineReplier.answer = print_modules
main(sys.argv[1:])
"""
AFTER_THE_QUESTIONS = {"lm_eval", "scipy.special"}  # for the results
OF_OTHERS = {
    *("ai2thor", "cv2", "datasets", "matplotlib", "networkx", "numba", "openai", "pandas", "peft"),
    *("ray", "sklearn", "scipy.optimize", "scipy.stats", "torchvision", "vllm"),
    *("infthor_eval.report.figures", "infthor_eval.report.web"),
}
OF_MODELS = {"torch", "transformers", "tokenizers", "accelerate", "safetensors", "huggingface_hub"}


@pytest.mark.parametrize(
    ("model", "not_needed"),
    [
        ("oracle", AFTER_THE_QUESTIONS | OF_OTHERS | OF_MODELS),
        ("blind", AFTER_THE_QUESTIONS | OF_OTHERS | OF_MODELS),
        # Which scales its frames by compiled code.
        ("qwen2.5-vl-nano", (AFTER_THE_QUESTIONS | OF_OTHERS) - {"numba"}),
    ],
    ids=["oracle", "blind", "qwen2.5-vl-nano"],
)
def test_the_first_question_is_asked_without_what_it_does_not_need(
    model: str, not_needed: set[str], tmp_path: Path
) -> None:
    typed = f"--model {model} --tasks nieh_mini --limit 1 --out {tmp_path}"
    loaded = set(run(FIRST_QUESTION, typed).stdout.split())
    assert "infthor_eval.nieh.asking.answering" in loaded
    assert sorted(not_needed & loaded) == []


@pytest.mark.parametrize(
    "typed",
    [
        "generate --scene bathroom-1 --test-set --out set",
        "replay nowhere.json --out set",
        "questions nowhere --out qa.csv",
        "scenes show attic-1",
    ],
)
def test_making_data_loads_nothing_of_runs(typed: str, tmp_path: Path) -> None:
    code = (
        "import sys\n"
        "from infthor_eval.cli import main\n"
        "try:\n"
        "    main(sys.argv[1:])\n"
        "except SystemExit:\n"
        "    print(*(name for name in sys.modules if name.startswith('infthor_eval')))"
    )
    loaded = run(code, typed, cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)})
    loaded = loaded.stdout.split()
    assert "infthor_eval.cli.commands.data." + typed.split(maxsplit=1)[0] in loaded
    assert not [
        name for name in loaded if name.startswith(("infthor_eval.runs", "infthor_eval.nieh"))
    ]


@pytest.mark.parametrize("name", suites.suite_names())
def test_the_baselines_that_are_listed_are_the_suites_own(name: str) -> None:
    listed = {baseline for baseline, having in suites.baseline_suites().items() if name in having}
    assert listed == set(suites.find_suite(name).baselines)


def test_every_command_is_listed_by_name():
    context = click.Context(_infthor_eval)
    listed = {name: _infthor_eval.get_command(context, name) for name in _NAMES}
    modules = [
        importlib.import_module(module.name)
        for module in pkgutil.walk_packages(commands.__path__, f"{commands.__name__}.")
        if not module.ispkg
    ]
    found = [
        it for module in modules for it in vars(module).values() if isinstance(it, click.Command)
    ]
    of_groups = [
        it for group in found if isinstance(group, click.Group) for it in group.commands.values()
    ]
    there = {command.name: command for command in found if command not in of_groups}
    assert len(modules) <= len(there)
    assert listed == there
