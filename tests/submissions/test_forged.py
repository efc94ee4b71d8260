"""Forged submissions, each refused for what was forged in it."""

import random
import shutil
from pathlib import Path

import msgspec
import pytest
from msgspec.structs import replace

from infthor_eval.nieh.config import MetricsConfig, SkippedSample
from infthor_eval.nieh.rescoring.rescore import Source, read_source
from infthor_eval.nieh.scoring import scores
from infthor_eval.submissions.checking import check_submissions
from tests.helpers.submissions import (
    edit_journal,
    key_of_one_world,
    reader,
    reply_with,
    run_model,
    submit,
    write_home_set,
)

FORGERIES = {}


def forgery(check, words):
    """A function that writes a forged submission, with the check that is to refuse it, and words of
    the reason."""

    def register(make):
        FORGERIES[make.__name__] = (make, check, words)
        return make

    return register


def honest(material, name="homes", skill=0.5, **options):
    return reply_with(material.runs[name, "shown"], reader(skill, "honest"), **options)


def key(record):
    return ", ".join(map(str, record.payload.answers))


def with_config(run, **changes):
    return Source(
        replace(run.header, config=replace(run.header.config, **changes)), list(run.records)
    )


def with_task(run, task="nieh_gt", **changes):
    changed = replace(run.header.config.tasks[task], **changes)
    return with_config(run, tasks={task: changed})


def hard(records):
    return [record for record in records if record.payload.scores["strict"] < 1]


@forgery("scores", "1 stored scores")
def one_score_edited(material, root):
    run = honest(material)
    wrong = hard(run.records)[0]
    lie = replace(wrong, payload=replace(wrong.payload, scores={"reference": 1.0, "strict": 1.0}))
    records = [lie if record is wrong else record for record in run.records]
    return submit(root, "forged", Source(run.header, records))


@forgery("results", "results.json has 99.00 %")
def results_edited(material, root):
    folder = submit(root, "forged", honest(material))
    (path,) = folder.rglob("results.json")
    text = path.read_text()
    at = text.index('"primary_metrics"')
    mean = text.index('"mean":', at)
    end = text.index(",", mean) if "," in text[mean : mean + 40] else text.index("\n", mean)
    path.write_text(f'{text[:mean]}"mean": 0.99{text[end:]}')
    return folder


@forgery("questions", "other words or gold answers")
def key_edited_to_the_replies(material, root):
    run = honest(material)
    records = [
        replace(
            record,
            payload=replace(
                record.payload,
                answers=(record.payload.reply,),
                scores=scores(record.payload.reply, (record.payload.reply,)),
            ),
        )
        for record in run.records
    ]
    return submit(root, "forged", Source(run.header, records))


@forgery("complete", "are missing")
def hard_questions_dropped(material, root):
    run = honest(material)
    gone = hard(run.records)[:9]
    records = [record for record in run.records if record not in gone]
    header = replace(run.header, n_units=len(records), units_by_task={"nieh_gt": len(records)})
    return submit(root, "forged", Source(header, records))


@forgery("complete", "are excluded")
def hard_questions_excluded(material, root):
    run = honest(material)
    gone = hard(run.records)[:9]
    records = [
        replace(record, excluded="nobody can see it") if record in gone else record
        for record in run.records
    ]
    return submit(root, "forged", Source(run.header, records))


@forgery("complete", "leaves out")
def hard_questions_said_to_be_skipped(material, root):
    run = honest(material)
    gone = hard(run.records)[:9]
    skipped = tuple(SkippedSample(question_id=it.id, reason="no frame") for it in gone)
    run = with_task(run, skipped=skipped, n_samples=len(run.records) - len(gone))
    return submit(root, "forged", Source(run.header, [it for it in run.records if it not in gone]))


@forgery("complete", "were not asked")
def hard_questions_not_asked(material, root):
    run = honest(material)
    gone = hard(run.records)[:9]

    def not_asked(record):
        payload = replace(record.payload, reply=None, scores={})
        return replace(record, failure="over the cap", asked=False, payload=payload)

    records = [not_asked(record) if record in gone else record for record in run.records]
    return submit(root, "forged", Source(run.header, records))


@forgery("complete", "--limit 30")
def a_part_of_the_set(material, root):
    run = with_config(honest(material), limit=30)
    return submit(root, "forged", Source(run.header, run.records[:30]))


@forgery("once", "answered twice")
def the_better_of_two_answers(material, root):
    run = honest(material)
    folder = submit(root, "forged", run)
    wrong = hard(run.records)[0]
    second = replace(
        wrong,
        attempt=2,
        payload=wrong.payload.with_reply(key(wrong), scores(key(wrong), wrong.payload.answers)),
    )
    return edit_journal(folder, lambda lines: lines.append(msgspec.to_builtins(second)))


@forgery("once", "2 runs with the same settings")
def the_better_of_two_runs(material, root):
    run = honest(material)
    return submit(root, "forged", run, with_config(run, seed=1))


@forgery("readable", "is code in a file, which is not run here")
def code_in_place_of_a_memory(material, root):
    code = root / "memory.py"
    code.write_text("raise SystemExit('run')")
    return submit(root, "forged", with_config(honest(material), memory=f"{code}:Memory"))


@forgery("questions", "are of no question of the set")
def easy_questions_added(material, root):
    run = honest(material)
    added = [replace(run.records[0], id=f"kitchen-1-a/{number:012x}") for number in range(20)]
    return submit(root, "forged", Source(run.header, [*run.records, *added]))


@forgery("set", "with fingerprint")
def another_set(material, root):
    other = write_home_set(root / "easier")
    text = (other / "qa_set_homes.csv").read_text()
    (other / "qa_set_homes.csv").write_text(text.replace("['no']", "['yes']"))
    (path,) = run_model(root / "results", model="random", tasks="nieh_gt", data=other)
    return submit(root, "forged", reply_with(read_source(path), reader(0.5, "honest")))


@forgery("questions", "are of no question of the set")
def another_set_under_this_ones_fingerprint(material, root):
    run = honest(material)
    of_twins = Source(run.header, material.runs["twins", "shown"].records)
    records = reply_with(of_twins, reader(0.5, "x")).records
    return submit(
        root, "forged", Source(run.header, [replace(it, task="nieh_gt") for it in records])
    )


@forgery("key words", "to the letter")
def the_key(material, root):
    return submit(root, "forged", reply_with(material.runs["homes", "shown"], key))


@forgery("key form", "brackets and quotes included")
def the_cells_of_the_key(material, root):
    def reply(record):
        return str(list(record.payload.answers))

    return submit(root, "forged", reply_with(material.runs["homes", "shown"], reply))


@forgery("key words", "to the letter")
def the_key_with_errors(material, root):
    draw = random.Random(3)
    other = reader(0.0, "x")

    def reply(record):
        return other(record) if draw.random() < 0.08 else key(record)

    return submit(root, "forged", reply_with(material.runs["homes", "shown"], reply))


@forgery("key score", "as only the key is")
def the_key_reworded(material, root):
    return submit(root, "forged", reply_with(material.runs["homes", "shown"], reader(1.0, "x")))


@forgery("results", "scores.jsonl has other scores")
def the_file_of_scores_edited(material, root):
    folder = submit(root, "forged", honest(material))
    (path,) = folder.rglob("scores.jsonl")
    path.write_text(path.read_text().replace('"strict":0.0', '"strict":1.0', 3))
    return folder


@forgery("copied", "letter by letter")
def a_guessers_replies_under_another_name(material, root):
    def reply(record):
        return f"{record.payload.question.split()[-1]} mug"

    run = material.runs["homes", "shown"]
    submit(root / "others", "first", reply_with(run, reply, model="lab/first"))
    return submit(root, "forged", reply_with(run, reply, model="lab/second"), date="2026-06-02")


@forgery("key spelling", "spelled as the key alone spells")
def half_of_the_key(material, root):
    draw = random.Random(3)
    other = reader(0.0, "x")

    def reply(record):
        return other(record) if draw.random() < 0.5 else key(record)

    return submit(root, "forged", reply_with(material.runs["homes", "shown"], reply))


@forgery("records", "exactly as long")
def the_journal_of_another(material, root):
    theirs = honest(material, model="lab/good")
    submit(root / "others", "good", theirs)
    ours = honest(material, model="forger/better")
    copied = [
        replace(mine, seconds=record.seconds)
        for mine, record in zip(ours.records, theirs.records, strict=True)
    ]
    return submit(root, "forged", Source(ours.header, copied), date="2026-06-02")


@forgery("copied", "are those of good")
def the_replies_of_another(material, root):
    submit(root / "others", "good", honest(material, model="lab/good"))
    ours = honest(material, model="forger/better")

    def reply(record):
        return reader(0.5, "honest")(record).upper() + "."

    copied = reply_with(Source(ours.header, ours.records), reply, model="forger/better")
    return submit(root, "forged", copied, date="2026-06-02")


@forgery("frames", "requests are not those of our set")
def blank_frames_said_to_be_shown(material, root):
    run = reply_with(material.runs["homes", "blank"], reader(0.5, "honest"))
    return submit(root, "forged", with_config(run, frames="shown"))


@forgery("frames", "requests are not those of our set")
def clue_frames_said_to_be_whole_trajectories(material, root):
    clues = honest(material)
    whole = honest(material, "whole")
    fingerprints = {record.id: record.fingerprint for record in clues.records}
    records = [replace(it, fingerprint=fingerprints[it.id]) for it in whole.records]
    return submit(root, "forged", Source(whole.header, records))


@forgery("task", "dataset_kwargs")
def an_easier_context_under_the_tasks_name(material, root):
    run = honest(material)
    settings = material.runs["whole", "shown"].header.config.tasks["nieh_full"].settings
    easier = {**settings, "dataset_kwargs": {"context": "clues"}}
    task = replace(run.header.config.tasks["nieh_gt"], settings=easier)
    records = [replace(record, task="nieh_full") for record in run.records]
    config = replace(run.header.config, tasks={"nieh_full": task})
    header = replace(run.header, config=config, units_by_task={"nieh_full": len(records)})
    return submit(root, "forged", Source(header, records))


@forgery("frames", "requests are not those of our set")
def no_hashes(material, root):
    run = honest(material)
    records = [replace(record, fingerprint="") for record in run.records]
    return submit(root, "forged", Source(run.header, records))


@forgery("complete", "all its runs are controls")
def a_control_alone(material, root):
    return submit(root, "forged", reply_with(material.runs["homes", "blank"], reader(0.5, "x")))


@forgery("model", "the journal is of 'lab/model'")
def the_name_of_another_model(material, root):
    return submit(root, "forged", honest(material), model="famous/large-72b")


@forgery("model", "revision")
def another_revision(material, root):
    return submit(root, "forged", honest(material), revision="0123456789ab")


@forgery("model", "a submission for each model")
def the_best_of_two_models(material, root):
    return submit(
        root,
        "forged",
        honest(material),
        reply_with(material.runs["twins", "shown"], reader(0.5, "x"), model="lab/other"),
    )


@forgery("config", "it was edited, or the folder renamed")
def an_edited_config(material, root):
    folder = submit(root, "forged", honest(material))

    def edit(lines):
        lines[0]["config"]["model"]["checkpoint"] = "famous/large-72b"
        lines[0]["config"]["model"]["name"] = "large-72b"

    edit_journal(folder, edit)
    text = (folder / "submission.yaml").read_text()
    (folder / "submission.yaml").write_text(text.replace("lab/model", "famous/large-72b"))
    return folder


@forgery("identity", "no contact")
def nobody_to_ask(material, root):
    return submit(root, "forged", honest(material), contact="")


@forgery("identity", "yet to come")
def a_day_to_come(material, root):
    return submit(root, "forged", honest(material), date="2999-01-01")


@forgery("identity", "no such file")
def no_statement(material, root):
    folder = submit(root, "forged", honest(material))
    (folder / "submission.yaml").unlink()
    return folder


@forgery("scorers", "other scorers")
def a_scorer_of_ones_own(material, root):
    metrics = MetricsConfig(names=("strict", "reference"), process_results="mine.score", source="1")
    return submit(root, "forged", with_task(honest(material), metrics=metrics))


@forgery("pairs one-sided", "are right in the first world")
def the_key_of_one_world(material, root):
    return submit(root, "forged", reply_with(material.runs["twins", "shown"], key_of_one_world))


@forgery("pairs alike", "nothing that was shown tells them apart")
def worlds_told_apart_on_blank_frames(material, root):
    return submit(
        root,
        "forged",
        reply_with(material.runs["twins", "shown"], reader(0.6, "x")),
        reply_with(material.runs["twins", "blank"], reader(0.6, "x")),
    )


@forgery("pairs and singles", "% of single answers")
def singles_from_the_key_and_pairs_from_nowhere(material, root):
    return submit(
        root,
        "forged",
        honest(material, skill=0.96),
        reply_with(material.runs["twins", "shown"], reader(0.0, "x")),
    )


@forgery("readable", "journal")
def a_torn_journal(material, root):
    folder = submit(root, "forged", honest(material))
    (path,) = folder.rglob("worker-*.jsonl")
    path.write_bytes(path.read_bytes().replace(b'"reply":', b'"reply":[', 1))
    return folder


@pytest.mark.parametrize("name", FORGERIES)
def test_it_is_refused_for_what_was_forged(name, material, check, tmp_path):
    make, by, words = FORGERIES[name]
    folder = make(material, tmp_path)
    others = tmp_path / "others" if (tmp_path / "others").exists() else None
    verdict = check(folder, others)
    reasons = [problem.text for problem in verdict.refusals if problem.check == by]
    assert any(words in reason for reason in reasons), verdict.refusals
    assert not any("\n" in problem.text for problem in verdict.problems)


def test_more_than_twenty_forgeries_are_all_different():
    assert len({(by, words, name) for name, (_, by, words) in FORGERIES.items()}) >= 20


def test_the_same_run_passes_without_the_forgery(material, check, tmp_path):
    assert check(submit(tmp_path, "honest", honest(material))).refusals == []


def test_who_came_first_is_not_refused_for_the_copy(material, owner, tmp_path):
    submit(tmp_path, "first", honest(material, model="lab/good"), date="2026-06-01")
    submit(tmp_path, "later", honest(material, model="forger/better"), date="2026-06-02")
    verdicts = check_submissions(tmp_path, owner)
    assert [bool(verdict.refusals) for verdict in verdicts] == [False, True]
    assert verdicts[1].refusals[0].check == "copied"


def test_the_owner_may_allow_what_a_check_refuses(material, check, tmp_path):
    folder = submit(tmp_path, "key", reply_with(material.runs["homes", "shown"], key))
    allowed = ("key words", "key spelling", "key score")
    assert check(folder, allowed=allowed).refusals == []
    assert set(allowed) <= {problem.check for problem in check(folder, allowed=allowed).warnings}


def test_one_bad_submission_does_not_stop_the_others(material, owner, tmp_path: Path):
    good = submit(tmp_path, "good", honest(material))
    shutil.copytree(good, tmp_path / "bad")
    (tmp_path / "bad" / "submission.yaml").write_text("model: [1, 2")
    verdicts = {it.case.submission.name: it for it in check_submissions(tmp_path, owner)}
    assert not verdicts["good"].refusals
    assert "not YAML" in verdicts["bad"].refusals[0].text
