"""The page on which a person decides about questions."""

import base64
import re
from pathlib import Path

import pytest

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.validation import JudgedQuestion
from infthor_eval.report.inspection import write_inspection_page
from infthor_eval.storage.folders import packaged_folder
from tests.helpers.bundled import BUNDLED


@pytest.mark.parametrize(
    ("folder", "is_packed"),
    [(packaged_folder("sets/nieh_mini_twins"), True), (Path(BUNDLED), False)],
    ids=["packed", "folder"],
)
def test_frames_of_packed_sets_are_in_the_page_and_others_are_linked(folder, is_packed, tmp_path):
    data = NiehSet(folder)
    questions = data.questions[:20]
    page = tmp_path / "page.html"
    write_inspection_page(page, [JudgedQuestion(question, {}, ()) for question in questions], data)
    shown = re.findall(r'<img src="([^"]+)"', page.read_text())
    frames = [frame for question in questions for frame in data.clue_frames(question)]
    assert len(shown) == len(frames) > 0
    for address, frame in zip(shown, frames, strict=True):
        path = tmp_path / "frame.png" if is_packed else tmp_path / address
        if is_packed:
            path.write_bytes(base64.b64decode(address.removeprefix("data:image/png;base64,")))
        assert FrameRef(path).load().tobytes() == frame.load().tobytes()
