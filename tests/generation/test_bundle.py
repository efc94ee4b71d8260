from pathlib import Path

import msgspec
import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.generation.bundle import (
    MANIFEST,
    Manifest,
    TrajectoryRecipe,
    build_bundle,
    digests_of,
    read_manifest,
)
from infthor_eval.generation.questions.generate import generate_questions
from infthor_eval.storage.digests import digest_of_file, fingerprint
from infthor_eval.storage.folders import packaged_folder

from ..helpers import bundled as unpacked

BUNDLED = packaged_folder("sets/nieh_mini")


def test_the_bundled_set_is_small_and_has_every_type_and_number_of_clues():
    data = NiehSet(BUNDLED)
    assert data.skipped == ()
    assert data.simulator == "embedded"
    assert len({question.question_type for question in data.questions}) == 13
    assert {min(len(question.clues), 3) for question in data.questions} == {1, 2, 3}
    assert len({question.traj_id for question in data.questions}) == 6
    assert 120 <= len(data.questions) <= 170
    assert sum(path.stat().st_size for path in BUNDLED.iterdir()) < 7e6


def test_the_bundled_sets_are_few_files():
    files = [path for path in BUNDLED.parent.rglob("*") if path.is_file()]
    assert len(files) <= 48
    assert sum(path.stat().st_size for path in files) < 26e6


def test_the_bundled_questions_follow_from_the_bundled_logs():
    manifest = read_manifest(BUNDLED / MANIFEST)
    generated = generate_questions(
        BUNDLED,
        seed=manifest.question_seed,
        per_trajectory=manifest.per_trajectory,
        further=manifest.further,
    )
    assert generated.questions == list(NiehSet(BUNDLED).questions)


def test_bundled_trajectories_come_out_again_bit_for_bit(tmp_path, simulator):
    manifest = read_manifest(BUNDLED / MANIFEST)
    part = msgspec.structs.replace(manifest, trajectories=manifest.trajectories[-1:])
    again, _ = build_bundle(part, simulator, tmp_path / "set")
    ((name, digest),) = [it for it in again.files.items() if it[0].startswith("metadata/")]
    assert manifest.files[name] == digest


def test_a_folder_that_is_not_empty_and_a_scene_that_is_not_there_are_refused(tmp_path, simulator):
    manifest = read_manifest(BUNDLED / MANIFEST)
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="not empty"):
        build_bundle(manifest, simulator, tmp_path)
    nowhere = msgspec.structs.replace(
        manifest,
        trajectories=(msgspec.structs.replace(manifest.trajectories[0], scene="attic-1"),),
    )
    with pytest.raises(DataError, match="attic-1"):
        build_bundle(nowhere, simulator, tmp_path / "set")


def test_a_build_that_was_stopped_goes_on_with_what_it_had(tmp_path, monkeypatch, simulator):
    manifest = Manifest("small", (TrajectoryRecipe("kitchen-1", 0, 1),), per_trajectory=2)
    out, undisturbed = tmp_path / "set", tmp_path / "undisturbed"
    done = []

    def stop(is_resumed):
        done.append(is_resumed)
        if len(done) == 1:  # generated, not replayed
            raise KeyboardInterrupt

    expected, _ = build_bundle(manifest, simulator, undisturbed)
    with pytest.raises(KeyboardInterrupt):
        build_bundle(manifest, simulator, out, stop)
    assert [path.name[0] for path in out.iterdir()] == ["."]
    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", _stop_at_manifest(Path.replace))
        with pytest.raises(KeyboardInterrupt):
            build_bundle(manifest, simulator, out, done.append)
    assert done[1:] == [True, False]
    again, _ = build_bundle(manifest, simulator, out)
    assert again == expected
    assert [path.name for path in out.iterdir() if path.name.startswith(".")] == []
    assert digest_of_file(out / MANIFEST) == digest_of_file(undisturbed / MANIFEST)


def test_a_build_that_was_killed_at_its_manifest_goes_on(tmp_path, monkeypatch, simulator):
    manifest = Manifest("small", (TrajectoryRecipe("bathroom-3", 0, 1),), per_trajectory=2)
    write = Path.write_bytes

    def cut(self, content):
        if MANIFEST not in self.name:
            return write(self, content)
        write(self, content[:40])
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_bytes", cut)
        with pytest.raises(KeyboardInterrupt):
            build_bundle(manifest, simulator, tmp_path)
    built, _ = build_bundle(manifest, simulator, tmp_path)
    assert read_manifest(tmp_path / MANIFEST) == built
    # As if it had been killed before the last of its hidden folder was removed.
    recipe = msgspec.to_builtins(msgspec.structs.replace(built, files={}))
    (tmp_path / f".building-{fingerprint(recipe)}" / "trajectories").mkdir(parents=True)
    with pytest.raises(DataError, match="has a whole set; give a new folder"):
        build_bundle(manifest, simulator, tmp_path)
    assert not list(tmp_path.glob(".*"))


def _stop_at_manifest(replace):
    def stop(self, target):
        if self.name == MANIFEST:  # the last that is moved
            raise KeyboardInterrupt
        return replace(self, target)

    return stop


@pytest.mark.parametrize(
    "content", ["{", '{"name": "x"}', '{"name": "x", "trajectories": [], "more": 1}']
)
def test_what_is_no_manifest_is_named(tmp_path, content):
    path = tmp_path / "manifest.json"
    path.write_text(content)
    with pytest.raises(DataError, match=r"manifest\.json: not in its documented form"):
        read_manifest(path)


def test_the_manifest_has_the_digests_of_the_files_that_are_there():
    manifest = read_manifest(BUNDLED / MANIFEST)
    assert digests_of(unpacked.BUNDLED) == manifest.files
