"""Files that are none, or do not hold what they should: every reader refuses them in one line."""

import gzip
import io
import json
import lzma
import os
import struct
import tarfile
import zlib
from pathlib import Path

import pytest
from PIL import Image

from infthor_eval.formats.archive import unpack_tar
from infthor_eval.formats.floor_plans import floor_plan_names
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.pictures.video import read_video
from infthor_eval.formats.qa_csv import read_questions
from infthor_eval.formats.set_info import simulator_of
from infthor_eval.formats.step_log import read_steps
from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.generation.bundle import read_manifest
from infthor_eval.nieh.records import RECORDS
from infthor_eval.nieh.validation import read_decisions
from infthor_eval.runs import Catalog, read_run
from model_adapters import load

from ..helpers.refusals import assert_raises_one_line

# Readers by what they read: the file's place in a folder, and the reading of the folder.
READERS = {
    "questions": ("qa_set.csv", lambda root: read_questions(root / "qa_set.csv")),
    "decisions": ("inspection.csv", lambda root: read_decisions(root / "inspection.csv")),
    "step log": ("metadata.json", read_steps),
    "set.json": ("set.json", simulator_of),
    "trajectory": ("a.json", lambda root: list(iter_trajectories(root / "a.json"))),
    "trajectories": ("a.jsonl", lambda root: list(iter_trajectories(root / "a.jsonl"))),
    "packed trajectories": (
        "a.jsonl.gz",
        lambda root: list(iter_trajectories(root / "a.jsonl.gz")),
    ),
    "floor plans": ("thor_scenes/objects.jsonl.gz", floor_plan_names),
    "manifest": ("manifest.json", lambda root: read_manifest(root / "manifest.json")),
    "task": ("a.yaml", lambda root: Catalog(root).tasks),
    "journal": ("journal/worker-0.jsonl", lambda root: read_run(root, RECORDS)),
    "digest of a frame": ("a.png", lambda root: FrameRef(root / "a.png").digest),
    "pixels of a frame": ("a.png", lambda root: FrameRef(root / "a.png").load()),
    "video": ("a.mp4", lambda root: read_video(root / "a.mp4", 1)),
    "archive": ("a.tar", lambda root: unpack_tar(root / "a.tar", root / "metadata")),
    "checkpoint": ("config.json", lambda root: load("qwen2.5-vl", {"pretrained": str(root)}, 0)),
}


@pytest.fixture
def place(tmp_path):
    """Makes the folder of a reader's file."""

    def place(reader):
        path = tmp_path / READERS[reader][0]
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    return place


@pytest.mark.parametrize("make", [os.mkfifo, lambda path: path.symlink_to("/dev/null")])
@pytest.mark.parametrize("reader", READERS)
def test_a_pipe_and_a_device_are_no_files(place, tmp_path, reader, make):
    make(place(reader))
    assert_raises_one_line(
        lambda: READERS[reader][1](tmp_path), "is a pipe or a device, not a file"
    )


@pytest.mark.parametrize(
    "reader",
    sorted(READERS.keys() - {"checkpoint", "trajectory", "trajectories", "packed trajectories"}),
)
def test_a_folder_is_no_file(place, tmp_path, reader):
    place(reader).mkdir()
    assert_raises_one_line(lambda: READERS[reader][1](tmp_path), "is a folder, not a file")


DEEP = b"[" * 200_000
NO_DEFLATE = b"\x1f\x8b\x08\0\0\0\0\0\0\3" + b"\xff" * 600
ONE_ROW = "traj_id,question,gt_img_idx,answer"


def _bomb() -> bytes:
    packed = io.BytesIO()
    with gzip.GzipFile(fileobj=packed, mode="wb") as file:
        for _ in range(6):
            file.write(b" " * 2**20)
    return packed.getvalue()


UNMATCHED = "an entry that no reply can match"
# By what follows the names of the four columns.
QUESTIONS = {
    ",note\nt,q,[1],['a'],\"open\nt,q,[2],['b'],x\n": "not a UTF-8 CSV file",
    ",note\nt,q,[1],['a'],\"open\nt,q,[2],['b'],closed\"\n": "note has several lines",
    ",answer\nt,q,[1],['a'],['b']\n": "column 'answer' is there twice",
    "\nt,q,[1],['a'],more\n": "has 5 cells for 4 columns",
    "\nt,q,[1],['']\n": UNMATCHED,
    "\nt,q,[1],[' ']\n": UNMATCHED,
    "\nt,q,[1],[1e999]\n": UNMATCHED,
    f"\nt,q,[1],[{10**30}]\n": UNMATCHED,
    "\nt,q,[1],['\\ud800']\n": UNMATCHED,
    "\nt,\"q\"x,[1],['a']\n": "not a UTF-8 CSV file",
}
ONE_SCENE = b'"trajectories": [{"scene": "a", "seed": 0, "min_steps": 1}]}'
CONTENTS = [
    *(("questions", (ONE_ROW + rest).encode(), reason) for rest, reason in QUESTIONS.items()),
    ("step log", DEEP, "not valid JSON"),
    ("set.json", DEEP, "not valid JSON"),
    ("trajectory", DEEP, "not a trajectory"),
    ("trajectories", DEEP + b"\n", "not a trajectory"),
    ("manifest", DEEP, "not in its documented form"),
    ("journal", DEEP + b"\n", "not the first line of a journal"),
    ("floor plans", gzip.compress(DEEP), "not JSON"),
    ("task", DEEP, "not YAML"),
    ("step log", b'"\xff"', "not valid JSON"),
    ("set.json", b"\xff\xfe", "not valid JSON"),
    ("task", b"task: \xff", "not UTF-8 text"),
    ("decisions", b"\xff\xfe", "not UTF-8 text"),
    ("set.json", b'{"simulator": ["embedded"]}', "not a name"),
    ("packed trajectories", gzip.compress(b"\n" * 500_000)[:40], "cannot be read after line"),
    ("packed trajectories", b"no gzip", "cannot be read after line 0"),
    ("packed trajectories", NO_DEFLATE, "cannot be read after line"),
    ("floor plans", gzip.compress(b'{"scene": "x"}\n' * 5000)[:60], "cannot be read after line"),
    ("floor plans", NO_DEFLATE, "cannot be read after line"),
    ("floor plans", gzip.compress(b"5\n"), "not a JSON object"),
    ("floor plans", gzip.compress(b'{"scene": 5}\n'), "no scene name"),
    ("archive", lzma.compress(b"x" * 100_000)[:80], "damaged archive"),
    ("archive", gzip.compress(os.urandom(9000))[:-600], "damaged archive"),
    ("archive", gzip.compress(os.urandom(9000))[:4000] + b"\x55" * 4000, "damaged archive"),
    ("archive", NO_DEFLATE, "damaged archive"),
    ("decisions", b"question_id,decision\na,keep\na,drop\n", "has another decision above"),
    ("decisions", b"question_id,decision,decision\na,keep,drop\n", "is there twice"),
    ("decisions", b"question_id,decision\na,keep,drop\n", "has 3 cells for 2 columns"),
    ("decisions", b'question_id,decision\n"a,keep\n', "not a UTF-8 CSV file"),
    ("manifest", b'{"name": "../x", ' + ONE_SCENE, "documented form"),
    ("manifest", b'{"name": "x", "trajectories": []}', "documented form"),
    ("manifest", b'{"name": "x", "colors": 0, ' + ONE_SCENE, "documented form"),
]


@pytest.mark.parametrize(
    ("reader", "content", "expected"), CONTENTS, ids=[f"{r}: {s}" for r, _, s in CONTENTS]
)
def test_content_that_is_not_what_it_should_be(place, tmp_path, reader, content, expected):
    place(reader).write_bytes(content)
    assert_raises_one_line(lambda: READERS[reader][1](tmp_path), expected)


@pytest.mark.parametrize("reader", ["packed trajectories", "floor plans"])
def test_what_unpacks_to_more_than_the_limit_is_refused_and_the_limit_is_named(
    place, tmp_path, monkeypatch, reader
):
    place(reader).write_bytes(_bomb())
    monkeypatch.setenv("INFTHOR_EVAL_MAX_LINE_MB", "2")
    assert_raises_one_line(
        lambda: READERS[reader][1](tmp_path), "set INFTHOR_EVAL_MAX_LINE_MB to more than 2"
    )


def test_a_large_file_is_read_where_the_limit_is_raised(place, tmp_path, monkeypatch):
    place("step log").write_bytes(b"[" + b" " * 2**20 + b"]")
    monkeypatch.setenv("INFTHOR_EVAL_MAX_FILE_MB", "1")
    assert_raises_one_line(
        lambda: read_steps(tmp_path), "set INFTHOR_EVAL_MAX_FILE_MB to more than 1"
    )
    monkeypatch.setenv("INFTHOR_EVAL_MAX_FILE_MB", "2")
    assert read_steps(tmp_path) == []
    monkeypatch.setenv("INFTHOR_EVAL_MAX_FILE_MB", "much")
    assert_raises_one_line(lambda: read_steps(tmp_path), "not a whole number above 0")


def _png(width: int, height: int, body: bytes = b"") -> bytes:
    def chunk(name: bytes, content: bytes) -> bytes:
        return (
            struct.pack(">I", len(content))
            + name
            + content
            + struct.pack(">I", zlib.crc32(name + content))
        )

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", body) + chunk(b"IEND", b"")


def _cut(path: Path) -> None:
    Image.new("RGB", (64, 64)).save(path)
    path.write_bytes(path.read_bytes()[:60])


IMAGES = {
    "bomb": (
        _png(30_000, 30_000),
        "is too large; if this is intended, set INFTHOR_EVAL_MAX_IMAGE_MEGAPIXELS",
    ),
    "larger than Pillow warns of": (_png(10_000, 10_000), "is too large"),
    "sliver": (
        _png(60_000, 1),
        "is too narrow; if this is intended, set INFTHOR_EVAL_MAX_IMAGE_ASPECT",
    ),
    "upright sliver": (_png(2, 700), "is too narrow"),
    "no width": (_png(0, 7), "not a readable image"),
    "header cut": (_png(8, 8)[:20], "not a readable image"),
    "no pixels": (_png(8, 8), "not a readable image"),
    "damaged pixels": (_png(8, 8, zlib.compress(b"\0" * 300)[:-9]), "not a readable image"),
    "another format": (b"GIF89a\x01\0\x01\0\0\0\0;", "not a readable image"),
    "empty": (b"", "not a readable image"),
    "jpeg head alone": (b"\xff\xd8\xff\xe0", "not a readable image"),
}


@pytest.mark.parametrize("name", IMAGES)
def test_an_image_that_is_no_frame(tmp_path, name):
    content, expected = IMAGES[name]
    (tmp_path / "a.png").write_bytes(content)
    assert_raises_one_line(FrameRef(tmp_path / "a.png").load, expected)


@pytest.mark.parametrize(
    ("name", "expected"),
    [("bomb", "too large"), ("sliver", "too narrow"), ("no width", "0x7 pixels")],
)
def test_the_header_tells_before_a_model_is_asked(tmp_path, name, expected):
    (tmp_path / "a.png").write_bytes(IMAGES[name][0])
    problem = FrameRef(tmp_path / "a.png").problem
    assert problem is not None
    assert expected in problem


def test_archive_members_that_stand_twice_are_refused(tmp_path):
    with tarfile.open(tmp_path / "a.tar", "w") as tar:
        for content in (b"one", b"two"):
            info = tarfile.TarInfo("metadata/x")
            info.size = len(content)
            tar.addfile(info, io.BytesIO(content))
    assert_raises_one_line(
        lambda: unpack_tar(tmp_path / "a.tar", tmp_path / "metadata"), "contains 'metadata/x' twice"
    )
    assert not (tmp_path / "metadata").exists()


def test_a_deep_object_in_a_trajectory_is_one_line(tmp_path):
    deep = {
        "scene": {"floor_plan": "x", "init_action": {"x": 0, "y": 0, "z": 0}},
        "plan": {"low_actions": []},
    }
    text = json.dumps(deep)[:-1] + ', "gen_info": {"a": ' + "[" * 100_000 + "]" * 100_000 + "}}"
    (tmp_path / "a.json").write_text(text)
    assert_raises_one_line(lambda: list(iter_trajectories(tmp_path / "a.json")), "not a trajectory")


def _packed(path, **headers):
    """An archive of ten files of 2 KB, of which the first has these attributes."""
    with tarfile.open(path, "w:gz", format=tarfile.PAX_FORMAT) as tar:
        for number in range(10):
            info = tarfile.TarInfo(f"metadata/{number}")
            info.size, info.pax_headers = 2000, headers if number == 0 else {}
            tar.addfile(info, io.BytesIO(os.urandom(2000)))
    return path


@pytest.mark.parametrize(
    ("damage", "problem"),
    [
        (
            lambda tar: (
                tar[:6000] + bytes([tar[6000 + at] ^ 255 for at in range(2000)]) + tar[8000:]
            ),
            "no header",
        ),
        (
            lambda tar: (
                tar[: tar.index(b"metadata/5") + 3] + b"\0" + tar[tar.index(b"metadata/5") + 4 :]
            ),
            "no header",
        ),
        (lambda tar: tar[: tar.index(b"metadata/5") + 100], "damaged archive"),
        (lambda tar: tar[: tar.index(b"metadata/5")], "no header"),
    ],
)
def test_half_of_an_archive_is_not_taken_for_the_whole(tmp_path, damage, problem):
    path = _packed(tmp_path / "a.tar.gz")
    path.write_bytes(gzip.compress(damage(gzip.decompress(path.read_bytes()))))
    assert_raises_one_line(lambda: unpack_tar(path, tmp_path / "metadata"), problem)
    assert not (tmp_path / "metadata").exists()


def test_a_checksum_that_is_wrong_is_noticed(tmp_path):
    path = _packed(tmp_path / "a.tar.gz")
    content = path.read_bytes()
    path.write_bytes(content[:-8] + bytes([content[-8] ^ 1]) + content[-7:])
    assert_raises_one_line(lambda: unpack_tar(path, tmp_path / "metadata"), "a damaged archive")
    unpack_tar(_packed(path), tmp_path / "metadata")
    assert len(list((tmp_path / "metadata").iterdir())) == 10


def test_a_header_that_would_fill_the_memory_is_not_read(tmp_path):
    path = _packed(tmp_path / "a.tar.gz", comment="a" * 2**22)
    assert_raises_one_line(lambda: unpack_tar(path, tmp_path / "metadata"), "a header of 4,194,")
    unpack_tar(_packed(path, comment="a" * 2**10), tmp_path / "metadata")
