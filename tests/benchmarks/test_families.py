"""Tiny checkpoints of many families: replies of `hf-vlm` are those of transformers' own way."""

import importlib
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest

from ..helpers.benchmarks import FOLDER

# What an adapter learns to share is added here; nothing is taken away.
SHARE = {
    "qwen2_vl",
    "qwen2_5_vl",
    "qwen3_vl",
    "qwen3_vl_moe",
    "qwen3_5",
    "glm4v",
    "glm46v",
    "glm4v_moe",
    "ernie4_5_vl_moe",
    "gemma3",
    "gemma4",
    "internvl",
    "llama4",
    "mistral3",
    "smolvlm",
    "llava_onevision",
    "llava",
    "llava_next",
    "vipllava",
    "deepseek_vl",
    "idefics3",
    "aya_vision",
    "janus",
    "ovis2",
    "cohere2_vision",
    "lfm2_vl",
    "nemotron_h_omni",
    "video_llama_3",
}
# What is loaded in other ways where torchvision is installed.
OTHERWISE_WITH_TORCHVISION = {"gemma4", "llama4", "mistral3", "cohere2_vision", "lfm2_vl"}
KNOWN_WRONG = {("janus", "unshared")}  # its `generate` drops the processor that makes a reply
SIX = ("qwen2_vl", "qwen3_vl", "gemma3", "idefics3", "llava", "aya_vision")


@pytest.fixture(scope="module")
def families() -> Iterator[Any]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(FOLDER)
        yield importlib.import_module("families")


def require(rows) -> None:
    """Nothing that replies is wrong, what shared before shares, and each family sees frames."""
    assert [
        row.name for row in rows if row.name in SHARE and not row.right("alone", "together")
    ] == []
    wrong = {
        (row.name, way)
        for row in rows
        for way, n_equal in row.equal.items()
        if n_equal not in (None, row.asked)
    }
    assert wrong <= KNOWN_WRONG
    notes = " ".join(note for row in rows for note in row.notes)
    assert not any(words in notes for words in ("not made", "a crash", "do not depend"))


def test_six_families_reply_as_transformers_does(families, tmp_path):
    require(families.try_families(SIX, tmp_path, n_frames=4, new_tokens=4))


@pytest.mark.slow
def test_all_families_reply_as_transformers_does(families, tmp_path):
    assert len(families.FAMILIES) == 33
    require(families.try_families(list(families.FAMILIES), tmp_path))


@pytest.mark.slow
def test_families_share_where_torchvision_is_installed_too():
    names = ",".join(sorted(OTHERWISE_WITH_TORCHVISION))
    command = [sys.executable, FOLDER / "families.py", "--torchvision", "--families", names]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    n = len(OTHERWISE_WITH_TORCHVISION)
    assert f"**{n} of {n} share" in run.stdout


def test_a_family_that_cannot_be_made_stops_no_other(families, tmp_path, monkeypatch):
    def fail(vocabulary):
        raise ValueError("no such\nlayer")

    bad = replace(families.FAMILIES["llava"], config=fail)
    monkeypatch.setitem(families.FAMILIES, "llava", bad)
    replies = [(1,)] * 5
    reference = families.Reference(replies, [(0.5,)] * 5, (2,))
    monkeypatch.setattr(
        families, "reference_replies", lambda made, work: dict.fromkeys(made, reference)
    )
    monkeypatch.setattr(families, "ask", lambda folder, work: families.Trial({"alone": replies}))
    bad_row, good_row = families.try_families(["llava", "vipllava"], tmp_path, n_frames=1)
    assert bad_row.notes == ("not made: llava (no such layer); see its config",)
    assert (bad_row.loads, good_row.loads) == (False, True)


def test_the_table_has_a_row_for_each_the_totals_and_what_went_wrong(families):
    ways = dict.fromkeys(families.WAYS, 5)
    rows = [
        families.Row("a", True, ways, 5, (), "generate"),
        families.Row("b", True, ways | {"alone": None, "together": None}, 5, ("no",), "unshared"),
        families.Row("c", True, ways | {"together": 0}, 5, (), "generate"),
        families.Row("d", False, dict.fromkeys(families.WAYS), 5, ("not made: no",)),
    ]
    text = families.report(rows)
    assert "| a | yes | 5 of 5 | 5 of 5 | 5 of 5 | generate |" in text
    assert "| b | yes | - | - | 5 of 5 | unshared |" in text
    assert "| d | no | - | - | - | - |" in text
    assert "**1 of 4 share with equal replies, alone and together; 2 run only" in text
    assert "1 do not load" in text
    assert text.endswith("```\nb: no\nd: not made: no\n```")
    assert "```" not in families.report(rows[:1])


def test_replies_are_compared_with_unshared_where_generate_fails(families):
    replies = [(number,) for number in range(5)]
    trial = families.Trial({"alone": replies, "unshared": [*replies[:4], (9,)]}, {"together": "x"})
    row = families._row("a", trial, "ImportError: none")
    assert dict(row.equal) == {"alone": 4, "together": None, "unshared": 5}
    assert row.notes == ("x", "transformers' own way fails: ImportError: none")
    assert row.reference == "unshared"


def test_an_unknown_family_is_one_line(families, capsys):
    with pytest.raises(SystemExit):
        families.main(["--families", "llava,nobody"])
    assert "nobody is not one of qwen2_vl" in capsys.readouterr().err
