"""The notebook of the docs runs, cell by cell, and shows what it says."""

import ast
import json

import matplotlib
import matplotlib.pyplot as plt
import pytest

from .blocks import ROOT

NOTEBOOK = "docs/howto/notebook.ipynb"


@pytest.fixture
def cells():
    notebook = json.loads((ROOT / NOTEBOOK).read_text())
    assert notebook["nbformat"] == 4
    return {cell["id"]: "".join(cell["source"]) for cell in notebook["cells"]}


def run(source, names):
    """Run a cell as a notebook does, and return its last value."""
    *statements, last = ast.parse(source, NOTEBOOK).body
    assert isinstance(last, ast.Expr)
    exec(compile(ast.Module(statements, []), NOTEBOOK, "exec"), names)
    return eval(compile(ast.Expression(last.value), NOTEBOOK, "eval"), names)


def test_the_notebook_runs_from_its_first_cell_to_its_last(cells, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    shown = {
        name: run(source, names)
        for name, source in cells.items()
        if name != "title" and not name.startswith("about-")
    }
    runs = shown["evaluate"]
    assert list(runs["run"]) == ["oracle", "blind"]
    assert list(runs["state"]) == ["whole", "whole"]
    assert runs["score"][0] == 1.0
    assert sorted(shown["load-runs"]["run"]) == ["blind", "oracle"]
    assert shown["load-run"]["count"].sum() == 20
    page = shown["load-sample"]._repr_html_()
    assert page.count("data:image/webp;base64,") >= 1
    for words in ("gold answer", "reply", "score", "request"):
        assert words in page
    figure = shown["load-figure"]
    assert isinstance(figure, matplotlib.figure.Figure)
    legends = [legend for axes in figure.axes if (legend := axes.get_legend()) is not None]
    assert {text.get_text() for text in legends[0].get_texts()} == {"oracle", "blind"}
    assert plt.get_fignums() == []  # the figure is the caller's, nothing is kept of it


def test_every_code_cell_is_explained(cells):
    code = [name for name in cells if name != "title" and not name.startswith("about-")]
    assert [f"about-{name}" for name in code] == [name for name in cells if "about-" in name]
