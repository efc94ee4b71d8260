"""`audit`: what a set gives away, from the command line."""

from infthor_eval.formats.qa_csv import read_questions
from infthor_eval.formats.question import Question
from tests.helpers.command_line import assert_refused, read_success


def leaking(n=40):
    """All mugs are there, and no book; and as many questions that nothing gives away."""
    rows = [(f"t{k}", *(("mug", "yes"), ("book", "no"))[k % 2]) for k in range(n)]
    questions = [
        Question(t, f"Is there any {item} in this room?", (1,), (answer,))
        for t, item, answer in rows
    ]
    fair = [
        (f"t{k % 8}", f"Have you seen a thing{k}?", ("yes", "no")[k // 2 % 2]) for k in range(n)
    ]
    return [*questions, *(Question(t, text, (1,), (answer,)) for t, text, answer in fair)]


def test_a_set_is_audited_beside_a_run(make_nieh_set, run_cli, evaluate):
    data = make_nieh_set(leaking(24), size=8)
    out, _ = read_success(run_cli("audit", data, evaluate(data=data)))
    text = " ".join(out.split())
    told = "Is there any {} in this room? (24 questions): words gets 100.0 % without a frame."
    assert told in text
    assert "100.0 (solved)" in text


def test_the_balanced_part_is_written(make_nieh_set, tmp_path, run_cli):
    data, part = make_nieh_set(leaking(), size=8), tmp_path / "qa_set_part.csv"
    _, err = read_success(run_cli("audit", data, "--balanced", part))
    kept = read_questions(part)
    assert f"{part}: {len(kept)} of" in err
    assert sum("thing" in question.text for question in kept) > sum(
        "any" in question.text for question in kept
    )


def test_what_cannot_be_audited_is_one_line(make_nieh_set, tmp_path, run_cli, scripted_run):
    data = make_nieh_set(size=8)
    assert_refused(run_cli("audit", tmp_path / "none"), "no such folder")
    assert_refused(run_cli("audit", data, scripted_run), "only runs of nieh can stand beside blind")
    yes = make_nieh_set(
        [Question(f"t{n}", "Have you seen a mug?", (1,), ("yes",)) for n in range(4)],
        size=8,
        name="yes",
    )
    code, _, err = run_cli("audit", yes, "--balanced", tmp_path / "part.csv")
    assert (code, "has a balanced part; nothing is written" in err) == (2, True)
    assert not (tmp_path / "part.csv").exists()
