"""`infthor-eval private-set`, as it is typed; twins themselves are made in tests/generation."""

from types import SimpleNamespace

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.replies.answer_key import read_key
from infthor_eval.formats.set_info import claim_for_simulator
from infthor_eval.generation.private import making
from tests.helpers.command_line import assert_refused
from tests.helpers.twin_sets import write_twin_set

SECRET = "5eed" * 16


@pytest.fixture
def made(monkeypatch):
    """What is asked of the simulator, which is not started: the twins are a small set's."""
    made = SimpleNamespace(jobs=[], settings=[], failures=[])

    def generate(jobs, _launch, _out, *_others):
        made.jobs.append(jobs)
        return SimpleNamespace(failures=made.failures)

    def make_twins(_selection, _launch, out, settings, _score, **_options):
        made.settings.append(settings)
        claim_for_simulator(out, "embedded")
        write_twin_set(out)
        return SimpleNamespace(pairs=4, failures=[])

    monkeypatch.setattr(making, "generate_with_workers", generate)
    monkeypatch.setattr(making, "select", lambda _paths: None)
    monkeypatch.setattr(making, "make_twins", make_twins)
    return made


@pytest.fixture
def secret(tmp_path):
    path = tmp_path / "secret.txt"
    path.write_text(SECRET)
    return path


def test_a_set_from_a_secret(run_cli, made, secret, tmp_path):
    out = tmp_path / "out"
    code, output, err = run_cli("private-set", "--seed-file", secret, "--out", out)
    assert code == 0, err
    assert output.splitlines() == [
        "4 pairs of questions on 4 trajectories",
        f"to publish: {out / 'public'}",
        f"to keep secret: {out / 'key'}, {secret}",
    ]
    public = NiehSet(out / "public")
    key = read_key(out / "key")
    assert len(public.questions) == len(key.data.questions) == len(key.ids) > 0
    assert all(key.question(question.id).pair for question in public.questions)
    assert SECRET not in output + err
    assert (out / "key").stat().st_mode & 0o077 == 0


def test_homes_steps_and_edits_follow_from_the_secret_alone(run_cli, made, secret, tmp_path):
    other = tmp_path / "other.txt"
    other.write_text("0" * 64)
    for name, path in (("a", secret), ("b", secret), ("c", other)):
        run_cli("private-set", "--seed-file", path, "--out", tmp_path / name, "--homes", 4)
    first, again, others = ([(job.scene, job.seed) for job in jobs] for jobs in made.jobs)
    assert first == again
    assert not set(first) & set(others)
    assert [settings.seed for settings in made.settings[:2]] == [made.settings[0].seed] * 2
    assert made.settings[2].seed != made.settings[0].seed
    # Nobody finds them by trying out small numbers.
    numbers = [int(scene.rpartition("-")[2]) for scene, _ in first] + [seed for _, seed in first]
    assert len(set(numbers)) == 8
    assert min(numbers) > 2**40
    assert [scene.rpartition("-")[0] for scene, _ in first] == [
        "kitchen", "living-room", "bedroom", "kitchen"
    ]  # fmt: skip


def test_a_home_without_twins_is_named(run_cli, made, secret, tmp_path):
    made.failures.append("kitchen: no plan")
    code, output, err = run_cli("private-set", "--seed-file", secret, "--out", tmp_path / "out")
    assert code == 1
    assert "to publish" in output
    assert "left out: kitchen: no plan" in err


def test_some_kinds_alone(run_cli, made, secret, tmp_path):
    run_cli("private-set", "--seed-file", secret, "--out", tmp_path / "out", "--kinds", "move,swap")
    assert made.settings[0].kinds == ("move", "swap")
    ended = run_cli("private-set", "--seed-file", secret, "--out", tmp_path / "b", "--kinds", "mov")
    assert_refused(ended, "did you mean 'move'?")


def test_what_is_no_secret(run_cli, tmp_path):
    secret = tmp_path / "secret.txt"
    secret.write_text("42")
    ended = run_cli("private-set", "--seed-file", secret, "--out", tmp_path / "out")
    assert_refused(ended, "32 to 256 hexadecimal digits", "openssl rand -hex 32")
