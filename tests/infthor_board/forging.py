"""What submissions are forged from, and by which check they are to be refused."""

from msgspec.structs import replace

from infthor_eval.nieh.rescoring.rescore import Source
from tests.infthor_board.material import reader, reply_with


def collect_into(forgeries):
    """A decorator, by check and words of its reason, of functions that write a forged submission
    which that check is to refuse; it keeps them by their names."""

    def forgery(check, words):
        def register(make):
            forgeries[make.__name__] = (make, check, words)
            return make

        return register

    return forgery


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
