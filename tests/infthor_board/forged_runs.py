"""Submissions whose questions, settings or names are forged."""

from msgspec.structs import replace

from infthor_eval.cli.commands.rescore import read_source
from infthor_eval.nieh.config import MetricsConfig, SkippedSample
from infthor_eval.nieh.rescoring.rescore import Source
from infthor_eval.run import Run
from tests.infthor_board.material import (
    edit_journal,
    reader,
    reply_with,
    run_model,
    submit,
    write_home_set,
)

from .forging import collect_into, hard, honest, with_config, with_task

FORGERIES = {}
forgery = collect_into(FORGERIES)


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


@forgery("readable", "is code in a file, which is not run here")
def code_in_place_of_a_memory(material, root):
    code = root / "memory.py"
    code.write_text("raise SystemExit('run')")
    return submit(root, "forged", with_config(honest(material), memory=f"{code}:Memory"))


@forgery("readable", "a line of a journal")
def a_number_of_repeats_beyond_any(material, root):
    folder = submit(root, "forged", honest(material))
    return edit_journal(folder, lambda lines: lines[1].update(repeat=20_000_000))


@forgery("readable", "not the config of a run of nieh")
def a_header_of_repeats_beyond_any(material, root):
    folder = submit(root, "forged", honest(material))
    return edit_journal(folder, lambda lines: lines[0]["config"].update(repeats=10**9))


@forgery("readable", "were asked 10,000 times, and has 60 replies")
def more_repeats_than_replies(material, root):
    return submit(root, "forged", with_config(honest(material), repeats=10_000))


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
    return submit(root, "forged", reply_with(read_source(Run.open(path)), reader(0.5, "honest")))


@forgery("questions", "are of no question of the set")
def another_set_under_this_ones_fingerprint(material, root):
    run = honest(material)
    of_twins = Source(run.header, material.runs["twins", "shown"].records)
    records = reply_with(of_twins, reader(0.5, "x")).records
    return submit(
        root, "forged", Source(run.header, [replace(it, task="nieh_gt") for it in records])
    )


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


@forgery("readable", "journal")
def a_torn_journal(material, root):
    folder = submit(root, "forged", honest(material))
    (path,) = folder.rglob("worker-*.jsonl")
    path.write_bytes(path.read_bytes().replace(b'"reply":', b'"reply":[', 1))
    return folder
