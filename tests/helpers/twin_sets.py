"""Small sets of twins: worlds of two trajectories, of which some frames differ."""

from collections.abc import Iterable
from pathlib import Path

import msgspec
from PIL import Image

from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import Question
from infthor_eval.formats.shared_frames import store_picture, write_frame_names
from infthor_eval.formats.twins import ComparedFrame, TwinPair, write_pairs

__all__ = ["CLUES", "DIFFERING", "STILL", "write_twin_set"]

DIFFERING = (2, 5)
CLUES = (2, 3, 4)
STILL = (3, 4)  # frames of different steps with the same picture
_N_FRAMES = 8
_ASKED = (
    ("Where is the mug?", ("bowl", "sofa")),
    ("Is the mug in the bowl?", ("yes", "no")),
)


def write_twin_set(root: Path, bases: Iterable[int] = (1, 2)) -> Path:
    """Write a set of a pair of worlds of each base, two by default, with two pairs of questions
    each; frames are colours.

    The mug of the first world is the cup of the second, in what differs and in the logged actions.
    """
    pairs = []
    questions = []
    for base in bases:
        worlds = (f"kitchen-{base}-a", f"kitchen-{base}-b")
        for shade, (world, thing) in enumerate(zip(worlds, ("Mug", "Cup"), strict=True)):
            _write_world(root, world, thing, (60 * base % 256, 200 * shade))
        for number, (text, answers) in enumerate(_ASKED, 1):
            for world, answer in zip(worlds, answers, strict=True):
                named = {"pair": f"swap-{base}/{number}", "fact": f"swap-{base}/mug"}
                questions.append(Question(world, text, CLUES, (answer,), "location", **named))
        pairs.append(_pair(f"swap-{base}", worlds))
    write_questions(root / "qa_set_twins.csv", questions)
    write_pairs(root, pairs)
    return root


def _write_world(root: Path, world: str, thing: str, shades: tuple[int, int]) -> None:
    folder = root / "metadata" / world
    folder.mkdir(parents=True)
    names = []
    steps = []
    for index in range(_N_FRAMES):
        red = 30 * (STILL[0] if index in STILL else index)
        green = shades[1] if index in DIFFERING else 90
        picture = root / "picture.png"
        Image.new("RGB", (160, 160), (red, green, shades[0])).save(picture)
        names.append(store_picture(root, picture.read_bytes(), "test"))
        picture.unlink()
        step = {"img_idx": index, "img_filename": f"{index}.png", "step": index, "object_log": {}}
        steps.append({**step, "action": f"Pass {thing}"})
    write_frame_names(folder, names)
    (folder / "metadata.json").write_bytes(msgspec.json.encode(steps))


def _pair(name: str, worlds: tuple[str, str]) -> TwinPair:
    frames = tuple(
        ComparedFrame(False, ("Mug|1",)) if index in DIFFERING else ComparedFrame(True)
        for index in range(_N_FRAMES)
    )
    return TwinPair(
        id=name,
        kind="swap",
        seed=0,
        base=f"base of {name}",
        traj_ids=worlds,
        floor_plan="kitchen-1",
        ids={"Mug|1": "Cup|1"},
        changed=("Mug|1",),
        displaced=(),
        types=("Mug", "Cup"),
        frames=frames,
        questions=(),
    )
