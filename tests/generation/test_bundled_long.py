"""The bundled set of long twins: what it says of itself, and that its frames are drawn again."""

from collections import Counter

import msgspec
import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.twins import read_pairs
from infthor_eval.formats.undrawn import DIGESTS, WORLDS, is_undrawn
from infthor_eval.generation.bundle import MANIFEST, read_manifest
from infthor_eval.generation.twins import undrawn
from infthor_eval.storage.digests import digest_of_file
from infthor_eval.storage.folders import packaged_folder
from infthor_eval.workers import WorkerSettings

BUNDLED = packaged_folder("sets/nieh_mini_long")


def test_its_files_are_those_of_its_manifest_and_small():
    manifest = read_manifest(BUNDLED / MANIFEST)
    assert is_undrawn(BUNDLED) and not manifest.frames
    assert set(manifest.files) == {
        "qa_set_twins.csv", "set.json", "twins.jsonl", WORLDS, DIGESTS,
    }  # fmt: skip
    for name, digest in manifest.files.items():
        assert digest_of_file(BUNDLED / name) == digest
    assert (BUNDLED / WORLDS).stat().st_size < 1_000_000


def test_its_questions_climb_rungs_from_evidence_in_both_worlds():
    rungs = read_manifest(BUNDLED / MANIFEST).twins.rungs
    ages = Counter()
    for pair in read_pairs(BUNDLED):
        for question in pair.questions:
            age = question.moment - pair.evidence(question.moment)
            assert age in rungs and question.moment < len(pair.frames)
            ages[age] += not question.is_placebo
    assert sorted(ages) == list(rungs)
    assert ages[100] >= 60 and ages[300] >= 20
    questions = NiehSet(BUNDLED).questions
    assert len({it.pair for it in questions}) * 2 == len(questions)


@pytest.mark.slow
def test_its_first_worlds_are_drawn_as_where_it_was_made(tmp_path, monkeypatch):
    names = list(msgspec.json.decode((BUNDLED / DIGESTS).read_bytes()))[:2]
    worlds = undrawn._worlds
    monkeypatch.setattr(
        undrawn, "_worlds", lambda packed: (it for it in worlds(packed) if it.traj_id in names)
    )
    assert undrawn.draw_worlds(BUNDLED, tmp_path, WorkerSettings()) == []
    assert {path.name for path in (tmp_path / "metadata").iterdir()} == set(names)
