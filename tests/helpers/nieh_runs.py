"""Records and headers of runs that nobody ran."""

from typing import Any

import msgspec

from infthor_eval.formats.question import Question
from infthor_eval.nieh.config import NiehConfig
from infthor_eval.nieh.records import NiehAnswer, ShownClues, TwinSide
from infthor_eval.nieh.results.summary import summarise
from infthor_eval.nieh.scoring import SCORERS, scores
from infthor_eval.runs import RunHeader, RunSummary, Tokens, UnitRecord

_PAYLOAD = ("question", "question_type", "file", "blind", "shown_clues", "twin", "recall")


def make_record(
    number: int,
    reply: str | None,
    answers: tuple[str, ...] = ("mug",),
    n_clues: int = 1,
    n_reply_tokens: int | None = None,
    **changes: Any,
) -> UnitRecord[NiehAnswer]:
    """The record of question `q<number>`, scored as a run scores it; one of four trajectories."""
    about = {"question": "?", "question_type": "put_action"}
    about |= {name: changes.pop(name) for name in _PAYLOAD if name in changes}
    own_scores = {} if reply is None else scores(reply, answers)
    given_scores = changes.pop("scores", own_scores)
    column = Question(
        "t", "?", tuple(range(max(1, n_clues))), answers, absence=n_clues == 0
    ).clue_column
    payload = NiehAnswer(
        **about,
        n_clues=n_clues,
        clue_column=column,
        answers=answers,
        reply=reply,
        scores=given_scores,
    )
    fields = {
        "task": "nieh_gt",
        "id": f"q{number}",
        "cluster": f"t{number % 4}",
        "fingerprint": "f",
        "payload": payload,
        "tokens": Tokens(reply=n_reply_tokens),
        "failure": "no reply" if reply is None else None,
    }
    return UnitRecord(**{**fields, **changes})


def make_twins(
    number: int,
    replies: tuple[str | None, str | None],
    base: str,
    n_after: int | None = None,
    n_frames: int = 1,
) -> list[UnitRecord[NiehAnswer]]:
    """Both records of a pair: the mug is in the bowl in one world, and on the sofa in the other."""
    worlds = (("one", "bowl", "sofa"), ("two", "sofa", "bowl"))
    records = []
    for (world, answer, other), reply in zip(worlds, replies, strict=True):
        twin = TwinSide(
            pair=f"p/{number}",
            fact="mug",
            kind="swap",
            traj_id=f"{base}-{world}",
            answers=(other,),
            n_frames=n_frames,
            n_differing=1,
            n_after_clues=n_frames - 1,
        )
        clues = ShownClues(n_shown=1, n_clues=1, n_after=n_after)
        about = {"id": f"{base}-{world}/{number}", "cluster": base, "twin": twin}
        records.append(make_record(number, reply, (answer,), shown_clues=clues, **about))
    return records


def make_config(
    model: str = "qwen2.5-vl",
    checkpoint: str | None = "Qwen/Qwen2.5-VL-7B-Instruct",
    n_parameters: int | None = 8_292_166_656,
    simulator: str | None = None,
    skipped: tuple[str, ...] = (),
    context: str = "clues",
    metrics: tuple[str, ...] = SCORERS,
    frames: str = "shown",
    **settings: float,
) -> dict[str, Any]:
    """What identifies a run of `nieh_gt`, as in its header; `skipped` are the reasons, `settings`
    those of the context."""
    about = {
        "config": {"dataset_kwargs": {"context": context, **settings}},
        "decoding": {"max_new_tokens": 50},
        "metrics": {"names": list(metrics)},
        "data": "d",
        "simulator": simulator,
        "n_samples": 0,
        "skipped": [
            {"question_id": f"x{i}", "variant": "", "reason": reason}
            for i, reason in enumerate(skipped)
        ],
    }
    named = {"name": model, "checkpoint": checkpoint, "n_parameters": n_parameters}
    model_identity = {key: value for key, value in named.items() if value is not None}
    return {"model": model_identity, "tasks": {"nieh_gt": about}, "frames": frames}


def make_header(config: dict[str, Any], name: str = "a run") -> RunHeader[NiehConfig]:
    """The header of a run of a config as JSON values."""
    return RunHeader(suite="nieh", name=name, config=msgspec.convert(config, NiehConfig))


def make_run(
    config: dict[str, Any], records: list[UnitRecord[NiehAnswer]], name: str = "a run"
) -> RunSummary:
    """The run with these records, summed up."""
    header = make_header(config, name)
    return RunSummary(header, summarise(header.config, records))
