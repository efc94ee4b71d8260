"""The real Controller of ai2thor, driving the simulator's process."""

import shlex
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from .harness import Bench

DATA = Path(__file__).resolve().parents[2] / ".." / "shared" / "data"
# seconds after which a constructor that hangs (ai2thor waits for ever on a dead player) fails the
# test
_START = 60.0


def need_data() -> Path:
    if not (DATA / "thor_scenes" / "objects.jsonl.gz").exists():
        pytest.skip("recorded floor plans are not at ../shared/data")
    return DATA.resolve()


def start(scene: Any, *options: str, **init: Any) -> Any:
    from ai2thor.controller import Controller

    from infthor_sim.launch import player_command

    command = shlex.join([*shlex.split(player_command()), *options])
    settings = {
        "gridSize": 0.25,
        "visibilityDistance": 1.5,
        "fieldOfView": 60,
        "renderInstanceSegmentation": True,
        "renderDepthImage": True,
        **init,
    }
    result: dict[str, Any] = {}

    def build() -> None:
        try:
            result["controller"] = Controller(
                local_executable_path=command,
                x_display="0",
                scene=scene,
                server_timeout=30.0,
                **settings,
            )
        except Exception as error:  # noqa: BLE001 - carried over to the test's own thread
            result["error"] = error

    thread = threading.Thread(target=build, daemon=True)
    thread.start()
    thread.join(_START)
    if thread.is_alive():
        pytest.fail(
            "the Controller's constructor hangs: the simulator died before it opened its pipe"
        )
    if "error" in result:
        raise result["error"]
    return result["controller"]


@pytest.fixture(scope="session", autouse=True)
def _home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """ai2thor writes below HOME and prunes what it finds there."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOME", str(tmp_path_factory.mktemp("home")))
        yield


@pytest.fixture
def launch() -> Iterator[Callable[..., Any]]:
    running: list[Any] = []

    def run(scene: Any, *options: str, **init: Any) -> Any:
        running.append(start(scene, *options, **init))
        return running[-1]

    yield run
    for controller in running:
        controller.stop()


@pytest.fixture(scope="module")
def started() -> Iterator[Any]:
    controller = start("kitchen-1")
    yield controller
    controller.stop()


@pytest.fixture
def kitchen(started: Any) -> Any:
    """A module's controller, in its kitchen anew."""
    started.reset("kitchen-1")
    return started


@pytest.fixture
def bench() -> Bench:
    return Bench.at("kitchen-1", size=60)
