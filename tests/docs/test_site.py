"""The site: links between pages that lie in and outside docs/, and nothing from elsewhere."""

import functools
import http.server
import importlib.util
import os
import re
import subprocess
import sys
import threading
from types import SimpleNamespace

import pytest

from .blocks import ROOT

pytest.importorskip("mkdocs", reason="the extra docs is not installed (make test does it)")


def load_hook(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def hook():
    return load_hook("site_pages")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the site."""
    folder = tmp_path_factory.mktemp("site")
    words = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", folder]
    done = subprocess.run(
        words,
        check=False,
        cwd=ROOT,
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.parametrize(
    ("place", "link", "expected"),
    [
        ("running.md", "../benchmarks/gpu.md", "benchmarks/gpu.md"),
        ("howto/unity.md", "../../benchmarks/gpu.md", "../benchmarks/gpu.md"),
        ("benchmarks/gpu.md", "../docs/running.md", "../running.md"),
        (
            "benchmarks/README.md",
            "../docs/own-models.md#as-a-package",
            "../own-models.md#as-a-package",
        ),
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


def test_the_site_is_whole_and_takes_nothing_from_elsewhere(site):
    pages = {path.relative_to(site).as_posix(): path.read_text() for path in site.rglob("*.html")}
    loaded = [
        re.findall(r"<(?:link|script|img|iframe)[^>]*?(?:href|src)=.?https?:[^>]*>", page)
        for page in pages.values()
    ]
    assert not any(loaded)
    assert "--include-path" in pages["reference/cli.html"]
    assert "class_in_file" not in pages["reference/api/model_adapters.html"]
    assert "BackendConversation" in pages["reference/api/model_adapters.html"]


# -- in a browser

# What is wider than its place: blocks of code, tables, the page.
WIDER = """() => [
        document.documentElement,
        ...document.querySelectorAll("pre > code, .md-typeset__scrollwrap"),
    ]
    .filter(place => place.scrollWidth > place.clientWidth + 1)
    .map(place => place.textContent.slice(0, 60))"""


@pytest.fixture
def served(site):
    """The address of the site on a server."""
    handler = functools.partial(QuietHandler, directory=site)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


class QuietHandler(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


@pytest.mark.parametrize("is_served", [True, False], ids=["from a server", "from its folder"])
@pytest.mark.parametrize("page", ["index.html", "howto/index.html"])
def test_search_finds_pages(browser, site, served, is_served, page):
    opened = browser.new_page()
    problems, asked = [], []
    opened.on("pageerror", lambda error: problems.append(str(error)))
    opened.on("request", lambda request: asked.append(request.url))
    root = served if is_served else site.as_uri()
    opened.goto(f"{root}/{page}")
    opened.get_by_role("textbox", name="Search").click()
    opened.keyboard.type("haystack")
    opened.locator(".md-search-result__item a").first.wait_for(timeout=60_000)
    links = opened.locator(".md-search-result__item a").evaluate_all(
        "links => links.map(link => link.href)"
    )
    assert any(link.startswith(f"{root}/nieh.html") for link in links)
    assert problems == []
    assert [url for url in asked if not url.startswith((root, "data:", "blob:", "about:"))] == []
    opened.close()


def test_nothing_is_wider_than_a_window_of_1400_pixels(browser, site):
    opened = browser.new_page(viewport={"width": 1400, "height": 1000})
    wider = {}
    for path in sorted(site.rglob("*.html")):
        opened.goto(path.as_uri())
        if found := opened.evaluate(WIDER):
            wider[path.relative_to(site).as_posix()] = found
    assert wider == {}
    opened.goto((site / "benchmarks" / "cost.html").as_uri())
    sizes = opened.locator("pre > code.columns").evaluate_all(
        "blocks => blocks.map(block => parseFloat(getComputedStyle(block).fontSize))"
    )
    assert len(sizes) >= 2
    assert min(sizes) > 10  # pixels: columns are to be read
    opened.close()


def test_it_is_dark_where_the_system_is_and_where_it_is_asked_to_be(browser, site):
    shades = {}
    for scheme in ("light", "dark"):
        opened = browser.new_page(color_scheme=scheme)
        opened.goto((site / "index.html").as_uri())
        shade = (
            "getComputedStyle(document.body).backgroundColor.match(/\\d+/g).slice(0, 3).map(Number)"
        )
        shades[scheme] = opened.evaluate(shade)
        if scheme == "light":
            for _ in range(2):  # as the system, light, dark
                opened.locator("label[for^=__palette]:visible").click()
            opened.wait_for_function(f"{shade}[0] < 100")
        opened.close()
    assert min(shades["light"]) > 200
    assert max(shades["dark"]) < 80


def test_blocks_with_columns_are_told_from_code():
    mark = load_hook("site_code").on_page_content
    table = (
        "<pre id=x><code>model     total\n<span>oracle</span>    100.00\nblind      "
        "28.69\n</code></pre>"
    )
    assert 'class="columns" style="--letters: 16"' in mark(table)
    command = (
        "<pre><span></span><code>infthor-eval --model oracle   # the key\n    --tasks "
        "nieh\n</code></pre>"
    )
    assert mark(command) == command
