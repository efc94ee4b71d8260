"""A set of twins from a secret: the whole of it is the key, and a part can be published.

All that is drawn, the homes included, follows from the secret.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.generation.generate_set import generate_with_workers
from infthor_eval.generation.private.publishing import publish
from infthor_eval.generation.private.secrets import Secret
from infthor_eval.generation.replay_set import select
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.generation.twins.drafting import TwinSettings
from infthor_eval.generation.twins.pairing import ScoreReply
from infthor_eval.generation.twins.twin_set import make_twins
from infthor_eval.storage.files import prepare_folder
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.workers import WorkerSettings

__all__ = ["PrivateSet", "make_private_set"]

_OWNER_ALONE = 0o700
_KINDS = ("kitchen", "living-room", "bedroom")  # of homes, in turn


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
    score: ScoreReply,
    *,
    kinds: tuple[str, ...],
    n_homes: int,
    min_steps: int,
    per_trajectory: int,
    worker_settings: WorkerSettings,
    progress: Callable[[str, bool], None] = lambda _name, _resumed: None,
    say: Callable[[str], None] = lambda _: None,
) -> PrivateSet:
    """Make the key and the public part; the same secret and options make the same files.

    Args:
        secret: what all is drawn from.
        out: folder of both parts; a stopped run is continued.
        score: see `make_twins`.
        kinds: names of the kinds of edits.
        n_homes: number of homes, with a trajectory each.
        min_steps: least number of steps of each.
        per_trajectory: most pairs of questions of each.
        worker_settings: number and place of the workers.
        progress: called with the name of a stage after each home, and whether it was there.
        say: called with messages about the workers.

    Raises:
        DataError: no twins can be made, or something cannot be written.
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
        lambda resumed: progress("trajectories", resumed),
        say,
    )
    selection = select([trajectories])
    summary = make_twins(
        selection,
        embedded_launch(),
        key,
        TwinSettings(kinds, secret.seed("twins")),
        score,
        per_trajectory=per_trajectory,
        worker_settings=worker_settings,
        progress=lambda resumed: progress("twins", resumed),
        say=say,
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
