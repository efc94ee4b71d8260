"""The bundled set of twins, and building one."""

import shutil
from collections import Counter
from functools import partial

import msgspec
import numpy as np
import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.packed.writing import unpack_set
from infthor_eval.formats.step_log import read_steps
from infthor_eval.formats.twins import read_pairs, write_pairs
from infthor_eval.generation.bundle import (
    MANIFEST,
    TwinsManifest,
    build_twins,
    copy_compactly,
    differing_files,
    digests_of,
    read_manifest,
)
from infthor_eval.generation.twins.drafting import draft_twins
from infthor_eval.nieh.scoring import score
from infthor_eval.storage.digests import digest_of_file
from infthor_eval.storage.folders import packaged_folder
from infthor_eval.workers import WorkerSettings

BUNDLED = packaged_folder("sets/nieh_mini_twins")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The set as a folder."""
    out = tmp_path_factory.mktemp("twins")
    unpack_set(BUNDLED, out, skip_damaged=False)
    return out


@pytest.fixture(scope="module")
def pairs():
    """The bundled pairs of worlds."""
    return read_pairs(BUNDLED)


def test_the_bundled_twins_are_many_and_small(pairs):
    assert sum(len(pair.questions) for pair in pairs) >= 300
    assert len({pair.base for pair in pairs}) >= 12
    kinds = Counter(pair.kind for pair in pairs for _ in pair.questions)
    assert len(kinds) >= 8
    assert max(kinds.values()) <= 0.3 * kinds.total()
    rooms = {pair.floor_plan.rpartition("-")[0] for pair in pairs}
    assert rooms == {"kitchen", "living-room", "bedroom", "bathroom"}


def test_rooms_are_those_of_no_other_set_and_none_that_is_held_out():
    scenes = {recipe.scene for recipe in _manifest().trajectories}
    others = read_manifest(BUNDLED.with_name("nieh_mini") / MANIFEST).trajectories
    assert not scenes & {recipe.scene for recipe in others}
    assert not {int(scene.rpartition("-")[2]) for scene in scenes} & set(range(21, 26))


def _manifest() -> TwinsManifest:
    manifest = read_manifest(BUNDLED / MANIFEST)
    assert isinstance(manifest, TwinsManifest)
    return manifest


def test_every_question_of_the_bundled_twins_can_be_asked(pairs):
    data = NiehSet(BUNDLED)
    assert data.skipped == ()
    assert data.simulator == "embedded"
    sides = Counter(question.pair for question in data.questions)
    assert set(sides.values()) == {2}
    assert len(sides) == sum(len(pair.questions) for pair in pairs)


def test_frames_that_are_equal_in_both_worlds_have_equal_digests(pairs):
    data = NiehSet(BUNDLED)
    for pair in pairs[::10]:
        frames = [data.frames(name) for name in pair.traj_ids]
        for compared, one, other in zip(pair.frames, *frames, strict=True):
            assert compared.same == (one.digest == other.digest)
            assert compared.same == (one.load().tobytes() == other.load().tobytes())


def test_nothing_is_there_that_no_question_needs(pairs, folder):
    worlds = {name for pair in pairs for name in pair.traj_ids}
    assert {path.name for path in (folder / "metadata").iterdir()} == worlds
    data = NiehSet(folder)
    used = {frame.name for world in worlds for frame in data.frames(world)}
    assert {path.name for path in (folder / "frames").iterdir()} == used


def test_the_manifest_has_the_digests_of_the_twins_files(folder):
    assert digests_of(folder) == _manifest().files


def test_the_choice_of_questions_is_within_its_limit(pairs):
    by_base: dict[str, int] = Counter()
    for pair in pairs:
        by_base[pair.base] += len(pair.questions)
    assert max(by_base.values()) <= _manifest().per_trajectory


def _part(folder, pairs, out):
    """A set with the worlds of the first base trajectory alone."""
    first = [pair for pair in pairs if pair.base == pairs[0].base]
    for pair in first:
        for name in pair.traj_ids:
            shutil.copytree(folder / "metadata" / name, out / "metadata" / name)
    (out / "frames").symlink_to(folder / "frames")
    for file in ("set.json", "qa_set_twins.csv"):
        shutil.copy(folder / file, out)
    write_pairs(out, first)
    return first


def test_a_compact_copy_has_the_same_frames(folder, pairs, tmp_path):
    source = tmp_path / "source"
    source.mkdir()
    first = _part(folder, pairs, source)
    copies = []
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
        copy_compactly(source, tmp_path / name, 255)
        files = sorted(path for path in (tmp_path / name).rglob("*") if path.is_file())
        copies.append({path.relative_to(tmp_path / name): digest_of_file(path) for path in files})
    assert copies[0] == copies[1]
    assert read_pairs(tmp_path / "one") == first
    copied = NiehSet(tmp_path / "one", needs_questions=False)
    own = NiehSet(BUNDLED)
    for name in first[0].traj_ids:
        for frame, before in zip(copied.frames(name), own.frames(name), strict=True):
            difference = np.asarray(frame.load()).astype(int) - np.asarray(before.load())
            assert np.abs(difference).mean() < 4


@pytest.mark.slow
def test_twins_are_built_again_byte_for_byte(folder, pairs, tmp_path):
    """Of one trajectory: the same worlds, of which another choice of questions is made. Not of
    the two that sets/README.md names, whose episodes are drawn otherwise today."""
    manifest = _manifest()
    part = msgspec.structs.replace(manifest, trajectories=manifest.trajectories[2:3])
    draft = partial(draft_twins, score=partial(score, scorer="strict"))
    built, numbers = build_twins(part, draft, tmp_path / "one", WorkerSettings())
    again, _ = build_twins(part, draft, tmp_path / "other", WorkerSettings())
    assert differing_files(built, again) == []
    assert numbers.trajectories == 1
    made = {pair.id: pair for pair in read_pairs(tmp_path / "one")}
    bundled = {pair.id: pair for pair in pairs}
    common = made.keys() & bundled.keys()
    assert common
    for name in common:
        assert made[name].traj_ids == bundled[name].traj_ids
        for world in made[name].traj_ids:
            built_again = NiehSet(tmp_path / "one").folder(world)
            assert read_steps(built_again) == read_steps(folder / "metadata" / world)
