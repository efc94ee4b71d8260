"""A small set of twins in homes of given floor plans, written by hand."""

import json
from pathlib import Path

from PIL import Image

from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import Question
from infthor_eval.formats.shared_frames import store_picture, write_frame_names
from infthor_eval.formats.twins import ComparedFrame, PairedQuestion, TwinPair, write_pairs

__all__ = ["N_FRAMES", "write_twin_homes"]

N_FRAMES = 8
CLUES = (2, 5)  # of both worlds together
_ANSWERS = (("Bowl",), ("Sofa",))
# Steps 0 and 1 show the same picture, as steps do in which nothing is seen to change.
_SHARED = (0, 0, 1, None, 2, None, 3, 4)  # None: another picture in each world


def write_twin_homes(root: Path, floor_plans: tuple[str, ...], size: int = 8) -> Path:
    """Write a set with a pair of worlds in each floor plan, and return its folder.

    Worlds are named "<number of the pair>-one" and "-two". Each pair has one question in both
    worlds; the clues are frames 2 and 5, and the worlds differ in frames 3 and 5.
    """
    questions = []
    pairs = []
    for number, floor_plan in enumerate(floor_plans):
        names = f"{number}-one", f"{number}-two"
        for world, name in enumerate(names):
            _write_world(root, name, number, world, floor_plan, size)
            questions.append(
                Question(
                    name,
                    "Where is the mug now?",
                    CLUES,
                    _ANSWERS[world],
                    pair=f"p{number}/1",
                    fact=f"p{number}/mug",
                )
            )
        pairs.append(_pair(number, names, floor_plan))
    write_questions(root / "qa_set_twins.csv", questions)
    write_pairs(root, pairs)
    return root


def _write_world(
    root: Path, name: str, number: int, world: int, floor_plan: str, size: int
) -> None:
    folder = root / "metadata" / name
    folder.mkdir(parents=True)
    pictures = []
    for index, shared in enumerate(_SHARED):
        own = (20 * index, 100 + 50 * world)
        shade = (60 * number, *(own if shared is None else (30 * shared, 0)))
        file = root / "drawn.png"
        Image.new("RGB", (size, size), shade).save(file)
        pictures.append(store_picture(root, file.read_bytes(), "test"))
        file.unlink()
    write_frame_names(folder, pictures)
    entries = [
        {"img_idx": index, "img_filename": f"{index:09d}.png", "step": index, "object_log": {}}
        for index in range(N_FRAMES)
    ]
    (folder / "metadata.json").write_text(json.dumps(entries))
    (folder / "traj_data.json").write_text(
        json.dumps({"plan": {"low_actions": []}, "scene": {"floor_plan": floor_plan}})
    )


def _pair(number: int, names: tuple[str, str], floor_plan: str) -> TwinPair:
    question = PairedQuestion(
        text="Where is the mug now?",
        form="Where is the {} now?",
        question_type="location",
        fact="mug",
        answers=_ANSWERS,
        clues=CLUES,
        own_clues=((2,), (5,)),
        absence=(False, False),
        overlap=(0.0, 0.0),
    )
    return TwinPair(
        id=f"p{number}",
        kind="move",
        seed=0,
        base=f"base{number}",
        traj_ids=names,
        floor_plan=floor_plan,
        ids={},
        changed=("Mug|1",),
        displaced=(),
        types=("Mug",),
        frames=tuple(ComparedFrame(shared is not None) for shared in _SHARED),
        questions=(question,),
    )
