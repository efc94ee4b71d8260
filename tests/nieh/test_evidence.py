"""What was shown of the evidence: in samples, summaries and tables, and the effective length."""

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.contexts import Sample, context_named
from infthor_eval.nieh.effective_length import effective_length, find_series
from infthor_eval.nieh.evidence_tables import evidence_tables
from infthor_eval.nieh.records import ShownClues
from infthor_eval.nieh.samples import TaskSamples
from infthor_eval.nieh.shown_clues import shown_clues
from infthor_eval.nieh.summary import NiehSummary, summarise
from infthor_eval.runs import RunHeader, RunSummary, Tokens

from .made import identity, record


@pytest.fixture
def data(make_nieh_set):
    return NiehSet(make_nieh_set(size=8))


def shown(data, text, frames, context="truncate_head", **fields):
    question = next(item for item in data.questions if item.text.startswith(text))
    task_samples = TaskSamples(data, context, context_named(context), [], [], {})
    return shown_clues(task_samples, Sample(question, frames, **fields))


def test_clue_frames_among_the_shown_ones_are_counted(data):
    """Six frames a trajectory; the clues are 0, 2 and 4, or 1 and 3."""
    assert shown(data, "What did", (2, 3, 4, 5)) == ShownClues(n_shown=2, n_clues=3, n_after=1)
    assert shown(data, "What did", (5,)) == ShownClues(n_shown=0, n_clues=3, n_after=1)
    assert shown(data, "Where was", range(6), "trajectory") == ShownClues(n_shown=2, n_clues=2, n_after=2)


def test_a_film_without_a_video_file_shows_the_sampled_frames(data):
    assert shown(data, "Where was", (0, 3, 5), "video", fps=2.0) == ShownClues(n_shown=1, n_clues=2, n_after=2)


def test_question_files_alone_show_nothing(data):
    files = NiehSet(next(data.root.glob("qa_set*.csv")))
    files.has_frames = False
    assert shown(files, "What did", ()) is None


def run_of(records, context="truncate_head", **settings):
    config = identity(context=context, **settings)
    return RunSummary(RunHeader(suite="nieh", name="m", config=config), summarise(config, records))


def made_records():
    """Right with all and one of two clue frames shown, wrong without any, and one of which nothing is known."""
    all_, some, none = (ShownClues(n_shown=n, n_clues=2, n_after=after) for n, after in ((2, 49), (1, 50), (0, 4000)))
    replies = [("mug", all_), ("mug", all_), ("mug", some), ("cup", none), ("mug", None)]
    return [record(n, reply, shown_clues=clues, file="qa_set_a") for n, (reply, clues) in enumerate(replies)]


def test_samples_are_counted_by_what_was_shown():
    task = run_of(made_records()).summary.tasks["nieh_gt"]
    for name in ("total", "qa_set_a"):
        evidence = task.evidence[name]
        shares = {share: (cell.n, cell.scores["strict"].mean) for share, cell in evidence.by_shown_clues.items()}
        assert shares == {"all": (2, 1.0), "some": (1, 1.0), "none": (1, 0.0)}
        assert {name: cell.n for name, cell in evidence.by_distance.items()} == {"0-49": 2, "50-99": 1, ">=3200": 1}
    assert task.by_file["qa_set_a"].n == 5


def test_tables_have_a_row_per_file_and_scorer():
    by_share, by_distance = evidence_tables([run_of(made_records())])
    assert [column.name for column in by_share.columns[4:]] == ["all", "some", "none"]
    assert [row.cells[2:4] for row in by_share.rows] == [
        (file, scorer) for file in ("total", "a") for scorer in ("reference", "strict")
    ]
    assert [cell.split()[0] for cell in by_share.rows[0].cells[4:]] == ["100.0", "100.0", "0.0"]
    assert [column.name for column in by_distance.columns[4:]] == ["0-49", "50-99", ">=3200"]


def test_what_shows_all_evidence_is_in_neither_table():
    clues = ShownClues(n_shown=1, n_clues=1, n_after=3)
    assert evidence_tables([run_of([record(0, "mug", shown_clues=clues)], context="clues")]) == []


@pytest.mark.parametrize(
    ("base", "scores", "length"),
    [
        (0.8, {"8": 0.8, "16": 0.68, "32": 0.67}, "16K"),  # 85 % of 0.8 is 0.68
        (0.8, {"8": 0.5, "16": 0.9}, "below 8K"),
        (0.8, {"8": 0.9, "16": None, "32": 0.8}, "32K, all that were asked"),
        (0.0, {"8": 0.5}, "-"),
        (None, {"8": 0.5}, "-"),
        (0.8, {}, "-"),
    ],
)
def test_the_effective_length_is_the_longest_up_to_which_85_percent_are_kept(base, scores, length):
    assert effective_length(base, scores) == length


def test_series_have_their_base_from_the_same_model_and_set():
    runs = [
        run_of([record(n, "mug") for n in range(4)], context="clues"),
        run_of([record(n, "mug" if n else "cup") for n in range(4)], context="haystack", ctx_size=16),
        run_of([record(n, "mug") for n in range(4)], context="haystack", ctx_size=8),
        run_of([record(n, "mug", tokens=Tokens(context=40_000)) for n in range(2)], context="trajectory"),
    ]
    series = {item.context: item for item in find_series(runs) if item.scorer == "strict"}
    assert [(point.length, point.score) for point in series["haystack"].points] == [("8", 1.0), ("16", 0.75)]
    assert [(point.length, point.score) for point in series["trajectory"].points] == [("32-64", 1.0)]
    assert series["haystack"].base.score == 1.0
    assert list(find_series(runs[1:])) == []
    assert isinstance(runs[0].summary, NiehSummary)
