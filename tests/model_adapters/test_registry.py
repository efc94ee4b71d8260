import subprocess
import sys
import types
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from typing import Any

import pytest

from infthor_eval.errors import ModelError, UsageError
from model_adapters import Bound, load, names, options, registry


def test_names_and_help_need_neither_torch_nor_transformers() -> None:
    code = (
        "import sys, model_adapters as m; m.names(); m.load('oracle', {}, 0);"
        "sys.exit(bool({'torch', 'transformers'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_built_in_names() -> None:
    assert {"oracle", "blind", "random", "qwen2.5-vl", "qwen2.5-vl-tiny"} <= set(names())


@pytest.mark.parametrize(("typed", "meant"), [("qwen2.5vl", "qwen2.5-vl"), ("oracel", "oracle")])
def test_unknown_model_names_the_nearest(typed: str, meant: str) -> None:
    with pytest.raises(UsageError, match=f"no model {typed}; did you mean {meant}"):
        load(typed, {}, 0)


def test_far_off_name_lists_all() -> None:
    with pytest.raises(UsageError, match=r"no model zzz; models: .*qwen2\.5-vl"):
        load("zzz", {}, 0)


def test_unknown_option_names_the_nearest_and_all_with_defaults() -> None:
    with pytest.raises(UsageError, match=r"no option dtyp; did you mean dtype\?.*share_prefix=true"):
        load("qwen2.5-vl-tiny", {"dtyp": "float32"}, 0)


def test_an_adapter_without_options_says_so() -> None:
    with pytest.raises(UsageError, match="it takes: no options"):
        load("oracle", {"dtype": "float32"}, 0)


def test_options_are_listed_with_their_defaults() -> None:
    assert "pretrained=Qwen/Qwen2.5-VL-7B-Instruct" in options("qwen2.5-vl")


@dataclass(frozen=True)
class _Options:
    sure: bool = False


class Outside:
    Options = _Options

    def __init__(self, name: str, sure: bool, seed: int) -> None:
        self.name, self.sure, self.seed = name, sure, seed

    @classmethod
    def build(cls, name: str, options: _Options, seed: int) -> "Outside":
        return cls(name, options.sure, seed)

    def identity(self) -> dict[str, Any]:
        return {}

    def study(self, questions: Any) -> None:
        pass

    def answer(self, question: Any) -> str:
        return ""


def _install(monkeypatch: pytest.MonkeyPatch, target: str, name: str = "outside") -> None:
    point = EntryPoint(name, target, registry.ENTRY_POINTS)
    monkeypatch.setattr(registry, "entry_points", lambda group: [point] if group == point.group else [])


def test_models_of_other_packages_come_through_entry_points(monkeypatch: pytest.MonkeyPatch) -> None:
    _install(monkeypatch, "outside_package:Outside")
    monkeypatch.setitem(sys.modules, "outside_package", types.ModuleType("outside_package"))
    monkeypatch.setattr("outside_package.Outside", Outside, raising=False)
    model: Any = load("outside", {"sure": "yes"}, 7)
    assert "outside" in names()
    assert isinstance(model, Bound)
    assert (model.name, model.sure, model.seed) == ("outside", True, 7)


@pytest.mark.parametrize(
    ("target", "complaint"),
    [
        ("no_such_module:A", "cannot be imported"),
        ("json:Nothing", "cannot be imported"),
        ("json:loads", "Options and build"),
    ],
)
def test_a_broken_entry_point_is_one_line(monkeypatch: pytest.MonkeyPatch, target: str, complaint: str) -> None:
    _install(monkeypatch, target)
    with pytest.raises(ModelError, match=complaint):
        load("outside", {}, 0)


def test_no_package_can_take_a_built_in_name(monkeypatch: pytest.MonkeyPatch) -> None:
    _install(monkeypatch, "json:loads", name="oracle")
    assert load("oracle", {}, 0).name == "oracle"
