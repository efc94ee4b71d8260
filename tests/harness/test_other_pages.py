"""The pages on other harnesses, typed in an environment that has them beside ours."""

import json
import os
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.docs.blocks import ROOT, written_files
from tests.docs.commands import code_of
from tests.helpers.peers import needs_peer, peer_packages

_SHORT = """
import infthor_eval.manipulation.worlds as worlds
evaluation = worlds.arm_evaluation
def short(*given, **named):
    made = evaluation(*given, **named)
    for task in made.tasks.values():
        object.__setattr__(task.settings, "max_steps", 2)
    return made
worlds.arm_evaluation = short
"""
_MAINS = {"vla-eval": "vla_eval.cli.main", "inspect-robots": "inspect_robots.cli"}
# What `infthor-eval` registers when it is installed, and a policy that another package might.
_POLICY = """
import numpy as np
from inspect_robots.policy import PolicyConfig, PolicyInfo
from inspect_robots.types import Action, ActionChunk

class Opener:
    config = PolicyConfig()
    def bind(self, embodiment):
        self.info = PolicyInfo("opener", embodiment.action_space)
    def reset(self, scene):
        pass
    def act(self, observation):
        assert set(observation.images) == {"agentview", "wrist"}
        return ActionChunk([Action(np.array([0, 0, 0, 0, 0, 0, 1]))])
"""


@pytest.fixture
def page(tmp_path, monkeypatch):
    """Writes a page's files, and starts its commands; each is looked up by its beginning."""

    def page(name, peer):
        path = f"docs/howto/{name}.md"
        written_files(path, tmp_path)
        commands = [command for code in code_of(path) for command in code.commands]

        def start(beginning, *more, **replaced):
            (command,) = [it for it in commands if it.text.startswith(beginning)]
            words = [word for word in command.words if word != "&"]
            words = [replaced.get(word, word) for word in words]
            return subprocess.Popen(
                _typed(peer, [*words, *more]),
                cwd=tmp_path,
                env={**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{tmp_path / 'site'}"},
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
            )

        return start

    return page


def _typed(peer, words):
    """A command of ours: the environment's packages are found after ours, and tasks are short."""
    begin = f"import sys, runpy; sys.path.append({str(peer_packages(peer))!r}){_SHORT}"
    if words[0] == "python":
        begin += f"sys.argv = {words[1:]!r}; runpy.run_path(sys.argv[0], run_name='__main__')"
    else:
        begin += f"sys.argv = {words!r}; from {_MAINS[words[0]]} import main; sys.exit(main())"
    return [sys.executable, "-c", begin]


def _result(process, code=0):
    output, _ = process.communicate(timeout=600)
    assert process.returncode == code, output[-3000:]
    return output


@needs_peer("vla-eval")
def test_the_page_of_vla_eval(page, tmp_path):
    start = page("vla-eval", "vla-eval")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    server = start("python server.py", **{"8000": str(port)})
    try:
        _wait_for(port, server)
        _result(start("vla-eval run", "--server-url", f"ws://127.0.0.1:{port}"))
    finally:
        server.kill()
        server.communicate()
    results = json.loads((tmp_path / "theirs" / "household_aggregate.json").read_text())
    assert results["num_episodes_total"] == 2
    assert results["num_errors"] == 0
    for task in results["tasks"]:
        assert task["task"].startswith("manipulathor_pickup_mini/")
        assert set(task["episodes"][0]["metrics"]) >= {"success", "reward", "distance"}


def _wait_for(port, server, seconds=60):
    for _ in range(seconds * 10):
        with socket.socket() as tried:
            if tried.connect_ex(("127.0.0.1", port)) == 0:
                return
        assert server.poll() is None
        time.sleep(0.1)
    raise AssertionError("the server does not listen")


@needs_peer("inspect-robots")
def test_the_page_of_inspect_robots(page, tmp_path):
    site = tmp_path / "site"
    _install(site)
    start = page("inspect-robots", "inspect-robots")
    assert {"- infthor-pickup", "- infthor-put"} <= {
        line.strip() for line in _result(start("inspect-robots list")).splitlines()
    }
    assert "success_at_end" in _result(start("python closer.py"))
    _result(start("inspect-robots run", NAME="opener"))
    logs = [json.loads(path.read_text()) for path in tmp_path.glob("logs/*.json")]
    assert [log["status"] for log in logs] == ["success"] * 2
    assert sum(len(log["samples"]) for log in logs) == 4


def _install(site: Path):
    """What pip would write of the entry points of our `pyproject.toml`, and a policy."""
    import tomllib

    groups = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]
    groups = {name: points for name, points in groups.items() if name.startswith("inspect_robots")}
    groups["inspect_robots.policies"] = {"opener": "opener:Opener"}
    info = site / "doors-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: doors\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "\n".join(
            line
            for group, points in groups.items()
            for line in (f"[{group}]", *(f"{name} = {target}" for name, target in points.items()))
        )
    )
    (site / "opener.py").write_text(_POLICY)
