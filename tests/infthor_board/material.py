"""Submissions, honest and forged, from runs whose replies are a function's."""

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import yaml
from msgspec.structs import replace
from PIL import Image

from infthor_eval.cli import main
from infthor_eval.cli.commands.rescore import read_source
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import Question
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.rescoring.rescore import Source
from infthor_eval.nieh.scoring import scores
from infthor_eval.nieh.suite import NiehSuite
from infthor_eval.run import Run
from infthor_eval.runs import Tokens, UnitRecord
from infthor_eval.runs.stored.writing import store_run
from tests.helpers.command_line import option_words

__all__ = [
    "Material",
    "edit_journal",
    "guesser",
    "key_of_one_world",
    "make_material",
    "reader",
    "reply_with",
    "run_model",
    "submit",
    "write_home_set",
]

Reply = Callable[[UnitRecord[NiehAnswer]], str]

_THINGS = ("tennisracket", "remotecontrol", "creditcard", "bowl", "mug", "laptop")
_PLACES = ("diningtable", "tvstand", "desk", "shelf", "bed", "sofa")
_OWN_WORDS = {
    "tennisracket": "tennis racket",
    "remotecontrol": "remote control",
    "creditcard": "credit card",
    "diningtable": "dining table",
    "tvstand": "TV stand",
}
_HOMES = ("kitchen-1-a", "kitchen-2-a", "kitchen-3-a", "bedroom-1-a", "bedroom-2-a", "bedroom-3-a")


def write_home_set(root: Path) -> Path:
    """Write a set of questions on six homes, ten each; frames are colours."""
    draw = random.Random(1)
    questions = []
    for number, home in enumerate(_HOMES):
        images = root / "metadata" / home / "img"
        images.mkdir(parents=True)
        steps = []
        for index in range(6):
            name = f"{index:09d}.png"
            Image.new("RGB", (160, 160), (40 * index, 40 * number, 90)).save(images / name)
            steps.append({"img_idx": index, "img_filename": name, "step": index, "object_log": {}})
        (images.parent / "metadata.json").write_bytes(msgspec.json.encode(steps))
        asked = {
            "What was on the dining table?": _THINGS,
            "What was on the TV stand?": _THINGS,
            "What did you put in the drawer?": _THINGS,
            "Where was the tennis racket?": _PLACES,
            "Where was the remote control?": _PLACES,
            "Where was the credit card?": _PLACES,
            "Is there a mug?": ("yes", "no"),
            "Was the laptop open?": ("yes", "no"),
        }
        for at, (text, answers) in enumerate(asked.items()):
            questions.append(Question(home, text, (at % 6,), (draw.choice(answers),), "presence"))
        for text in ("What did you put on the desk?", "What did you put on the bed?"):
            questions.append(Question(home, text, (2, 4), tuple(draw.sample(_THINGS, 2)), "put"))
    write_questions(root / "qa_set_homes.csv", questions)
    return root


@dataclass(frozen=True)
class Material:
    """What submissions are made of.

    Attributes:
        homes: set of single questions.
        twins: set of twins.
        runs: runs of the baseline `random` by task and frame ablation; the replies are replaced.
    """

    homes: Path
    twins: Path
    runs: dict[tuple[str, str], Source]


def run_model(output: Path, **options: object) -> list[Path]:
    """Run a model; returns the folders of its runs."""
    code = None
    try:
        main([str(word) for word in option_words(out=output, **options)])
    except SystemExit as ended:
        code = ended.code
    assert code == 0
    return sorted(path.parent for path in output.rglob("journal"))


def make_material(folder: Path, homes: Path, twins: Path) -> Material:
    """Run the baseline on both sets, with their own frames and with blank ones."""
    asked = [
        ("homes", {"tasks": "nieh_gt", "data": homes}),
        ("twins", {"tasks": "nieh_twins", "data": twins}),
        ("whole", {"tasks": "nieh_full", "data": homes}),
    ]
    runs = {}
    for name, options in asked:
        for path in run_model(folder / name, model="random", frames="shown,blank", **options):
            source = read_source(Run.open(path))
            runs[name, source.header.config.frames or "shown"] = source
    return Material(homes, twins, runs)


def reader(skill: float, seed: str) -> Reply:
    """A model that is right about so many questions, in its own words, and both of so many
    pairs."""

    def reply(record: UnitRecord[NiehAnswer]) -> str:
        payload = record.payload
        twin = payload.twin
        asked = record.id if twin is None else twin.pair
        draw = random.Random(f"{seed} {asked}")
        if draw.random() < skill:
            return _in_own_words(payload.answers)
        if twin is not None:
            return _in_own_words(draw.choice(sorted([payload.answers, twin.answers])))
        wrong = [it for it in _THINGS + _PLACES if it not in payload.answers]
        return _in_own_words([draw.choice(wrong)]) + draw.choice(
            ("", " there", " maybe", " I think")
        )

    return reply


def guesser(record: UnitRecord[NiehAnswer]) -> str:
    """A model that always says the same."""
    return "no" if record.payload.answers[0] in ("yes", "no") else "mug"


def key_of_one_world(record: UnitRecord[NiehAnswer]) -> str:
    """The answers of the first world of each pair, in both."""
    twin = record.payload.twin
    assert twin is not None
    return str((record.payload.answers if twin.traj_id.endswith("-a") else twin.answers)[0])


def _in_own_words(answers: Sequence[Any]) -> str:
    words = [_OWN_WORDS.get(str(answer), str(answer)) for answer in answers]
    return " and ".join(words).capitalize()


def reply_with(
    source: Source, reply: Reply, model: str = "lab/model", repetition: str = ""
) -> Source:
    """A run with the replies of a function, scored, by a model of this name; another repetition
    takes other times."""
    draw = random.Random(f"{model} {repetition}")
    records = []
    for record in source.records:
        said = reply(record)
        payload = record.payload.with_reply(said, scores(said, record.payload.answers))
        records.append(
            replace(
                record,
                payload=payload,
                seconds=round(draw.uniform(0.1, 2), 4),
                tokens=Tokens(context=draw.randint(300, 500), reply=draw.randint(1, 9)),
            )
        )
    identity = {"name": model.rpartition("/")[2], "checkpoint": model, "revision": "abcdef123456"}
    config = replace(source.header.config, model=identity)
    return Source(replace(source.header, name=identity["name"], config=config), records)


def submit(root: Path, name: str, *runs: Source | Path, **statement: object) -> Path:
    """Write a submission of runs, or of files; returns its folder. `None` leaves a field out."""
    folder = root / name
    folder.mkdir(parents=True)
    for run in runs:
        if isinstance(run, Path):
            target = folder / run.name
            target.write_bytes(run.read_bytes())
        else:
            store_run(folder, run.header, NiehSuite(), lambda _, run=run: run.records, 0)
    first = next((run for run in runs if isinstance(run, Source)), None)
    model = first.header.config.model.get("checkpoint") if first else "lab/model"
    content = {
        "model": model,
        "revision": "abcdef123456",
        "submitted_by": "a lab",
        "contact": "lab@example.org",
        "date": "2026-06-01",
    } | statement
    content = {field: value for field, value in content.items() if value is not None}
    (folder / "submission.yaml").write_text(yaml.safe_dump(content))
    return folder


def edit_journal(folder: Path, edit: Callable[[list[dict[str, Any]]], None]) -> Path:
    """Edit the lines of a submission's one journal in place, the header first."""
    (path,) = folder.rglob("worker-*.jsonl")
    lines = [msgspec.json.decode(line) for line in path.read_bytes().splitlines()]
    edit(lines)
    path.write_bytes(b"".join(msgspec.json.encode(line) + b"\n" for line in lines))
    return folder
