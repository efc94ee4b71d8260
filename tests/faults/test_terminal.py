"""Text from data on the terminal: shown as it is, whatever is in it."""

import pytest

from infthor_eval.report.terminal import print_table, table_console
from infthor_eval.tables import Column, Row, Table

from ..helpers.command_line import option_words, read_success

NASTY = {
    "closing markup": "a[/b]c",
    "markup": "[bold]loud[/bold]",
    "a link": "[link=file:///etc/passwd]here[/link]",
    "an emoji": ":boom:",
    "escape": "\x1b[31mred",
    "window title": "\x1b]0;owned\x07",
    "one-byte escape": "\x9b31mred",
    "backspace": "ab\b\bcd",
    "carriage return": "good\rbad",
    "reordering": "abc\u202egnp.exe",
    "invisible": "a\u200bb",
}
FOLDERS = {name: NASTY[name] for name in ("closing markup", "escape", "an emoji", "markup")}
FOLDERS["no Unicode"] = "\udcff"
RAW = ("\x1b", "\x9b", "\x07", "\b", "\r", "\u202e", "\u200b")


def _as_shown(text):
    return "".join(
        letter if letter.isprintable() else letter.encode("unicode_escape").decode("ascii")
        for letter in text
    )


def _is_clean(out):
    return not any(raw in out for raw in RAW)


@pytest.mark.parametrize("name", NASTY)
def test_a_table_shows_text_as_text(capfd, name):
    table = Table(
        NASTY[name],
        (Column(NASTY[name], False), Column("n")),
        (Row((NASTY[name], "1")),),
        (NASTY[name],),
    )
    print_table(table, table_console())
    out = capfd.readouterr().out
    assert out.count(_as_shown(NASTY[name])) == 4
    assert _is_clean(out)


@pytest.mark.parametrize("name", NASTY)
def test_what_is_said_of_a_skipped_question_is_text(make_nieh_set, tmp_path, run_cli, name):
    data = make_nieh_set(size=56)
    extra = NASTY[name].replace("\r", "").replace("/", "|")
    (data / "qa_set_more.csv").write_text(
        f"traj_id,question,gt_img_idx,answer\n{extra},q,[1],['a']\n"
    )
    words = option_words(model="oracle", tasks="nieh_gt", data=data, out=tmp_path / "out")
    out, err = read_success(run_cli(*words))
    assert _as_shown(extra) in err
    assert _is_clean(out + err)


@pytest.mark.parametrize("name", NASTY)
def test_an_error_is_text(tmp_path, run_cli, name):
    data = tmp_path / NASTY[name].replace("/", "|")
    code, out, err = run_cli(*option_words(model="oracle", tasks="nieh_gt", data=data))
    assert (code, out) == (2, "")
    assert _is_clean(err)
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize("name", FOLDERS)
def test_a_folder_of_results_is_text(make_nieh_set, tmp_path, run_cli, name):
    data = make_nieh_set(size=56)
    output = tmp_path / FOLDERS[name].replace("/", "|")
    words = option_words(model="oracle", tasks="nieh_gt", data=data, out=output)
    out, err = read_success(run_cli(*words))
    assert _as_shown(output.name) in out
    assert _is_clean(out + err)


@pytest.mark.parametrize("name", ["closing markup", "escape", "an emoji", "markup"])
def test_ls_shows_names_as_text(tmp_path, run_cli, task_files, name):
    text = NASTY[name].replace("\x1b", "\\e")
    (task_files / "nieh" / "own.yaml").write_text(
        f'include: _nieh.yaml\ntask: "{text}"\ndataset_kwargs: {{context: clues}}'
    )
    out, _ = read_success(run_cli("ls", "tasks"))
    assert _as_shown(NASTY[name]) in "".join(out.split())
    assert _is_clean(out)
