"""Sets of twins from a secret: the whole of one is the key, and a part of it can be published.

All that is drawn, the homes included, follows from the secret. The public part has frames, and
questions without answers; its names and its order are drawn from the secret, too, and nothing else
that the simulator logged is in it.
"""

import hmac
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import msgspec

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import WITHHELD, Question
from infthor_eval.formats.reading import read_text
from infthor_eval.formats.replies.answer_key import write_key
from infthor_eval.formats.set_info import claim_for_simulator, frames_of
from infthor_eval.formats.shared_frames import store_picture, write_frame_names
from infthor_eval.generation.generate_set import generate_with_workers
from infthor_eval.generation.replay_set import select
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.generation.twins.drafting import TwinSettings, draft_twins
from infthor_eval.generation.twins.twin_set import make_twins
from infthor_eval.nieh.scoring import score
from infthor_eval.storage.files import prepare_folder
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.workers import WorkerSettings

_HEX = re.compile(r"[0-9a-fA-F]{32,256}")
_SEED_BITS = 62
_HINT = "write one with `openssl rand -hex 32 > FILE`, and keep it secret"
_OWNER_ALONE = 0o700
_KINDS = ("kitchen", "living-room", "bedroom")  # of homes, in turn
_DIGITS = 16  # of public names
_TIME = 946_684_800  # of all public files: 1 January 2000, in seconds since 1970
_QUESTIONS = "qa_set_private.csv"


@dataclass(frozen=True)
class Secret:
    """What all of a private set is drawn from."""

    _content: bytes

    def __repr__(self) -> str:
        return "Secret(...)"  # never in a traceback or a log

    def digest(self, what: str) -> str:
        """Return a digest that needs the secret (hex, 64 characters)."""
        return hmac.new(self._content, what.encode(), "sha256").hexdigest()

    def seed(self, what: str) -> int:
        """Return a seed for a purpose, from 0 to 2^62 - 1."""
        return int(self.digest(what), 16) >> (256 - _SEED_BITS)


def read_secret(path: Path) -> Secret:
    """Read a seed file: 32 to 256 hexadecimal digits in one line."""
    text = read_text(path, _HINT).strip()
    if not _HEX.fullmatch(text):
        raise DataError(
            f"{path}: not a secret of 32 to 256 hexadecimal digits in one line; {_HINT}"
        )
    return Secret(text.lower().encode())


@dataclass(frozen=True)
class PrivateSet:
    """A private set that was made.

    Attributes:
        key: folder of the whole set, which stays secret.
        public: folder of the part that can be published.
        n_pairs: number of pairs of questions.
        n_trajectories: number of trajectories.
        failures: homes that no twins could be made of, one line each.
    """

    key: Path
    public: Path
    n_pairs: int
    n_trajectories: int
    failures: Sequence[str]


def make_private_set(
    secret: Secret,
    out: Path,
    *,
    kinds: tuple[str, ...],
    n_homes: int,
    min_steps: int,
    per_trajectory: int,
    worker_settings: WorkerSettings,
    advance: Callable[[str, bool], None] = lambda _name, _resumed: None,
    notify: Callable[[str], None] = lambda _: None,
) -> PrivateSet:
    """Make the key and the public part; the same secret and options make the same files.

    Args:
        secret: what all is drawn from.
        out: folder of both parts; a stopped run is continued.
        kinds: names of the kinds of edits.
        n_homes: number of homes, with a trajectory each.
        min_steps: least number of steps of each.
        per_trajectory: most pairs of questions of each.
        worker_settings: number and place of the workers.
        advance: called with the name of a stage after each home, and whether it was there.
        notify: called with messages about the workers.
    """
    key = prepare_folder(out / "key")
    key.chmod(_OWNER_ALONE)
    trajectories = prepare_folder(key / "trajectories")
    jobs = [_home(secret, number, min_steps) for number in range(n_homes)]
    generated = generate_with_workers(
        jobs,
        embedded_launch(),
        trajectories,
        worker_settings,
        lambda resumed: advance("trajectories", resumed),
        notify,
    )
    selection = select([trajectories])
    summary = make_twins(
        selection,
        embedded_launch(),
        key,
        TwinSettings(kinds, secret.seed("twins")),
        partial(draft_twins, score=partial(score, scorer="strict")),
        per_trajectory=per_trajectory,
        worker_settings=worker_settings,
        advance=lambda resumed: advance("twins", resumed),
        notify=notify,
    )
    failures = [*generated.failures, *summary.failures]
    if not summary.pairs:
        reasons = "; ".join(failures[:3]) or "no edit passes the checks"
        raise DataError(f"{key}: no pair of questions ({reasons}); give more --homes")
    data = NiehSet(key)
    public = publish(data, secret, out / "public")
    n_trajectories = len({question.traj_id for question in data.questions})
    return PrivateSet(key, public, summary.pairs, n_trajectories, failures)


def _home(secret: Secret, number: int, min_steps: int) -> TrajectorySettings:
    scene = f"{_KINDS[number % len(_KINDS)]}-{secret.seed(f'home {number}')}"
    return TrajectorySettings(scene, secret.seed(f"trajectory {number}"), min_steps, 1, False)


def publish(data: NiehSet, secret: Secret, public: Path) -> Path:
    """Write the public part of a set of twins, and the key beside the set; return the folder.

    The public part has of each trajectory the frames alone, and of each question its words, type
    and clues, which are the same in both worlds. Pairs are not named.
    """
    if public.exists() and any(public.iterdir()):
        raise DataError(f"{public}: is there already; move it away, or give another --out")
    prepare_folder(public)
    claim_for_simulator(public, data.simulator or "embedded", frames_of(data.directory))
    by_name = {
        traj_id: f"t{secret.digest(f'name {traj_id}')[:_DIGITS]}"
        for traj_id in {question.traj_id for question in data.questions}
    }
    # In the order of the public names: not even the order in which files were made tells.
    for traj_id, name in sorted(by_name.items(), key=lambda item: item[1]):
        _publish_frames(data, traj_id, public, name)
    questions = {
        question: _without_answers(question, by_name[question.traj_id])
        for question in data.questions
    }
    ids = _ids(questions)
    order = sorted(questions.values(), key=lambda question: secret.digest(f"order {question.id}"))
    write_questions(public / _QUESTIONS, order)
    _hide_times(public)
    write_key(data.directory, NiehSet(public), ids)
    return public


def _ids(questions: Mapping[Question, Question]) -> dict[str, str]:
    ids = {public.id: question.id for question, public in questions.items()}
    if len(ids) < len(questions):
        raise DataError("two questions are the same but for their answers; make the twins again")
    return ids


def _without_answers(question: Question, name: str) -> Question:
    return Question(
        name,
        question.text,
        tuple(sorted(question.clues)),
        (WITHHELD,),
        question.question_type,
        moment=question.moment,
    )


def _publish_frames(data: NiehSet, traj_id: str, public: Path, name: str) -> None:
    folder = public / "metadata" / name
    folder.mkdir(parents=True)
    names = []
    steps = []
    for index, frame in enumerate(data.frames(traj_id)):
        names.append(store_picture(public, frame.path.read_bytes(), "private-set"))
        steps.append({"img_idx": index, "img_filename": f"{index:09d}.png", "step": index})
    write_frame_names(folder, names)
    logged = [{**step, "object_log": {}} for step in steps]
    (folder / "metadata.json").write_bytes(msgspec.json.encode(logged) + b"\n")


def _hide_times(public: Path) -> None:
    """Give all files one time, so that no order shows in which worlds were made."""
    for path in sorted(public.rglob("*"), reverse=True):
        os.utime(path, (_TIME, _TIME))
    os.utime(public, (_TIME, _TIME))
