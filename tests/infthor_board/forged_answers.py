"""Submissions whose answers or scores are forged."""

import random

import msgspec
from msgspec.structs import replace

from infthor_eval.nieh.rescoring.rescore import Source
from infthor_eval.nieh.scoring import scores
from tests.infthor_board.material import edit_journal, key_of_one_world, reader, reply_with, submit

from .forging import collect_into, hard, honest, key, with_config

FORGERIES = {}
forgery = collect_into(FORGERIES)


def key_with_errors(material, root, share):
    """A submission of the key, with another answer in a share of the replies."""
    draw = random.Random(3)
    other = reader(0.0, "x")

    def reply(record):
        return other(record) if draw.random() < share else key(record)

    return submit(root, "forged", reply_with(material.runs["homes", "shown"], reply))


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
    return key_with_errors(material, root, 0.08)


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
    return key_with_errors(material, root, 0.5)


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
