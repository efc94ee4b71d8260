"""The notebook of `load_run` is the page's example, and runs."""

import json

import pytest

from infthor_eval.cli import main

from .blocks import ROOT, blocks_of

PAGE, NOTEBOOK = "docs/howto/data-frames.md", "docs/howto/load_run.ipynb"


def test_the_notebook_runs_on_the_run_that_the_page_names(tmp_path, monkeypatch, capsys):
    notebook = json.loads((ROOT / NOTEBOOK).read_text())
    (cell,) = notebook["cells"]
    shown, *_ = [block.text for block in blocks_of(PAGE) if block.language == "python"]
    source = "".join(cell["source"])
    assert (notebook["nbformat"], source) == (4, shown.removesuffix("\n"))
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["--model", "blind", "--tasks", "nieh_mini_gt", "--limit", "20"])
    assert ended.value.code == 0
    capsys.readouterr()
    exec(compile(source, NOTEBOOK, "exec"), {})
    printed = capsys.readouterr().out
    assert "question_type" in printed
    assert "seconds" in printed
