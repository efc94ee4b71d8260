"""Replies of a run scored again by today's scorers and by one's own; the run needs its journal
alone."""

import json
from importlib.metadata import EntryPoint

import pytest

from infthor_eval.nieh.config import RescoredConfig, SourceRun
from infthor_eval.nieh.records import RECORDS
from infthor_eval.runs import read_run
from infthor_eval.storage.limits import SCORER_SECONDS

from ...helpers.nieh_runs import make_record
from .rescored import REPLIES, read_journal_lines, read_row, read_scores

RIGHT, WRONG = {"reference": 1.0, "strict": 1.0}, {"reference": 0.0, "strict": 0.0}
FOUR = {f"q{number}": score for number, score in enumerate((1.0, 0.0, 0.0, 1.0, 1.0, 0.0))}


# -- our scorers


def test_todays_scores_are_a_run_that_names_its_source(source, rescore, run_cli):
    """The journal has q0 scored as a scorer with a fault would."""
    folder = source([make_record(0, "Sofa", ("Sofa",), scores=WRONG), *REPLIES[1:]], n_samples=10)
    code, output, new = rescore(folder)
    assert code == 0
    assert "7 replies scored; 1 without a reply stay failed; 2 were never asked" in output
    assert "nieh_gt, strict: 1 of 7 scores differ from those in the journal" in output
    assert "  q0: 0, now 1: 'Sofa'" in output
    assert read_row(output, "nieh_gt strict our strict scorer") == "7 40.00 54.29 1"
    header, records = read_run(new, RECORDS)
    assert (header.name, new.parent.name, new.name) == ("m-rescored",) * 2 + (
        f"nieh_gt-{header.config.hash}",
    )
    source_run = SourceRun("m", read_run(folder, RECORDS)[0].config.hash)
    assert header.config.rescored == RescoredConfig(source=source_run, scorer=None, judge=None)
    assert header.config.model == {"name": "m"}
    assert {name: read_scores(new, "strict")[name] for name in FOUR} == FOUR
    assert read_scores(new, "strict")["q7"] == pytest.approx(0.8)
    assert {one.id: one.failure for one in records if one.failure} == {"q6": "m fails"}
    results = json.loads((new / "results.json").read_text())
    assert (results["n_missing"], results["usage"]["requests"]) == (2, 0)
    for words in (("show", new, "--full"), ("compare", folder, new), ("ls", "runs", new.parent)):
        assert run_cli(*words)[0] == 0


def test_the_same_command_again_writes_nothing_new(source, rescore):
    _, _, new = rescore(source())
    names = ("journal/worker-0.jsonl", "results.json", "rescored.json")
    before = [(new / name).read_bytes() for name in names]
    _, _, again = rescore(new.parents[2] / "elsewhere" / "a run")
    assert again == new
    assert [(new / name).read_bytes() for name in names] == before


def test_a_changed_scorer_replaces_what_the_journal_has(source, rescore, monkeypatch):
    folder = source()
    _, _, new = rescore(folder)
    monkeypatch.setattr("infthor_eval.nieh.rescoring.rescore.scores", lambda reply, answers: WRONG)
    code, output, again = rescore(folder)
    assert (code, again) == (0, new)
    assert "nieh_gt, strict: 4 of 7 scores differ" in output
    assert set(read_scores(new, "strict").values()) == {0.0, None}


def test_metrics_of_a_task_file_are_left_out_and_replies_that_they_failed_on_are_scored(
    source, rescore
):
    failed = make_record(
        0, "Sofa", ("Sofa",), scores={}, failure="process_results fails on q0: no letters"
    )
    folder = source(
        [failed, make_record(1, "Bed", ("Bed",), scores={"letters": 0.3})],
        n_samples=2,
        metrics=("letters",),
    )
    code, output, new = rescore(folder)
    assert code == 0
    assert "nieh_gt: letters: left out, as the journal does not say how to compute it" in output
    assert [(one.payload.scores, one.failure) for one in read_run(new, RECORDS)[1]] == [
        (RIGHT, None)
    ] * 2
    assert read_row(output, "nieh_gt strict our strict scorer") == "2 - 100.00 -"


def test_a_run_of_another_suite_and_a_folder_without_a_run_are_refused_in_one_line(
    source, rescore, tmp_path
):
    code, output, new = rescore(source((), suite="plans"))
    assert (code, new, output.count("\n")) == (2, None, 1)
    assert "a run: is a run of plans; give a run of nieh, which has replies" in output
    code, output, _ = rescore(tmp_path)
    assert (code, output.count("\n")) == (2, 1)
    assert "no journal in it" in output


def test_a_run_of_ours_has_the_scores_that_it_had(make_nieh_set, rescore, evaluate):
    folder = evaluate(data=make_nieh_set(size=56))
    code, output, new = rescore(folder)
    assert (code, "5 replies scored\n" in output, "differ from" in output) == (0, True, False)
    before, now = (json.loads((one / "results.json").read_text()) for one in (folder, new))
    assert now["summary"] == before["summary"]


def test_runs_on_true_and_blank_frames_are_a_pair_once_scored_again(
    source, rescore, run_cli, tmp_path
):
    _, _, seeing = rescore(source())
    (tmp_path / "elsewhere" / "a run").rename(tmp_path / "elsewhere" / "another")
    _, _, blank = rescore(source(frames="blank"))
    assert "Gain over the same model's run on blank frames" in run_cli("show", seeing, blank)[1]


# -- a scorer of one's own


@pytest.fixture
def own(tmp_path):
    """Writes the file `own.py`."""
    return (tmp_path / "own.py").write_text


LENGTH = "def length(reply, answers):\n    return len(reply) + len(answers)\n"


def test_a_function_in_a_file_is_a_metric_of_its_name(source, rescore, own):
    own(LENGTH)
    code, output, new = rescore(source(), "--scorer", "own.py:length")
    assert code == 0
    assert list(read_scores(new, "length").values()) == [5, 15, 4, 4, 4, 8, None, 12]
    assert read_row(output, "nieh_gt length length in own.py") == "7 - 742.86 -"
    scorer = read_run(new, RECORDS)[0].config.rescored.scorer
    assert (scorer["name"], scorer["metrics"], scorer["file"]) == ("length", ["length"], "own.py")
    own(LENGTH + "# edited\n")
    assert rescore(new.parents[2] / "elsewhere" / "a run", "--scorer", "own.py:length")[2] != new


def test_a_mapping_is_several_metrics(source, rescore, own):
    own("def both(reply, answers):\n    return {'b': True, 'a': reply == answers[0]}\n")
    _, output, new = rescore(source(), "--scorer", "./own.py:both")
    names = read_run(new, RECORDS)[0].config.tasks["nieh_gt"].metrics.names
    assert names == ("reference", "strict", "b", "a")
    assert read_scores(new, "a")["q0"] == read_scores(new, "b")["q1"] == 1.0
    assert "a: both in own.py." in output


def test_an_exception_fails_the_reply_alone_and_its_traceback_is_kept(source, rescore, own):
    own("def third(reply, answers):\n    return reply.split()[2] == 'x'\n")
    folder = source()
    code, output, new = rescore(folder, "--scorer", "own.py:third")
    assert code == 1
    failure = (
        "third fails: IndexError in own.py:2 (third): list index out of range; traceback in "
        "journal/tracebacks.txt"
    )
    assert f"nieh_gt: 6 sample(s) failed, in no score: {failure}" in output
    assert "1 replies scored; 6 failed by the scorer; 1 without a reply stay failed" in output
    assert "reply.split()[2]" in (new / "journal" / "tracebacks.txt").read_text()
    records = {one.id: one for one in read_run(new, RECORDS)[1]}
    payload = records["q0"].payload
    assert (records["q0"].failure, payload.scores, payload.reply) == (failure, {}, "Sofa")
    assert records["q1"].failure is None
    lines = read_journal_lines(new)
    rescore(folder, "--scorer", "own.py:third")
    assert read_journal_lines(new) == lines


def test_a_scorer_that_does_not_end_fails_the_reply_alone(source, rescore, own, monkeypatch):
    monkeypatch.setenv(SCORER_SECONDS.name, "1")
    own("def f(reply, answers):\n    while reply == 'Sofa':\n        pass\n    return 1\n")
    code, output, new = rescore(source(REPLIES[:2]), "--scorer", "own.py:f")
    assert code == 1
    assert f"f fails: it is not done after 1 s; if this is intended, set {SCORER_SECONDS.name}" in (
        output
    )
    records = {one.id: one for one in read_run(new, RECORDS)[1]}
    assert [records[name].failure is None for name in ("q0", "q1")] == [False, True]


@pytest.mark.parametrize(
    ("body", "failure"),
    [
        ("return float('nan')", "f is nan"),
        ("return 'high'", "could not convert string to float: 'high'"),
        ("return {}", "it gives nothing"),
        ("return {'x': 1} if reply == 'Sofa' else {'y': 1}", "it gives y, not x"),
    ],
)
def test_what_is_no_score_is_a_failure(source, rescore, own, body, failure):
    own(f"def f(reply, answers):\n    {body}\n")
    code, output, _ = rescore(source(REPLIES[:2]), "--scorer", "own.py:f")
    assert code == 1
    assert failure in output
    assert "Traceback" not in output


@pytest.mark.parametrize(
    ("text", "name", "reason"),
    [
        ("", "none.py:f", "none.py: there is no such file; write FILE.py:NAME"),
        ("", "own.py:f", "own.py has no function f; write FILE.py:NAME with a function in it"),
        (
            "f = 3",
            "own.py:f",
            "--scorer own.py:f: is not a function of a reply and the gold answers",
        ),
        ("import nothing_of_this_name", "own.py:f", "fails when it is imported"),
        (
            "def strict(r, a): return 1",
            "own.py:strict",
            "calls its metric strict, as one of ours is called",
        ),
        (
            "",
            "measure",
            "unknown scorer 'measure'; write FILE.py:NAME, or the name of a package's (no package "
            "has any)",
        ),
    ],
)
def test_a_scorer_that_cannot_be_had_is_one_line(source, rescore, own, text, name, reason):
    own(text)
    code, output, new = rescore(source(), "--scorer", name)
    assert (code, new, output.count("\n")) == (2, None, 1)
    assert reason in output


def shout(reply, answers):
    """The scorer of another package."""
    return reply.isupper()


def test_a_scorer_of_another_package_is_found_by_its_entry_point(source, rescore, monkeypatch):
    point = EntryPoint("loud", f"{__name__}:shout", "infthor_eval.scorers")
    monkeypatch.setattr(
        "infthor_eval.plugins.entry_points", lambda group: [point] if group == point.group else []
    )
    code, _, new = rescore(source(REPLIES[:1]), "--scorer", "loud")
    assert (code, read_scores(new, "loud")) == (0, {"q0": 0.0})
    scorer = read_run(new, RECORDS)[0].config.rescored.scorer
    assert (scorer["name"], scorer["package"]) == ("loud", "tests")
    assert "there are loud)" in rescore(source(REPLIES[:1]), "--scorer", "quiet")[1]
