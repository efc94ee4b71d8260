import numpy as np
import pytest

from infthor_eval.errors import DataError
from model_adapters.hf.vectors import VectorFile

A, B, C = "a" * 32, "b" * 32, "c" * 32
ONES, TWOS, THREES = (np.full(4, value, np.float32) for value in (1, 2, 3))


def test_vectors_are_found_by_key_also_by_the_next_process(tmp_path):
    path = tmp_path / "folder" / "vectors.f32"
    vectors = VectorFile(path, 4)
    assert A not in vectors
    vectors.add([A, B], np.stack([ONES, TWOS]))
    vectors.add([C], THREES[None])
    for file in (vectors, VectorFile(path, 4)):
        assert A in file
        assert file.get([C, A, A]).tolist() == [THREES.tolist(), ONES.tolist(), ONES.tolist()]


def test_two_processes_add_to_one_file_and_the_first_vector_of_a_key_stays(tmp_path):
    one, other = (VectorFile(tmp_path / "vectors.f32", 4) for _ in range(2))
    one.add([A], ONES[None])
    other.add([A, B], np.stack([THREES, TWOS]))
    one.add([C], THREES[None])
    for file in (one, other, VectorFile(tmp_path / "vectors.f32", 4)):
        assert file.get([A]).tolist() == [ONES.tolist()]
    assert one.get([B, C]).tolist() == [TWOS.tolist(), THREES.tolist()]


def test_a_row_that_a_killed_process_left_unfinished_is_cut_off(tmp_path):
    path = tmp_path / "vectors.f32"
    VectorFile(path, 4).add([A, B], np.stack([ONES, TWOS]))
    path.write_bytes(path.read_bytes()[:-5])
    vectors = VectorFile(path, 4)
    assert A in vectors
    assert B not in vectors
    vectors.add([C], THREES[None])
    assert VectorFile(path, 4).get([A, C]).tolist() == [ONES.tolist(), THREES.tolist()]


def test_a_place_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match=r"cannot be written .*; set XDG_CACHE_HOME"):
        VectorFile(tmp_path / "file" / "vectors.f32", 4)
