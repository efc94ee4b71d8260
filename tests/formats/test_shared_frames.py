"""Pictures that trajectories share."""

import shutil

import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.shared_frames import (
    read_shared_frames,
    store_picture,
    write_frame_names,
)


@pytest.fixture
def shared(make_nieh_set):
    """A set whose trajectories share their pictures, and the folder it was made of."""
    own = make_nieh_set()
    root = own.with_name("shared")
    shutil.copytree(own, root)
    for folder in (root / "metadata").iterdir():
        images = sorted((folder / "img").iterdir())
        contents = (image.read_bytes() for image in images)
        write_frame_names(folder, [store_picture(root, it, folder.name) for it in contents])
        shutil.rmtree(folder / "img")
    return root, own


def test_a_set_with_shared_pictures_has_the_same_frames(shared):
    root, own = shared
    for question in NiehSet(own).questions:
        one, other = (NiehSet(folder).frames(question.traj_id) for folder in shared)
        assert [frame.digest for frame in one] == [frame.digest for frame in other]
    assert NiehSet(root).questions == NiehSet(own).questions


def test_a_picture_is_stored_once(shared, tmp_path):
    root, own = shared
    image = next((own / "metadata/traj_a/img").iterdir())
    stored = set((root / "frames").iterdir())
    store_picture(root, image.read_bytes(), "again")
    assert set((root / "frames").iterdir()) == stored


def test_trajectories_with_the_same_picture_have_the_same_frame(tmp_path):
    known = {}
    for name, pictures in (("a", ["1" * 32, "2" * 32]), ("b", ["2" * 32, "3" * 32])):
        folder = tmp_path / "metadata" / name
        folder.mkdir(parents=True)
        write_frame_names(folder, pictures)
    a, b = (read_shared_frames(tmp_path / "metadata" / name, [4, 7], known) for name in ("a", "b"))
    assert a[7] is b[4]
    assert [frame.path.stem[0] for frame in (a[4], a[7], b[7])] == ["1", "2", "3"]


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["../../secret"] * 6, "is not the name of a picture"),
        (["0" * 32] * 5, "5 names but 6 entries"),
    ],
)
def test_wrong_names_are_refused(names, words, tmp_path):
    write_frame_names(tmp_path, names)
    with pytest.raises(DataError, match=words):
        read_shared_frames(tmp_path, range(6), {})


def test_a_trajectory_with_its_own_pictures_has_no_shared_ones(tmp_path):
    assert read_shared_frames(tmp_path, range(6), {}) is None
