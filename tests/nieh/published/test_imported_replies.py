"""What imported logs say of the evidence: shown clue frames, lengths of trajectories, and the mode
of videos."""

import json

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import PublishedColumns, Question
from infthor_eval.nieh.guessing.blind import visible_knowledge
from infthor_eval.nieh.published import imported_replies
from infthor_eval.nieh.published.imported_replies import import_logs
from infthor_eval.nieh.records import BlindGuess, ShownClues
from infthor_eval.nieh.results.summary import summarise

from ...helpers.published import PUBLISHED_SETS, make_log_row, needs_published_sets

SINGLE, MULTI = "qa_set_nieh_single_clue", "qa_set_nsieh_multi_clue"
QUESTIONS = [
    Question(
        f"t{number // 2}",
        "Where is Mug now?",
        clues,
        ("Bed",),
        published=PublishedColumns("single", f"q{number}"),
    )
    for number, clues in enumerate([(3,), (8,), (5, 6)])
]


@pytest.fixture(autouse=True)
def no_guesses(monkeypatch):
    """Spares the tests the guessers, which take a second."""
    monkeypatch.setattr(imported_replies, "find_floor", lambda *_: {})


@pytest.fixture
def imported(tmp_path):
    """Imports logs of rows, each a reply to the question of its number, by the end of their
    names."""
    write_questions(tmp_path / f"{SINGLE}.csv", QUESTIONS)

    def imported(**logs):
        paths = []
        for mode, rows in logs.items():
            paths.append(tmp_path / f"eval_{SINGLE}_Some-VL_{mode}.log")
            paths[-1].write_text("".join(f"{json.dumps(row)}\n" for row in rows))
        return import_logs(paths, NiehSet(tmp_path))

    return imported


def row(number, **more):
    return make_log_row(number, QUESTIONS[number], **({"reply": "bed"} | more))


def shown_clues_of(run):
    """Shown clues, clues and frames after the last one, by question; None if they are not known."""
    clues_by_question = {record.id: record.payload.shown_clues for record in run.records}
    return {
        name: clues and (clues.n_shown, clues.n_clues, clues.n_after)
        for name, clues in clues_by_question.items()
    }


def test_whole_trajectories_show_all_and_tell_their_length(imported):
    rows = [row(0, n_imgs=10), row(1, n_imgs=10, eval_mode="full_traj"), row(2)]
    (run,) = imported(full_traj=rows)
    assert (run.task, shown_clues_of(run)) == (
        "nieh_full",
        {"q0": (1, 1, 6), "q1": (1, 1, 1), "q2": (2, 2, None)},
    )


def test_the_end_of_a_trajectory_tells_its_length_and_what_was_shown(imported):
    end = {"eval_mode": "truncate_head", "ctx_size_k": 1, "n_imgs": 5}
    rows = [row(number, **end, selected_img_indices=[6, 7, 8, 9]) for number in range(3)]
    (run,) = imported(full_traj_truncate_head_1K=rows)
    assert run.settings["ctx_size"] == 1
    assert (run.task, shown_clues_of(run)) == (
        "nieh_truncate_head_1k",
        {"q0": (0, 1, 6), "q1": (1, 1, 1), "q2": (1, 2, 3)},
    )


@pytest.mark.parametrize(
    ("said", "thinking"),
    [
        ("<answer>Bed</answer>", None),
        ("<think>A bed?</think>\\boxed{\\text{bed}}", "A bed?"),
        ("<think>A bed?</think>bed", "A bed?"),
    ],
)
def test_thoughts_and_marks_are_no_part_of_an_answer(imported, said, thinking):
    (run,) = imported(full_traj=[row(0, reply=said)])
    (record,) = run.records
    assert record.payload.reply.lower() == "bed"
    assert record.payload.thinking == thinking
    assert record.payload.scores == {"reference": 1.0, "strict": 1.0}


def test_lengths_serve_the_logs_of_other_modes(imported):
    retrieved_columns = {"eval_mode": "clip_retrieval", "n_imgs": 2}
    retrieved = [
        row(0, **retrieved_columns, selected_img_indices=[1, 3]),
        row(1, **retrieved_columns),
        row(2, **retrieved_columns),
    ]
    alone = imported(full_traj_clip_retrieval=retrieved)
    assert [shown_clues_of(run) for run in alone] == [{"q0": (1, 1, None), "q1": None, "q2": None}]
    run, _ = imported(full_traj_clip_retrieval=retrieved, full_traj=[row(1, n_imgs=10)])
    assert run.settings["top_k"] == 2
    assert (run.task, shown_clues_of(run)) == (
        "nieh_clip_retrieval",
        {"q0": (1, 1, 6), "q1": None, "q2": None},
    )


def test_a_length_that_a_clue_lies_beyond_is_none(imported):
    # A model that takes only some of the frames logs these as n_imgs.
    (run,) = imported(full_traj=[row(0, n_imgs=5), row(1, n_imgs=5)])
    assert shown_clues_of(run)["q1"] == (1, 1, None)


def test_an_absence_has_no_evidence(tmp_path):
    absent = Question(
        "t0", "Is there any sink in this room?", (1, 2), ("no",), "object_presence", absence=True
    )
    write_questions(tmp_path / "qa_set_test.csv", [absent])
    log = tmp_path / "mine.jsonl"
    log.write_text(json.dumps({"question_id": absent.id, "reply": "no", "frames_shown": [1]}))
    (run,) = import_logs([log], NiehSet(tmp_path), "me")
    assert [record.payload.shown_clues for record in run.records] == [None]


def test_neutral_rows_show_the_frames_that_they_name(tmp_path):
    write_questions(tmp_path / f"{SINGLE}.csv", QUESTIONS)
    log = tmp_path / "mine.jsonl"
    frames = ([8, 1, 8], [], None)
    rows = [
        {"question_id": f"q{i}", "reply": "bed", "frames_shown": of_row}
        for i, of_row in enumerate(frames)
    ]
    log.write_text("".join(f"{json.dumps(one)}\n" for one in rows))
    (run,) = import_logs([log], NiehSet(tmp_path), "me")
    assert shown_clues_of(run) == {"q0": (0, 1, None), "q1": (0, 1, None), "q2": None}


@pytest.mark.parametrize(
    ("name", "task", "settings"),
    [
        ("full_traj_video_fps1", "nieh_video", {"context": "video", "fps": 1.0}),
        ("full_traj_video_fps2", "nieh_video_2fps", {"context": "video", "fps": 2.0}),
        ("full_traj_video", "nieh_video", {"context": "video"}),
    ],
)
def test_the_name_of_a_log_of_videos_tells_their_rate(imported, name, task, settings):
    (run,) = imported(**{name: [row(0, eval_mode="video")]})
    assert (run.task, run.settings) == (task, {**settings, "prompt": None})


# 123 tokens a frame, 144 a pair of frames of a film; the prompt's own words, and a word of the
# question each.
LOGS, MAIN = ("published-logs", 60 + 5), ("published-main", 52 + 5)
FILM = {"eval_mode": "video", "ctx_n_tokens": 290 + 54 + 5}
END = {"eval_mode": "truncate_head", "ctx_size_k": 32, "n_imgs": 270}


@pytest.mark.parametrize(
    ("name", "row_of", "task", "prompt"),
    [
        ("full_traj", {"n_imgs": 10, "ctx_n_tokens": 1230 + LOGS[1]}, "nieh_published_full", LOGS),
        # Frames asked about in the words of main are no published row.
        ("full_traj", {"n_imgs": 10, "ctx_n_tokens": 1230 + MAIN[1]}, "nieh_full", MAIN),
        ("full_traj_x", {**END, "ctx_n_tokens": 33210 + LOGS[1]}, "nieh_published_last_32k", LOGS),
        ("full_traj_video_fps2", FILM, "nieh_published_video_2fps", MAIN),
    ],
)
def test_a_log_that_tells_its_prompt_is_the_task_of_its_published_row(
    imported, name, row_of, task, prompt
):
    (run,) = imported(**{name: [row(0, **row_of)]})
    assert (run.task, run.settings["prompt"]) == (task, prompt[0])


def test_records_have_what_blind_says_that_suits_the_mode(imported, monkeypatch):
    blind = BlindGuess(form="f", scores={"strict": 0.5}, form_scores={"strict": 0.5})
    known = {visible_knowledge("trajectory"): {"q0": blind}}
    monkeypatch.setattr(imported_replies, "find_floor", lambda _, knowledge: known[knowledge])
    (run,) = imported(full_traj=[row(0), row(1)])
    assert {record.id: record.payload.blind for record in run.records} == {"q0": blind, "q1": None}


@needs_published_sets
def test_published_replies_at_32k_by_shown_clues():
    logs, data = (
        sorted((PUBLISHED_SETS / "replies").glob("*truncate_head_32K.log.gz")),
        NiehSet(PUBLISHED_SETS),
    )
    (run,) = import_logs(logs, data)
    ((_, task),) = summarise(run.header(data).config, run.records).tasks.items()
    cells = {
        "total": task.by["shown_clues"],
        **{name: by["shown_clues"] for name, by in task.files.items()},
    }
    scores = {
        name: {
            share: (cell.n, round(100 * cell.scores["reference"].mean, 1))
            for share, cell in of_file.items()
        }
        for name, of_file in cells.items()
    }
    assert scores[SINGLE] == {"all": (457, 57.9), "none": (372, 55.2)}
    assert scores[MULTI]["all"] == (105, 47.0)
    assert all(record.payload.shown_clues for record in run.records)
    # Row 0 of the file: its clue is frame 785 of 886.
    first = next(record for record in run.records if record.id == data.files[SINGLE][0].id)
    assert first.payload.shown_clues == ShownClues(n_shown=1, n_clues=1, n_after=100)
