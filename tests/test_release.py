"""A release: equal commits give equal bytes, and what it needs is locked by hashes."""

import importlib.metadata
import importlib.util
import re
import subprocess
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from infthor_eval import __version__

from .docs.blocks import ROOT

# Builds of it differ by hardware; make's BY_HARDWARE is what it brings.
BY_HARDWARE = re.compile(r"torch|triton|cuda-.*|nvidia-.*")
LOCKS = ("requirements.lock", ".ci/release-tools.lock")


def load_release():
    spec = importlib.util.spec_from_file_location("release", ROOT / ".ci" / "release.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_board_is_of_the_same_version_and_needs_it():
    text = (ROOT / "infthor_board" / "pyproject.toml").read_text(encoding="utf-8")
    project = tomllib.loads(text)["project"]
    assert project["version"] == __version__
    assert f"infthor-eval=={__version__}" in project["dependencies"]


@pytest.fixture(scope="module")
def release():
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout: a release is built of a commit")
    return load_release()


def test_two_builds_have_equal_bytes(release, tmp_path, monkeypatch):
    first = release.build_release(tmp_path / "first")
    # Nothing of where, when and by whom it is built is in it.
    monkeypatch.setenv("TZ", "Asia/Tokyo")
    monkeypatch.setenv("LC_ALL", "C")
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "elsewhere"))
    before = release.os.umask(0o077)
    try:
        second = release.build_release(tmp_path / "second")
    finally:
        release.os.umask(before)
    assert [path.name for path in first] == [path.name for path in second]
    assert {path.suffix for path in first} == {".whl", ".gz"}
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes(), one.name
    wheel, archive = first
    assert str(tmp_path).encode() not in zipfile.ZipFile(wheel).read(
        next(name for name in zipfile.ZipFile(wheel).namelist() if name.endswith("METADATA"))
    )
    # The wheel of the source distribution is that of the commit.
    with tarfile.open(archive) as files:
        files.extractall(tmp_path / "unpacked", filter="data")
        epoch = files.getmembers()[0].mtime
    (source,) = (tmp_path / "unpacked").iterdir()
    release.build(source, "wheel", tmp_path / "again", epoch)
    (again,) = (tmp_path / "again").iterdir()
    assert again.read_bytes() == wheel.read_bytes()


def test_an_archive_is_the_same_whoever_made_it_and_when(tmp_path):
    normal_archive = load_release().normal_archive
    contents = []
    for number, names in enumerate((["b", "a"], ["a", "b"])):
        folder = tmp_path / str(number)
        folder.mkdir()
        packed = folder / "it.tar.gz"
        with tarfile.open(packed, "w:gz") as archive:
            for name in names:
                path = folder / name
                path.write_text(name)
                info = archive.gettarinfo(path, name)
                info.mtime, info.uid, info.uname, info.mode = number, number, f"u{number}", 0o600
                with path.open("rb") as file:
                    archive.addfile(info, file)
        assert packed.read_bytes() not in contents
        contents.append(normal_archive(packed, 1_700_000_000))
    assert contents[0] == contents[1]


# -- locks


def locked(name):
    """The versions of a lock, and how many hashes each has."""
    text = (ROOT / name).read_text(encoding="utf-8").replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    found = {}
    for line in lines:
        pinned, *hashes = re.split(r"\s+--hash=", line)
        requirement = Requirement(pinned)
        assert requirement.url is None
        (version,) = requirement.specifier
        assert version.operator == "=="
        assert all(re.fullmatch(r"sha256:[0-9a-f]{64}", item.strip()) for item in hashes)
        found[canonicalize_name(requirement.name)] = (version.version, len(hashes))
    return found


def constraints():
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pairs = (line.split("==") for line in lines if line and not line.startswith("#"))
    return {canonicalize_name(name): version for name, version in pairs}


@pytest.mark.parametrize("name", LOCKS)
def test_each_version_of_a_lock_has_hashes_and_no_place(name):
    found = locked(name)
    assert len(found) > 20
    assert all(n_hashes for _, n_hashes in found.values())
    assert "://" not in (ROOT / name).read_text(encoding="utf-8")


def test_the_lock_has_the_versions_that_are_tested():
    tested = constraints()
    versions = {name: version for name, (version, _) in locked(LOCKS[0]).items()}
    shared = versions.keys() & tested.keys()
    assert len(shared) > 80
    assert {name: versions[name] for name in shared} == {name: tested[name] for name in shared}
    assert not any(BY_HARDWARE.fullmatch(name) for name in versions)


def test_all_that_the_core_needs_here_is_in_the_lock():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    versions = locked(LOCKS[0])
    waiting = [Requirement(text) for text in project["dependencies"]]
    seen = set()
    while waiting:
        requirement = waiting.pop()
        name = canonicalize_name(requirement.name)
        environments = [{"extra": extra} for extra in (*requirement.extras, "")]
        marker = requirement.marker
        if marker is not None and not any(marker.evaluate(item) for item in environments):
            continue
        if (name, *requirement.extras) in seen:
            continue
        seen.add((name, *requirement.extras))
        needed = [Requirement(text) for text in importlib.metadata.requires(name) or ()]
        extras = [{"extra": extra} for extra in (*requirement.extras, "")]
        waiting += [
            Requirement(str(item).partition(";")[0])
            for item in needed
            if item.marker is None or any(item.marker.evaluate(extra) for extra in extras)
        ]
    missing = {name for name, *_ in seen if name not in versions}
    assert len(seen) > 80
    assert {name for name in missing if not BY_HARDWARE.fullmatch(name)} == set()
    assert "torch" in missing


def test_make_writes_the_locks_and_lists_what_is_in_a_release():
    words = ["make", "--dry-run", "--always-make", "--no-print-directory"]
    told = {
        target: subprocess.run(
            [*words, target], cwd=ROOT, capture_output=True, text=True, check=True
        ).stdout
        for target in ("lock", "audit", "release")
    }
    assert all("--require-hashes" in text for text in told.values())
    assert all(f"-o {name}" in told["lock"] for name in LOCKS)
    assert told["lock"].count("--generate-hashes") == len(LOCKS)
    assert "--no-emit-package torch " in told["lock"]
    assert all(name in told["audit"] for name in LOCKS)
    assert "pip-audit --strict" in told["audit"]  # what could not be looked up is no success
    assert ".ci/release.py dist" in told["release"]
    assert "cyclonedx-py requirements" in told["release"]


def test_what_make_leaves_out_is_what_the_tests_take_for_hardware():
    text = (ROOT / "Makefile").read_text(encoding="utf-8").replace("\\\n", " ")
    line = re.search(r"^BY_HARDWARE := (.*)$", text, re.MULTILINE)[1]
    plain, _, addressed = line.partition("$(addprefix nvidia-,")
    names = [*plain.split(), *(f"nvidia-{name}" for name in addressed.rstrip(")").split())]
    assert all(BY_HARDWARE.fullmatch(name) for name in names)


def test_the_files_of_a_release_are_not_kept():
    ignored = Path(ROOT / ".gitignore").read_text(encoding="utf-8").split()
    assert {"dist/", "build/", ".venv-release/"} <= set(ignored)
