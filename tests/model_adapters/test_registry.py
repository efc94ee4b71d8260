import importlib
import subprocess
import sys
import types
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from infthor_eval.errors import ModelError, UsageError
from model_adapters import (
    Capabilities,
    FramePolicy,
    adapter_identity,
    label,
    load,
    model_note,
    names,
    options_of,
    registry,
    switched_on,
    switches,
)
from model_adapters.built_in import BUILT_IN
from model_adapters.options import NoOptions
from model_adapters.registry import model_description


def test_names_and_help_need_neither_torch_nor_transformers():
    code = (
        "import sys, model_adapters as m; [m.options_of(name) for name in m.names()]; "
        "m.label('hf-vlm', {});"
        "sys.exit(bool({'torch', 'transformers'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("name", BUILT_IN)
def test_the_options_that_are_told_without_an_adapter_are_the_adapters_own(name):
    module, _, attribute = BUILT_IN[name].adapter.partition(":")
    adapter = getattr(importlib.import_module(module), attribute)
    module, _, attribute = BUILT_IN[name].options.partition(":")
    own = getattr(importlib.import_module(module), attribute)
    assert issubclass(own, adapter.Options)
    assert own is adapter.Options or BUILT_IN[name].defaults


def test_built_in_names():
    assert {"hf-vlm", "pixtral", "qwen2.5-vl", "qwen2.5-vl-tiny"} <= set(names())


@pytest.mark.parametrize(("typed", "meant"), [("qwen2.5vl", "qwen2.5-vl"), ("pixtrall", "pixtral")])
def test_unknown_model_names_the_nearest(typed, meant):
    with pytest.raises(UsageError, match=f"unknown model '{typed}'; did you mean '{meant}'"):
        load(typed, {}, 0)


def test_far_off_name_lists_all():
    with pytest.raises(UsageError, match=r"unknown model 'zzz'; there are .*qwen2\.5-vl"):
        load("zzz", {}, 0)


def test_unknown_option_names_the_nearest_and_all_with_defaults():
    with pytest.raises(
        UsageError, match=r"no option dtyp; did you mean dtype\?.*share_prefix=true"
    ):
        load("qwen2.5-vl-tiny", {"dtyp": "float32"}, 0)


def test_an_adapter_without_options_says_so(monkeypatch):
    _install(monkeypatch, "outside_package:Outside")
    _import_as_outside(monkeypatch, type("Bare", (Outside,), {"Options": NoOptions}))
    with pytest.raises(UsageError, match="it takes: no options"):
        load("outside", {"dtype": "float32"}, 0)


def test_options_are_listed_with_their_defaults():
    assert options_of("qwen2.5-vl")["pretrained"].default == "Qwen/Qwen2.5-VL-7B-Instruct"


@dataclass(frozen=True)
class _Options:
    sure: bool = False


class Outside:
    Options = _Options

    def __init__(self, name, sure, seed):
        self.name, self.sure, self.seed = name, sure, seed
        self.capabilities = Capabilities()

    @classmethod
    def build(cls, name, options, seed):
        return cls(name, options.sure, seed)

    def identity(self):
        return {}

    def reset(self):
        pass

    def act(self, frame, instruction):
        return ()

    def close(self):
        pass


def _install(monkeypatch, target, name="outside"):
    point = EntryPoint(name, target, registry.ENTRY_POINTS)
    monkeypatch.setattr(
        registry, "entry_points", lambda group: [point] if group == point.group else []
    )


def _import_as_outside(monkeypatch, adapter):
    monkeypatch.setitem(sys.modules, "outside_package", types.ModuleType("outside_package"))
    monkeypatch.setattr("outside_package.Outside", adapter, raising=False)


def test_models_of_other_packages_come_through_entry_points(monkeypatch):
    _install(monkeypatch, "outside_package:Outside")
    _import_as_outside(monkeypatch, Outside)
    model = load("outside", {"sure": "yes"}, 7)
    assert "outside" in names()
    assert isinstance(model, FramePolicy)
    assert (model.name, model.sure, model.seed) == ("outside", True, 7)


@pytest.mark.parametrize(
    ("target", "complaint"),
    [
        ("no_such_module:A", "cannot be imported"),
        ("json:Nothing", "cannot be imported"),
        ("json:loads", "Options and build"),
    ],
)
def test_a_broken_entry_point_is_one_line(monkeypatch, target, complaint):
    _install(monkeypatch, target)
    with pytest.raises(ModelError, match=complaint):
        load("outside", {}, 0)


def test_no_package_can_take_a_built_in_name(monkeypatch):
    _install(monkeypatch, "json:loads", name="qwen2.5-vl-tiny")
    assert load("qwen2.5-vl-tiny", {}, 0).name == "qwen2.5-vl-tiny"
    assert adapter_identity("qwen2.5-vl-tiny") == {}


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A distribution with an adapter, as pip would leave it."""
    package = tmp_path / "dummy_robot"
    (package / "arms").mkdir(parents=True)
    (package / "__init__.py").write_text("")
    (package / "arms" / "left.py").write_text("SPEED = 1\n")
    (tmp_path / "dummy_module.py").write_text("A = 1\n")
    info = tmp_path / "Dummy_Robot-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: Dummy-Robot\nVersion: 1.2\n")
    (info / "entry_points.txt").write_text(
        f"[{registry.ENTRY_POINTS}]\n"
        "dummy = dummy_robot.arms.left:Arm\n"
        "single = dummy_module:A\n"
        "lost = no_such:A\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def test_an_adapter_of_another_package_has_its_version_and_source_in_its_identity(installed):
    before = adapter_identity("dummy")
    assert before.keys() == {"package", "version", "source"}
    assert (before["package"], before["version"]) == ("Dummy-Robot", "1.2")
    assert adapter_identity("dummy") == before
    (installed / "dummy_robot" / "arms" / "left.py").write_text("SPEED = 2\n")
    assert adapter_identity("dummy")["source"] != before["source"]
    assert "dummy_robot" not in sys.modules


@pytest.mark.parametrize("change", ["arms/right.py", "other.py"])
def test_a_new_module_of_the_package_is_another_source(installed, change):
    before = adapter_identity("dummy")["source"]
    (installed / "dummy_robot" / change).write_text("")
    assert adapter_identity("dummy")["source"] != before


def test_an_adapter_in_a_single_module_has_the_source_of_that(installed):
    before = adapter_identity("single")["source"]
    (installed / "dummy_robot" / "__init__.py").write_text("B = 2\n")
    assert adapter_identity("single")["source"] == before
    (installed / "dummy_module.py").write_text("A = 2\n")
    assert adapter_identity("single")["source"] != before


def test_the_source_of_an_adapter_that_is_not_there_is_one_line(installed):
    with pytest.raises(ModelError, match="no module no_such; install the package"):
        adapter_identity("lost")
    with pytest.raises(UsageError, match="unknown model 'losst'; did you mean 'lost'"):
        adapter_identity("losst")


@pytest.mark.parametrize(
    ("model_options", "expected"),
    [
        ({}, "qwen2.5-vl"),
        ({"dtype": "float32"}, "qwen2.5-vl"),
        ({"pretrained": "Qwen/Qwen2.5-VL-3B-Instruct"}, "Qwen2.5-VL-3B-Instruct"),
        (
            {"pretrained": "Qwen/Qwen2.5-VL-3B-Instruct", "revision": "refs/pr/1"},
            "Qwen2.5-VL-3B-Instruct@refs-pr-1",
        ),
        ({"pretrained": "/data/my models/step 10/"}, "step-10"),
        ({"pretrained": "~/.hidden"}, "hidden"),
        ({"pretrained": ""}, "qwen2.5-vl"),
        ({"pretrained": "runs/my nano/checkpoint"}, "my-nano"),
        ({"pretrained": "runs/nano/checkpoint-500"}, "checkpoint-500"),
    ],
)
def test_a_run_is_called_by_its_checkpoint(model_options, expected):
    assert label("qwen2.5-vl", model_options) == expected


@pytest.mark.parametrize("pretrained", [".", "..", "/", "./", "../.."])
def test_any_label_is_one_component_of_a_path(pretrained, tmp_path, monkeypatch):
    folder = tmp_path / "here" / "there"
    folder.mkdir(parents=True)
    monkeypatch.chdir(folder)
    name = label("hf-vlm", {"pretrained": pretrained})
    assert Path(name).name == name
    assert name not in ("", ".", "..")
    assert pretrained != "." or name == "there"


def test_tiny_models_are_described_as_random_and_the_nano_model_as_trained():
    tiny = [name for name in names() if name.endswith("-tiny")]
    assert len(tiny) == 6
    for name in tiny:
        assert (
            model_description(name)
            == model_note(name)
            == "random weights, for trying the harness; scores are those of chance"
        )
    assert model_description("qwen2.5-vl-nano") == "small, trained, bundled with the package"
    assert (model_note("qwen2.5-vl-nano"), model_description("qwen2.5-vl")) == ("", "")


def test_switches_are_on_where_they_have_not_their_defaults():
    typed = {"share_prefix": "yes", "batch_size": "6_4", "kv_offload": "1", "dtype": "float32"}
    assert switched_on("qwen2.5-vl", typed) == {"kv_offload": "1"}
    typed["attn_implementation"] = "eager"
    assert list(switched_on("qwen2.5-vl", typed)) == ["attn_implementation", "kv_offload"]
    with pytest.raises(UsageError, match="has no option chunk"):
        switched_on("qwen2.5-vl", {"chunk": "1"})


@pytest.mark.parametrize("name", BUILT_IN)
def test_every_switch_is_an_option(name):
    assert set(switches(name)) <= options_of(name).keys()
