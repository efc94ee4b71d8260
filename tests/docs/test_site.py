"""The site: links between pages that lie in and outside docs/, and nothing from elsewhere."""

import importlib.util
import os
import re
import subprocess
import sys
from types import SimpleNamespace

import pytest

from .blocks import ROOT

pytest.importorskip("mkdocs", reason="the extra docs is not installed (make test does it)")


@pytest.fixture(scope="module")
def hook():
    spec = importlib.util.spec_from_file_location("site_pages", ROOT / "docs" / "site_pages.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("place", "link", "expected"),
    [
        ("cost.md", "../benchmarks/gpu.md", "benchmarks/gpu.md"),
        ("howto/long-contexts.md", "../../benchmarks/gpu.md", "../benchmarks/gpu.md"),
        ("benchmarks/gpu.md", "../docs/cost.md", "../cost.md"),
        ("benchmarks/README.md", "../docs/own-models.md#as-a-package", "../own-models.md#as-a-package"),
        ("own-tasks.md", "nieh.md#tasks", "nieh.md#tasks"),
        ("plans.md", "plan-rewards.md", "plan-rewards.md"),
        ("plans.md", "#where-it-runs", "#where-it-runs"),
        ("plans.md", "https://docs.ray.io", "https://docs.ray.io"),
        ("plans.md", "../infthor_eval/suites.py", "../infthor_eval/suites.py"),
    ],
)
def test_a_link_in_the_repository_becomes_one_in_the_site(hook, place, link, expected):
    page = SimpleNamespace(file=SimpleNamespace(src_uri=place))
    assert hook.on_page_markdown(f"see [this]({link}).", page) == f"see [this]({expected})."


def test_the_site_is_whole_and_takes_nothing_from_elsewhere(tmp_path):
    words = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", tmp_path]
    done = subprocess.run(
        words, check=False, cwd=ROOT, capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(ROOT)}
    )
    assert done.returncode == 0, done.stderr
    pages = {path.relative_to(tmp_path).as_posix(): path.read_text() for path in tmp_path.rglob("*.html")}
    loaded = [
        re.findall(r"<(?:link|script|img|iframe)[^>]*?(?:href|src)=.?https?:[^>]*>", page) for page in pages.values()
    ]
    assert not any(loaded)
    assert "--include-path" in pages["reference/cli.html"]
    assert "class_in_file" not in pages["reference/api/model_adapters.html"]
    assert "BackendConversation" in pages["reference/api/model_adapters.html"]
