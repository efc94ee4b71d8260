"""Differences are seen and named; what is normalised away is that alone."""

import json
from pathlib import Path

import pytest

from infthor_eval.exports.registry import FORMATS

from .comparison import compare, print_differences, read_named
from .normal import normalise, normalise_text, read_golden, write_golden
from .runs import EXPORTS


def _lines(old: str, new: str, name: str = "results.json") -> list[str]:
    return [": ".join(it) for it in compare({name: old.encode()}, {name: new.encode()})]


def test_json_differs_by_its_keys() -> None:
    old = {"nieh": {"net_pairs": 0.19, "n": 3}, "gone": 1, "list": [1, 2]}
    new = {"nieh": {"net_pairs": 0.2, "n": 3.0}, "list": [1], "new": None}
    assert _lines(json.dumps(old), json.dumps(new)) == [
        "results.json: nieh/net_pairs: 0.19 -> 0.2",
        "results.json: nieh/n: 3 -> 3.0",
        "results.json: gone: 1 -> nothing",
        "results.json: list/1: 2 -> nothing",
        "results.json: new: nothing -> null",
    ]
    assert _lines(json.dumps(old), json.dumps(old)) == []
    (line,) = _lines('{"a": 1, "b": 2}', '{"b": 2, "a": 1}')
    assert "written otherwise" in line


def test_records_are_those_of_one_unit_wherever_they_stand() -> None:
    first, second = '{"id": "a", "reply": "yes"}', '{"id": "b", "reply": "no"}'
    lines = _lines(f"{first}\n{second}", f"{second.replace('no', 'yes')}\n{first}", "journal.jsonl")
    assert lines == ['journal.jsonl: b/reply: "no" -> "yes"']
    (line,) = _lines(f"{first}\n{second}", f"{second}\n{first}", "samples.jsonl")
    assert "written otherwise" in line
    assert _lines(f"{first}\n{second}", f"{second}\n{first}", "run/journal/0.jsonl") == []


def test_texts_differ_by_lines_shown_from_shortly_before_they_differ() -> None:
    long = "word " * 50
    lines = _lines(f"one\n{long}5\ntwo\n", f"one\n{long}6\ntwo\nthree\n", "show.txt")
    assert lines == [
        "show.txt: line 2: …word word word word 5 -> …word word word word 6",
        "show.txt: line 4: nothing -> three",
    ]


def test_files_and_cases_that_are_new_or_gone() -> None:
    old, new = (dict.fromkeys(it, b"") for it in (("a/1", "b/1", "b/2"), ("a/1", "a/2")))
    assert list(compare(old, new)) == [("b", "is gone"), ("a/2", "is new")]


def test_what_has_a_name_is_counted_and_all_else_ends_with_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "named.txt"
    path.write_text("jsonl: run/format: 3 -> 4$  # the request is kept\n\nnever  # not needed\n")
    named = read_named(path)
    format_differs = ("x/journal.jsonl", "run/format: 3 -> 4")
    assert print_differences([format_differs] * 2, named) == 0
    assert capsys.readouterr().out.splitlines() == [
        "named, 2: jsonl: run/format: 3 -> 4$ (the request is kept)",
        "named, 0: never (not needed)",
        "0 differences without a name, in 0 files; 2 with one",
    ]
    others = [("f", f"k/{number}: 1 -> 2") for number in range(20)]
    assert print_differences([format_differs, *others], named) == 1
    printed = capsys.readouterr().out.splitlines()
    assert printed[11:13] == ["f: k/11: 1 -> 2", "f: and 8 more"]
    assert printed[-1] == "20 differences without a name, in 1 files; 1 with one"
    path.write_text("journal\n")
    with pytest.raises(ValueError, match=r"is not PATTERN, two spaces, # REASON"):
        read_named(path)


def test_identities_are_kept_once_pages_in_parts_and_pictures_as_digests(tmp_path: Path) -> None:
    run = tmp_path / "twins/runs/0/blind/nieh-0123456789abcdef"
    run.mkdir(parents=True)
    (run / "results.json").write_text(json.dumps({"folder": str(run), "set": "/code/sets"}))
    data = f'<script id="data" type="application/json">{{"p": "{"QUJD" * 200}"}}</script>'
    (tmp_path / "twins/report.html").write_text(f"<p>1</p><p>2</p>{data}")
    files = normalise(tmp_path, Path("/code"))
    name = "twins/runs/0/blind/nieh-IDENTITY/results.json"
    assert json.loads(files[name]) == {"folder": f"WORK/{Path(name).parent}", "set": "ROOT/sets"}
    assert json.loads(files["twins/identities.json"]) == {"0/blind": "nieh-0123456789abcdef"}
    assert files["twins/report.html/page.txt"].startswith(b"<p>1</p>\n<p>2</p>\n<script")
    assert json.loads(files["twins/report.html/data.json"])["p"].startswith("sha256:")


@pytest.mark.parametrize("text", ["0.5", '"seconds": 0.25}', "nieh-0123", "-1e-05", "2026-01-01"])
def test_all_else_is_kept(text: str) -> None:
    assert normalise_text(text, {}) == text


@pytest.mark.parametrize("name", ["golden", "golden.tar.xz"])
def test_what_is_written_is_read(tmp_path: Path, name: str) -> None:
    files = {"a/b.json": b"{}", "c.txt": "ü\r\n".encode()}
    write_golden(files, tmp_path / name)
    assert read_golden(tmp_path / name) == files


def test_every_format_is_exported() -> None:
    assert set(EXPORTS) == set(FORMATS)
