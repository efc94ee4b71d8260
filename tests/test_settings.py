"""A setting stands once: one that is planted there is found wherever settings are read."""

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import pytest
from msgspec import Meta

from infthor_eval.errors import UsageError
from infthor_eval.quantities import Share, Total
from infthor_eval.settings import Declared, Setting
from model_adapters.options.checkpoints import HfOptions
from model_adapters.registry import read_options

# In a process of its own, before anything has read the settings of NIEH.
PLANTING = """
import contextlib, dataclasses, io, json, sys
from pathlib import Path
from typing import Annotated

from infthor_eval.nieh import options
from infthor_eval.quantities import Total
from infthor_eval.settings import Setting

@dataclasses.dataclass(frozen=True, kw_only=True)
class Planted(options.NiehSettings):
    stride: Annotated[
        Total | None,
        Setting(
            help="Every how many steps a frame is shown.",
            where="size",
            in_config=True,
            cause="the context or its window",
        ),
    ] = None

options.NiehOptions = dataclasses.make_dataclass(
    "NiehOptions", [], bases=(options.NiehOptions, Planted), frozen=True, kw_only=True
)
options.NiehSettings = Planted

from infthor_eval.cli.main import main
from infthor_eval.errors import InfthorError
from infthor_eval.nieh.task import check_task_file
from infthor_eval.runs import TaskFile
from tests.docs.settings_tables import with_tables

def typed(*words):
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        with contextlib.suppress(SystemExit):
            main(list(words))
    return " ".join(said.getvalue().split())

def refusal(value):
    settings = {"dataset_kwargs": {"context": "clues", "stride": value}}
    try:
        check_task_file(TaskFile("own", "nieh", Path("own.yaml"), settings))
    except InfthorError as error:
        return str(error)

def run(task, *stride):
    given = ("--model", "blind", "--limit", "2", "--data", sys.argv[1], "--out", sys.argv[2])
    return typed("run", *given, "--tokens-per-frame", "100", "--tasks", task, *stride)

haystack = "nieh_haystack_8k"
run(haystack), run(haystack, "--stride", "3")
runs = [path.parent for path in sorted(Path(sys.argv[2]).glob("*/*/results.json"))]
journals = [next((run / "journal").iterdir()).read_text().splitlines() for run in runs]
configs = [json.loads(journal[0])["config"] for journal in journals]
if configs[0].get("stride"):  # folders are called by hashes
    runs.reverse(), configs.reverse()
table = "<!-- settings: infthor_eval.nieh.contexts:ContextSettings -->\\n<!-- end -->"
print(json.dumps({
    "help": typed("run", "--help"),
    "wrong": run(haystack, "--stride", "0"),
    "unused": typed("run", "--model", "blind", "--tasks", "nieh_mini_gt", "--stride", "3"),
    "task": [refusal(3), refusal("x")],
    "config": [config.get("stride") for config in configs],
    "folders": [run.name for run in runs],
    "table": with_tables(table),
    "explained": typed("explain", *map(str, runs)),
}))
"""


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What is found of a planted setting, by where."""
    import infthor_eval

    data = Path(infthor_eval.__file__).parent / "sets" / "nieh_mini"
    out = tmp_path_factory.mktemp("runs")
    done = subprocess.run(
        [sys.executable, "-c", PLANTING, str(data), str(out)],
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).parents[1],
    )
    assert done.returncode == 0, done.stderr
    result: dict[str, Any] = json.loads(done.stdout)
    return result


def test_a_planted_setting_is_an_option_with_its_sentence_and_limits(found: dict[str, Any]) -> None:
    assert "--stride INTEGER Every how many steps a frame is shown." in found["help"]
    assert found["wrong"].endswith("--stride 0: give a whole number from 1")


def test_it_is_a_setting_of_task_files(found: dict[str, Any]) -> None:
    none, wrong = found["task"]
    assert none is None
    assert wrong == "own.yaml: dataset_kwargs: stride is 'x'; it is a whole number from 1"


def test_it_is_in_the_config_of_a_run_and_its_hash(found: dict[str, Any]) -> None:
    assert set(found["config"]) == {None, 3}
    assert len(set(found["folders"])) == 2


def test_it_is_in_the_table_of_the_documentation(found: dict[str, Any]) -> None:
    row = "| `stride` | whole number | - | Every how many steps a frame is shown. |"
    assert row in found["table"]


def test_it_is_refused_where_it_has_no_effect(found: dict[str, Any]) -> None:
    refused = "--stride 3: no context of nieh_mini_gt has a size in tokens; leave it out"
    assert refused in found["unused"]


def test_a_difference_in_it_has_its_cause(found: dict[str, Any]) -> None:
    assert "the context or its window stride - 3" in found["explained"]


def test_an_option_of_a_model_stands_in_one_place_too(
    monkeypatch: pytest.MonkeyPatch, run_cli: Callable[..., tuple[int, str, str]]
) -> None:
    @dataclass(frozen=True, kw_only=True)
    class Planted(HfOptions):
        stride: Annotated[Total | None, Setting(help="Every how many steps a frame is shown.")] = (
            None
        )

    monkeypatch.setattr(sys.modules[HfOptions.__module__], "HfOptions", Planted)
    printed = " ".join(run_cli("ls", "models", "pixtral-tiny")[1].split())
    assert "stride none Every how many steps a frame is shown." in printed
    assert read_options("pixtral-tiny", {"stride": "3"}).stride == 3
    with pytest.raises(UsageError, match="stride=0: give a whole number from 1"):
        read_options("pixtral-tiny", {"stride": "0"})


@pytest.mark.parametrize(
    ("kind", "setting", "valid"),
    [
        (Total | None, Setting(of="tokens"), "a whole number of tokens from 1"),
        (Annotated[float, Meta(gt=0, le=10)], Setting(), "a number above 0, at most 10"),
        (str, Setting(), "a text"),
        (bool, Setting(), "true or false"),
        (int, Setting(choices=(1000, 1024)), "1000 or 1024"),
        (str, Setting(choices=("a", "b", "c")), "one of a, b, c"),
        (tuple[Share, ...], Setting(is_a="a list of shares"), "a list of shares"),
    ],
)
def test_valid_values_are_said_in_words(kind: Any, setting: Setting, valid: str) -> None:
    assert Declared(Annotated[kind, setting], None, setting).valid == valid
