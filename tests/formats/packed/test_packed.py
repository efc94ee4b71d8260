"""Sets in Parquet, against the folders that they were made of."""

import os
import pickle
import shutil
from pathlib import Path

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from PIL import Image

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.packed.table_writer import PackSettings
from infthor_eval.formats.packed.writing import CARD, pack_set, unpack_set
from infthor_eval.formats.step_log import read_steps, write_steps
from tests.helpers.twin_sets import write_twin_set

ONE_TABLE = "frames-00000-of-00001.parquet"


def pack(folder: Path, **settings) -> Path:
    out = folder.with_name(f"{folder.name}-packed")
    out.mkdir()
    assert not pack_set(NiehSet(folder), out, PackSettings(**settings)).damaged
    return out


@pytest.fixture(params=["frames of its own", "twins", "a log in our form"])
def folder(request, make_nieh_set, tmp_path):
    """A set as a folder."""
    if request.param == "twins":
        return write_twin_set(tmp_path / "twins")
    root = make_nieh_set(size=32)
    if request.param == "a log in our form":
        for trajectory in (root / "metadata").iterdir():
            write_steps(trajectory, read_steps(trajectory))
            (trajectory / "traj.txt").write_text("look around\n")
            (trajectory / "more").mkdir()
            (trajectory / "more" / "film.mp4").write_bytes(bytes(range(256)) * 20_000)
    return root


def contents(root: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(root)): path.read_bytes()
        for path in root.rglob("*")
        if path.is_file() and path.name not in CARD
    }


@pytest.mark.parametrize("frames_per_group", [2, 1000])
def test_it_is_read_as_the_folder_is(folder, frames_per_group):
    packed = pack(folder, frames_per_group=frames_per_group)
    one, other = NiehSet(folder), NiehSet(packed)
    assert other.rows == one.rows
    assert other.fingerprint == one.fingerprint
    for traj_id in {question.traj_id for question in one.questions}:
        assert read_steps(other.folder(traj_id)) == read_steps(one.folder(traj_id))
        for mine, theirs in zip(one.frames(traj_id), other.frames(traj_id), strict=True):
            assert (theirs.digest, theirs.n_bytes) == (mine.digest, mine.n_bytes)
            assert (theirs.name, theirs.size) == (mine.name, mine.size)
            assert theirs.load().tobytes() == mine.load().tobytes()


def test_unpacked_it_is_the_folder(folder, tmp_path):
    out = tmp_path / "unpacked"
    out.mkdir()
    unpack_set(pack(folder), out, skip_damaged=False)
    assert contents(out) == contents(folder)


def test_packed_again_it_is_the_same(folder, tmp_path):
    packed = pack(folder)
    again = tmp_path / "again"
    again.mkdir()
    pack_set(NiehSet(packed), again)
    assert contents(again) == contents(packed)


def test_a_frame_is_sent_to_another_process(folder):
    data = NiehSet(pack(folder))
    frames = data.frames(data.questions[0].traj_id)
    sent = pickle.loads(pickle.dumps(frames))
    assert [frame.digest for frame in sent] == [frame.digest for frame in frames]
    assert len({id(frame.path.pack) for frame in sent}) == 1


def test_the_tables_load_without_our_code(folder, tmp_path):
    from datasets import load_dataset

    packed = pack(folder)
    one = NiehSet(folder)

    def load(table):
        return load_dataset(str(packed), table, cache_dir=tmp_path / "cache")["train"]

    rows = load("questions")
    assert [row["question"] for row in rows] == [question.text for question in one.questions]
    for row, question in zip(rows, one.questions, strict=True):
        assert row["answer"] == [str(answer) for answer in question.answers]
        assert tuple(row["gt_img_idx"]) == question.clues
        shown = [frame.load().tobytes() for frame in one.clue_frames(question)]
        assert [picture.convert("RGB").tobytes() for picture in row["clue_frames"]] == shown
    pictures = {row["digest"]: row["image"].convert("RGB").tobytes() for row in load("frames")}
    for row in load("steps"):
        frame = dict(
            zip(one.frame_numbers(row["traj_id"]), one.frames(row["traj_id"]), strict=True)
        )[row["img_idx"]]
        assert pictures[row["frame"]] == frame.load().tobytes()
        assert (row["width"], row["height"]) == frame.size
    assert len(load("trajectories")) == len(set(load("steps")["traj_id"]))
    pairs = {pair.id for pair in one.twins.values()}
    assert not pairs or set(load("twins")["id"]) == pairs


def test_pictures_that_are_nearly_equal_take_little(tmp_path):
    root = write_twin_set(tmp_path / "twins")
    noise = Image.effect_noise((160, 160), 80)
    for number, picture in enumerate(sorted((root / "frames").iterdir())):
        noise.putpixel((number, 0), 255 - noise.getpixel((number, 0)))
        noise.save(picture, compress_level=0)
    n_bytes = sum(path.stat().st_size for path in (root / "frames").iterdir())
    for text in (root / "metadata").rglob("frames.txt"):
        assert text.is_file()
    (pack(root, frames_per_group=1000, level=19) / ONE_TABLE).stat()
    assert (root.with_name("twins-packed") / ONE_TABLE).stat().st_size < n_bytes / 4


def test_shards_are_of_limited_size(make_nieh_set, monkeypatch):
    monkeypatch.setattr("infthor_eval.formats.packed.table_writer._SHARD_BYTES", 1)
    root = make_nieh_set(size=32)
    packed = pack(root, frames_per_group=2)
    assert len(list(packed.glob("frames-*-of-00006.parquet"))) == 6
    assert NiehSet(packed).fingerprint == NiehSet(root).fingerprint


def test_damaged_trajectories_are_left_out_and_said(make_nieh_set, tmp_path):
    root = make_nieh_set(size=32)
    (root / "metadata/traj_a/metadata.json").write_text("[")
    out = tmp_path / "packed"
    out.mkdir()
    packed = pack_set(NiehSet(root), out)
    assert packed.n_trajectories == 1
    assert len(packed.damaged) == 1
    assert NiehSet(out).questions == NiehSet(root).questions


def test_a_missing_frame_is_missing(make_nieh_set):
    root = make_nieh_set(size=32)
    next((root / "metadata/traj_a/img").iterdir()).unlink()
    packed = pack(root)
    one, other = NiehSet(root), NiehSet(packed)
    assert len(other.skipped) == len(one.skipped)
    assert other.questions == one.questions


def rewrite(file: Path, change) -> None:
    """Change the rows of the first row group."""
    old = pq.ParquetFile(file)
    groups = [old.read_row_group(at) for at in range(old.num_row_groups)]
    rows = groups[0].to_pylist()
    change(rows)
    groups[0] = pa.Table.from_pylist(rows, groups[0].schema)
    with pq.ParquetWriter(file, groups[0].schema, use_dictionary=False) as writer:
        for group in groups:
            writer.write_table(group, row_group_size=len(group))


def cut(file: Path) -> None:
    file.write_bytes(file.read_bytes()[:-200])


def swap_pictures(rows):
    rows[0]["image"], rows[1]["image"] = rows[1]["image"], rows[0]["image"]


def lead_out(rows):
    rows[0]["files"][0]["name"] = "../../../secret"


def rows_twice(rows):
    rows.append(rows[0])


def far_away(rows):
    for row in rows:
        row["row"] = 10**6


def no_shard(rows):
    for row in rows:
        row["shard"] = -3


DAMAGES = {
    "cut off": (ONE_TABLE, cut, "not a Parquet file, or cut off"),
    "empty": (ONE_TABLE, lambda file: file.write_bytes(b""), "not a Parquet file, or cut off"),
    "missing": (ONE_TABLE, Path.unlink, "file 0 of frames is not there"),
    "another": (
        "steps-00000-of-00001.parquet",
        lambda file: shutil.copyfile(file.with_name(ONE_TABLE), file),
        "column traj_id: no such column",
    ),
    "two of three": (
        ONE_TABLE,
        lambda file: file.rename(file.with_name("frames-00001-of-00003.parquet")),
        "has 1 of 3 files frames-",
    ),
    "other pictures": (ONE_TABLE, lambda file: rewrite(file, swap_pictures), "digest"),
    "a path that leads out": (
        "trajectories-00000-of-00001.parquet",
        lambda file: rewrite(file, lead_out),
        "is no path within a set",
    ),
    "a trajectory twice": (
        "trajectories-00000-of-00001.parquet",
        lambda file: rewrite(file, rows_twice),
        "a trajectory twice",
    ),
    "a row that is not there": (
        "steps-00000-of-00001.parquet",
        lambda file: rewrite(file, far_away),
        "cannot be read",
    ),
    "a shard that is not there": (
        "steps-00000-of-00001.parquet",
        lambda file: rewrite(file, no_shard),
        "no place of a file",
    ),
    "a pipe": (ONE_TABLE, lambda file: (file.unlink(), os.mkfifo(file)), "is a pipe"),
    "values by their prefixes": (
        "steps-00000-of-00001.parquet",
        lambda file: pq.write_table(
            pq.read_table(file),
            file,
            use_dictionary=False,
            column_encoding={"log": "DELTA_BYTE_ARRAY"},
        ),
        "log is encoded as DELTA_BYTE_ARRAY",
    ),
    "a file that is a folder, too": (
        "trajectories-00000-of-00001.parquet",
        lambda file: rewrite(file, lambda rows: rows[0]["files"][0].update(name="img")),
        "is a file and a folder",
    ),
    "a dictionary": (
        ONE_TABLE,
        lambda file: pq.write_table(pq.read_table(file), file, use_dictionary=True),
        "is encoded as",
    ),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_set_is_refused_in_one_line(name, make_nieh_set, tmp_path):
    root = make_nieh_set(size=32)
    for trajectory in (root / "metadata").iterdir():
        write_steps(trajectory, read_steps(trajectory))
    packed = pack(root)
    file, damage, words = DAMAGES[name]
    damage(packed / file)

    def read():
        data = NiehSet(packed)
        for skipped in data.skipped:
            raise DataError(skipped.reason)
        for question in data.questions:
            for frame in data.frames(question.traj_id):
                frame.load()

    with pytest.raises(DataError, match=words) as refused:
        read()
    assert "\n" not in str(refused.value)
    assert str(packed) in str(refused.value)


def test_what_is_whole_is_saved_if_the_user_says_so(make_nieh_set, tmp_path):
    root = make_nieh_set(size=32)
    packed = pack(root)

    def spoil(rows):
        rows[0]["image"]["bytes"] = b"another"

    rewrite(packed / ONE_TABLE, spoil)
    out = tmp_path / "saved"
    out.mkdir()
    with pytest.raises(DataError, match="digest"):
        unpack_set(packed, out, skip_damaged=False)
    shutil.rmtree(out)
    out.mkdir()
    saved = unpack_set(packed, out, skip_damaged=True)
    assert (saved.n_trajectories, len(saved.damaged)) == (1, 1)
    assert len(NiehSet(out).questions) < len(NiehSet(root).questions)


def test_an_image_that_is_a_bomb_is_refused(make_nieh_set):
    root = make_nieh_set(size=32)
    picture = next((root / "metadata/traj_a/img").iterdir())
    head = bytearray(picture.read_bytes())
    head[16:24] = b"\xff\xff\xff\x0f" * 2
    picture.write_bytes(head)
    data = NiehSet(pack(root))
    frame = next(it for it in data.frames("traj_a") if it.name == picture.name)
    with pytest.raises(DataError):
        frame.load()


def test_a_log_of_another_trajectory_is_refused(make_nieh_set):
    root = make_nieh_set(size=32)
    for trajectory in (root / "metadata").iterdir():
        write_steps(trajectory, read_steps(trajectory))
    packed = pack(root)

    def edit(rows):
        entry = msgspec.json.decode(rows[0]["log"])
        entry["action"] = "another"
        rows[0]["log"] = msgspec.json.encode(entry).decode()

    rewrite(packed / "steps-00000-of-00001.parquet", edit)
    with pytest.raises(DataError, match="digest"):
        read_steps(NiehSet(packed).folder("traj_a"))


def test_links_pipes_and_strange_names_are_left_out_and_said(make_nieh_set, tmp_path):
    root = make_nieh_set(size=32)
    secret = tmp_path / "secret.txt"
    secret.write_text("a secret")
    folder = root / "metadata/traj_a"
    (folder / "link.txt").symlink_to(secret)
    (folder / "around").symlink_to(root)
    (folder / "img" / "000000002.png").unlink()
    (folder / "img" / "000000002.png").symlink_to(secret)
    os.mkfifo(folder / "pipe.bin")
    (root / "remote.json").write_text("{}")
    (root / "more").mkdir()
    out = tmp_path / "packed"
    out.mkdir()
    packed = pack_set(NiehSet(root), out)
    assert {Path(path).name for path in packed.left_out} == {
        *("link.txt", "around", "000000002.png", "pipe.bin", "remote.json", "more")
    }
    assert not any(b"a secret" in path.read_bytes() for path in out.iterdir())
    assert NiehSet(out).questions


@pytest.mark.parametrize("entries", ["[]", '[{"img_idx": 99999999999999999999}]'])
def test_a_trajectory_that_no_table_holds_is_left_out(entries, make_nieh_set, tmp_path):
    root = make_nieh_set(size=32)
    (root / "metadata/traj_a/metadata.json").write_text(entries)
    for picture in (root / "metadata/traj_a/img").iterdir():
        picture.unlink()
    out = tmp_path / "packed"
    out.mkdir()
    packed = pack_set(NiehSet(root), out)
    assert (packed.n_trajectories, len(packed.damaged)) == (1, 1)


@pytest.mark.parametrize("column", ["file", "n_bytes", "shard", "row_group", "row", "log"])
def test_nothing_in_a_column_is_refused_in_one_line(column, make_nieh_set, tmp_path):
    root = make_nieh_set(size=32)
    for trajectory in (root / "metadata").iterdir():
        write_steps(trajectory, read_steps(trajectory))
    packed = pack(root)
    rewrite(packed / "steps-00000-of-00001.parquet", lambda rows: rows[0].update({column: None}))
    out = tmp_path / "saved"
    out.mkdir()
    saved = unpack_set(packed, out, skip_damaged=True)
    assert (saved.n_trajectories, len(saved.damaged)) == (1, 1)
    assert "\n" not in saved.damaged[0]


def test_a_name_that_leads_out_and_a_missing_shard_stop_no_other(make_nieh_set, tmp_path):
    packed = pack(make_nieh_set(size=32))
    rewrite(
        packed / "trajectories-00000-of-00001.parquet", lambda rows: rows[0].update(traj_id="..")
    )
    (packed / ONE_TABLE).rename(packed / "frames-00000-of-00002.parquet")
    with pytest.raises(DataError, match="has 1 of 2 files frames-"):
        NiehSet(packed)
    out = tmp_path / "saved"
    out.mkdir()
    saved = unpack_set(packed, out, skip_damaged=True)
    assert (saved.n_trajectories, len(saved.damaged)) == (1, 1)


def test_a_large_file_is_a_row_group_by_itself(make_nieh_set):
    root = make_nieh_set(size=32)
    for name, n_bytes in (("a.bin", 5_000_000), ("b.bin", 10), ("c.bin", 5_000_000), ("d.bin", 10)):
        (root / "metadata/traj_a" / name).write_bytes(bytes(n_bytes))
    table = pq.ParquetFile(pack(root) / "files-00000-of-00001.parquet")
    sizes = [
        max(len(row["content"]) for row in table.read_row_group(at).to_pylist())
        if table.metadata.row_group(at).num_rows > 1
        else 0
        for at in range(table.num_row_groups)
    ]
    assert max(sizes) < 5_000_000


def test_many_files_are_several_row_groups(make_nieh_set, monkeypatch):
    monkeypatch.setattr("infthor_eval.formats.packed.groups._LARGE_PART", 3000)
    root = make_nieh_set(size=32)
    for number in range(20):
        (root / "metadata/traj_a" / f"{number}.bin").write_bytes(bytes(1000))
    (root / "metadata/traj_b/traj_data.json").write_text("{")
    packed = pack(root)
    assert pq.ParquetFile(packed / "files-00000-of-00001.parquet").num_row_groups > 5
    out = root.with_name("unpacked")
    out.mkdir()
    unpack_set(packed, out, skip_damaged=False)
    assert contents(out) == contents(root)
