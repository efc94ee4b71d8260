"""`infthor-eval init-set`: an example of a data set of one's own, to be replaced by one's own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from infthor_eval.cli.help import example_command
from infthor_eval.cli.options.values import PATH
from infthor_eval.errors import DataError, UsageError, wrap_errors

if TYPE_CHECKING:
    from PIL import Image

_COLOURS = (
    "red", "green", "blue", "yellow", "orange", "purple",
    "white", "black", "brown", "pink", "grey", "cyan",
)  # fmt: skip
_SIDE = 112  # of the pictures, pixels
_QUESTIONS = """\
trajectory,question,answer,clue_frames,clue_seconds,moment,moment_seconds,pair
walk,Which colour was shown at second 3?,yellow,,3,,,
walk,Which colours were shown from second 1 to 2?,green | blue,,1-2,,,
walk,Which colour was shown last?,orange,,4,,4,last colour
walk,Which colour was shown last?,brown,,8.2,,8.2,last colour
walk,Which colour was shown first?,red,0,,,,
kitchen,Which colours do pictures 1 and 2 have?,"[""red"", ""green""]","1, 2.png",,,,
kitchen,How many pictures were shown?,3,,,3,,
"""
_README = """\
A set of questions with the columns that there are. Run it:

    infthor-eval --model oracle --tasks nieh_gt --data {folder}

walk.mp4      a film; 1 frame a second of it is shown
kitchen/      frames in the order of their names
questions.csv the questions: `trajectory` is walk or kitchen

Put your own films and folders in their place. Clues are frames (clue_frames) or, of a film, seconds
(clue_seconds); moment and moment_seconds say after which frame or second a question is asked. Of
several answers (green | blue) all are required. Both questions of a pair have its name.
"""


@example_command("init-set", "infthor-eval init-set my_set")
@click.argument("folder", metavar="DIR", type=PATH)
def command(folder: Path) -> None:
    """Write a film, a folder of frames and questions on them into DIR, which is new or empty.

    It is a set for --data that runs as it is, to be replaced by your own.
    """
    import shlex

    from infthor_eval.storage.files import prepare_folder, writing_hint
    from infthor_eval.terminal import print_line

    with wrap_errors(f"{folder}: cannot be written", writing_hint(", or give another folder")):
        if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
            raise UsageError(f"{folder}: is no empty folder; give a new one")
        prepare_folder(folder / "kitchen", "DIR")
        _write_film(folder / "walk.mp4")
        for number, colour in enumerate(_COLOURS[:4], 1):
            _picture(colour).save(folder / f"kitchen/{number}.png")
        (folder / "questions.csv").write_text(_QUESTIONS, encoding="utf-8")
        typed = shlex.quote(str(folder))
        (folder / "README.txt").write_text(_README.format(folder=typed), encoding="utf-8")
    print_line(f"infthor-eval --model oracle --tasks nieh_gt --data {typed}")


def _write_film(path: Path) -> None:
    """Write a film that shows each colour for a second."""
    import cv2
    import numpy as np

    size = (_SIDE, _SIDE)
    film = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 1.0, size)
    for colour in _COLOURS:
        film.write(np.asarray(_picture(colour))[:, :, ::-1])
    film.release()
    if not path.is_file():
        raise DataError(f"{path}: OpenCV cannot write MP4 here; install opencv-python again")


def _picture(colour: str) -> Image.Image:
    from PIL import Image, ImageDraw

    image = Image.new("RGB", (_SIDE, _SIDE), colour)
    ImageDraw.Draw(image).text((4, 4), colour, fill="white" if colour == "black" else "black")
    return image
