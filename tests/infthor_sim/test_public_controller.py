"""What others import and start: Controller, `run SCRIPT`, the README's examples."""

import json
import os
import py_compile
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import psutil
import pytest
from PIL import Image

from infthor_sim import Controller, player_command
from infthor_sim.errors import SimulatorError

from ..docs.blocks import ROOT, blocks_of
from ..helpers.waiting import PATIENCE_S, wait_until
from .conftest import need_data

EXAMPLES = [
    block.text for block in blocks_of("infthor_sim/README.md") if block.language == "python"
]
SCRIPT = """
import sys
import ai2thor.controller
from ai2thor.controller import Controller

controller = Controller(scene="bathroom-1", x_display="0.0", local_executable_path="/opt/thor")
controller.step(action="RotateRight")
print(controller.last_event.metadata["sceneName"], sys.argv[1:], __name__)
{ending}
"""
PLACE = """
import json, os, sys
told = [__file__, sys.argv, sys.path[0], __name__, __package__, str(__builtins__)]
os.chdir(sys.argv[-1])
same = sys.modules["__main__"].__dict__ is globals()
print(json.dumps([*told, same, __file__, os.path.exists(__file__)]))
"""
WAITING = """
import time
from infthor_sim import Controller

class Waiting(Controller):
    def _await_first_state(self, process):
        if {is_early}:
            wait()
        super()._await_first_state(process)

def wait():
    print(flush=True)
    time.sleep(999)

controller = Waiting(scene="bathroom-1")
wait()
"""


def python(*words: str | Path, cwd: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *words],
        check=False,
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT), **variables},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )


def run_script(folder: Path, ending: str, *words: str) -> subprocess.CompletedProcess[str]:
    (folder / "script.py").write_text(SCRIPT.format(ending=ending))
    return python("-m", "infthor_sim", "run", *words, cwd=folder)


def alive(controller: Any) -> bool:
    return Path(f"/proc/{controller.unity_pid}").exists()


def test_it_needs_no_display_and_leaves_nothing_behind(monkeypatch, tmp_path):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", None)
    with Controller() as controller:
        assert controller.last_event.metadata["sceneName"] == "kitchen-1"
        assert controller.last_event.frame.shape == (300, 300, 3)
        assert alive(controller)
    assert not alive(controller)
    assert [path.name for path in tmp_path.rglob("*")] == ["temporary"]
    controller.stop()  # once more does nothing


@pytest.mark.parametrize("when", ["before the first state", "ready"])
def test_killed_it_leaves_neither_files_nor_a_process(tmp_path, when):
    (tmp_path / "script.py").write_text(WAITING.format(is_early=when != "ready"))
    (tmp_path / "temporary").mkdir()
    command = [sys.executable, tmp_path / "script.py"]
    left = {"PYTHONPATH": str(ROOT), "TMPDIR": str(tmp_path / "temporary")}
    with subprocess.Popen(command, stdout=subprocess.PIPE, env={**os.environ, **left}) as process:
        assert process.stdout is not None
        process.stdout.readline()
        (simulator,) = psutil.Process(process.pid).children()
        assert list((tmp_path / "temporary").iterdir())
        process.kill()
    wait_until(lambda: not list((tmp_path / "temporary").iterdir()))
    wait_until(lambda: not simulator.is_running())


def test_its_process_ends_with_python(tmp_path):
    code = "from infthor_sim import Controller; print(Controller(scene='bathroom-1').unity_pid)"
    status = Path(f"/proc/{int(python('-c', code, cwd=tmp_path).stdout)}/status")
    wait_until(lambda: not status.exists() or "(zombie)" in status.read_text())


@pytest.mark.parametrize(
    "options",
    [
        {"gpu_device": 0, "platform": "CloudRendering"},
        {"x_display": "0.0", "local_executable_path": None, "server_class": None},
        {"start_unity": False, "commit_id": "0" * 40, "branch": "main", "local_build": True},
        {"headless": True},
    ],
)
def test_what_chooses_a_build_or_a_screen_has_no_effect(options, monkeypatch):
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "0")  # for which ai2thor would run vulkaninfo
    with Controller(scene="bathroom-1", width=200, height=100, **options) as controller:
        event = controller.step("RotateRight")
        assert event.metadata["lastActionSuccess"]
        assert (event.screen_width, event.screen_height) == (200, 100)
        assert (event.frame is None) == ("headless" in options)


def test_arguments_of_ai2thor_pass_through():
    with Controller(
        "Low", scene="bathroom-1", gridSize=0.5, agentMode="arm", renderDepthImage=True
    ) as controller:
        assert controller.quality == "Low"
        assert controller.last_event.depth_frame is not None
        assert controller.initialization_parameters["gridSize"] == 0.5
        assert controller.last_event.metadata["arm"]["heldObjects"] == []


@pytest.mark.filterwarnings("ignore:start method depreciated")
def test_start_returns_the_last_event_and_starts_again_what_was_stopped():
    with Controller(scene="bathroom-1") as controller:
        event, process = controller.last_event, controller.unity_pid
        assert controller.start() is event
        assert controller.unity_pid == process
        controller.stop()
        controller.start()
        assert controller.reset("bathroom-1").metadata["objects"] == event.metadata["objects"]
        assert controller.unity_pid != process
    assert not alive(controller)
    assert not Path(controller.base_dir).exists()


def test_a_download_starts_nothing():
    with Controller(download_only=True) as controller:
        assert controller.last_event is None


@pytest.mark.parametrize("scene", ["FloorPlan1", "castle-1"])
def test_a_refused_scene_ends_the_process(scene, monkeypatch):
    started = []
    monkeypatch.setattr(
        Controller, "_await_first_state", lambda self, process: started.append(process)
    )
    with pytest.raises(RuntimeError, match=scene):
        Controller(scene=scene)
    assert started[0].poll() is not None


def test_there_is_no_last_procedural_scene():
    with Controller(scene="bathroom-1234567", width=20, height=20) as controller:
        assert controller.last_event.metadata["sceneName"] == "bathroom-1234567"


def test_a_process_that_cannot_start_is_one_line(monkeypatch):
    monkeypatch.setattr(
        "infthor_sim.controller.player_command",
        lambda *_: f"{sys.executable} -c 'raise SystemExit(\"no such luck\")'",
    )
    with pytest.raises(SimulatorError, match="does not start: no such luck"):
        Controller()


def test_recorded_floor_plans_with_data():
    with Controller(scene="FloorPlan1", data=need_data()) as controller:
        assert controller.last_event.metadata["sceneName"] == "FloorPlan1_physics"


def test_the_command_starts_this_python_with_whole_paths(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert player_command() == f"{sys.executable} -P -m infthor_sim.player"
    command = player_command("a b", Path("s.json"))
    assert command.endswith(f" --data '{tmp_path}/a b' --supplement {tmp_path}/s.json")


def test_a_script_for_ai2thor_runs_as_it_stands(tmp_path):
    done = run_script(tmp_path, "controller.stop()", "script.py", "--data", "x", "-h")
    assert done.returncode == 0, done.stderr
    assert done.stdout == "bathroom-1 ['--data', 'x', '-h'] __main__\n"


@pytest.fixture
def places(tmp_path):
    """A folder of scripts that print what python tells a script about its place."""
    for folder in ("sub", "app", "away"):
        (tmp_path / folder).mkdir()
    for name in ("m.py", "no-ending", "sub/m.py", "app/__main__.py"):
        (tmp_path / name).write_text(PLACE)
    (tmp_path / "link.py").symlink_to("sub/m.py")
    (tmp_path / "app-link").symlink_to("app")
    with zipfile.ZipFile(tmp_path / "app.zip", "w") as archive:
        archive.writestr("__main__.py", PLACE)
    (tmp_path / "zip-link").symlink_to("app.zip")
    py_compile.compile(str(tmp_path / "m.py"), str(tmp_path / "m.pyc"))
    return tmp_path


@pytest.mark.parametrize("flags", [[], ["-P"]], ids=["", "safe"])
@pytest.mark.parametrize(
    "script",
    ["m.py", "./m.py", "sub/m.py", "sub/../m.py", "link.py", "no-ending", "m.pyc", "app", "app/",
     "./app", "app-link", "app.zip", "./app.zip", "zip-link", "{place}/m.py", "{place}/app.zip"],
)  # fmt: skip
def test_a_script_is_told_its_place_as_python_tells_it(script, flags, places):
    words = [script.format(place=places), "a", "--data", str(places / "away")]
    by_python = python(*flags, *words, cwd=places)
    by_us = python(*flags, "-m", "infthor_sim", "run", *words, cwd=places)
    assert json.loads(by_us.stdout) == json.loads(by_python.stdout), by_us.stderr


def test_no_process_runs_what_lies_in_the_folder_where_one_stands(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "numpy.py").write_text("raise SystemExit('it was run')")
    done = run_script(tmp_path / "sub", "controller.stop()", "script.py")
    again = python("-m", "infthor_sim", "run", "sub/script.py", cwd=tmp_path)
    assert (again.returncode, again.stdout) == (0, done.stdout), again.stderr


def test_errors_and_exit_codes_of_a_script_are_its_own(tmp_path):
    done = run_script(tmp_path, "raise KeyError('mine')", "script.py")
    assert done.returncode == 1
    assert done.stderr.startswith("Traceback")
    assert done.stderr.endswith(
        "script.py\", line 9, in <module>\n    raise KeyError('mine')\nKeyError: 'mine'\n"
    )
    assert run_script(tmp_path, "sys.exit(5)", "script.py").returncode == 5


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["run"], "arguments are required: script"),
        (["run", "none.py"], "none.py: cannot be read (No such file or directory)"),
        (["run", "empty"], "empty: there is no __main__.py in it"),
        (["walk"], "invalid choice: 'walk'"),
    ],
)
def test_misuse_is_one_line(words, message, tmp_path):
    (tmp_path / "empty").mkdir()
    done = python("-m", "infthor_sim", *words, cwd=tmp_path)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


def test_without_arguments_it_explains_itself(tmp_path):
    done = python("-m", "infthor_sim", cwd=tmp_path)
    assert done.returncode == 0
    assert "run SCRIPT" in done.stdout


def test_the_package_is_light_and_stands_alone(tmp_path):
    light = "import sys, infthor_sim; print({'ai2thor', 'numpy', 'numba'} & set(sys.modules))"
    assert python("-c", light, cwd=tmp_path).stdout == "set()\n"
    whole = (
        "import importlib, pkgutil, sys, infthor_sim\n"
        "for found in pkgutil.walk_packages(infthor_sim.__path__, 'infthor_sim.'):\n"
        "    importlib.import_module(found.name)\n"
        "names = {'infthor_eval', 'model_adapters', 'torch', 'numba'}\n"
        "print(names & set(sys.modules))"
    )
    assert python("-c", whole, cwd=tmp_path).stdout == "{'numba'}\n"


@pytest.mark.parametrize("example", EXAMPLES, ids=["fridge", "arm"])
def test_the_examples_of_the_readme(example, tmp_path):
    (tmp_path / "example.py").write_text(example)
    done = python("example.py", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    if "fridge" in example:
        with Image.open(tmp_path / "fridge.png") as picture:
            assert picture.size == (640, 480)
    else:
        assert done.stdout.startswith("held: ['Tomato|")
