"""`infthor-board check`, `page` and `private-set`, as they are typed; twins themselves are made in
tests/generation."""

import json
from types import SimpleNamespace

import pytest

from infthor_board import private_sets
from infthor_eval.cli.commands.rescore import read_source
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.replies.answer_key import read_key
from infthor_eval.formats.set_info import claim_for_simulator
from infthor_eval.run import Run
from tests.helpers.command_line import assert_refused
from tests.helpers.twin_sets import write_twin_set
from tests.infthor_board.material import reader, reply_with, run_model, submit, write_home_set

SECRET = "5eed" * 16


@pytest.fixture(scope="module")
def homes(tmp_path_factory):
    return write_home_set(tmp_path_factory.mktemp("homes") / "set")


@pytest.fixture(scope="module")
def sent(tmp_path_factory, homes):
    """A folder with an honest submission, and one that has the key."""
    folder = tmp_path_factory.mktemp("sent")
    (path,) = run_model(folder / "results", model="random", tasks="nieh_gt", data=homes)
    source = read_source(Run.open(path))
    submit(folder / "all", "honest", reply_with(source, reader(0.5, "honest")))
    key = reply_with(source, lambda record: ", ".join(map(str, record.payload.answers)), "lab/key")
    submit(folder / "all", "key", key)
    return folder / "all"


def test_one_that_passes(run_board, sent, homes):
    code, output, _ = run_board("check", sent / "honest", "--data", homes)
    assert code == 0
    assert output.splitlines()[0] == "honest: passes"
    assert "  remark, above other home: nieh_gt: no run on another home" in output


def test_one_that_is_refused(run_board, sent, homes):
    code, output, _ = run_board("check", sent, "--data", homes)
    assert code == 1
    assert "key: refused, 3 reasons" in output
    assert "  key words: nieh_gt: 48 of 48 open questions" in output


def test_verdicts_as_json(run_board, sent, homes):
    code, output, _ = run_board("check", sent, "--data", homes, "--json")
    verdicts = [json.loads(line) for line in output.splitlines()]
    assert code == 1
    assert {it["submission"]: it["passes"] for it in verdicts} == {"honest": True, "key": False}
    assert verdicts[1]["refusals"][0].keys() == {"check", "reason"}


def test_the_page_has_what_passes_alone(run_board, sent, homes, tmp_path):
    page = tmp_path / "page.html"
    code, output, err = run_board("page", sent, "--data", homes, "--out", page)
    assert (code, output) == (1, "")
    assert "1 rows, " in err and "1 refused" in err
    text = page.read_text()
    assert "lab/model" in text
    assert "lab/key" not in text
    assert "1 submission was refused" in " ".join(text.split())


def test_no_published_rows(run_board, sent, homes, tmp_path):
    page = tmp_path / "page.html"
    code, _, _ = run_board(
        "page", sent / "honest", "--data", homes, "--out", page, "--no-published"
    )
    assert code == 0
    assert 'class="published"' not in page.read_text()


@pytest.mark.parametrize(
    ("typed", "expected"),
    [
        (["chek"], "did you mean 'check'?"),
        (["check", "none"], "no such folder"),
        (["check", "SENT", "--allow", "frame"], "did you mean 'frames'?"),
        (["check", "SENT", "--allow", "key", "--allow", "set"], "--allow is given twice; give it"),
        (["check", "SENT", "--key", "."], "no key.json"),
    ],
)
def test_misuse(run_board, sent, tmp_path, monkeypatch, typed, expected):
    monkeypatch.chdir(tmp_path)
    words = (sent if word == "SENT" else word for word in typed)
    assert_refused(run_board(*words), expected, program="infthor-board")


# -- a private set


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

    monkeypatch.setattr(private_sets, "generate_with_workers", generate)
    monkeypatch.setattr(private_sets, "select", lambda _paths: None)
    monkeypatch.setattr(private_sets, "make_twins", make_twins)
    return made


@pytest.fixture
def secret(tmp_path):
    path = tmp_path / "secret.txt"
    path.write_text(SECRET)
    return path


def test_a_set_from_a_secret(run_board, made, secret, tmp_path):
    out = tmp_path / "out"
    code, output, err = run_board("private-set", "--seed-file", secret, "--out", out)
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


def test_homes_steps_and_edits_follow_from_the_secret_alone(run_board, made, secret, tmp_path):
    other = tmp_path / "other.txt"
    other.write_text("0" * 64)
    for name, path in (("a", secret), ("b", secret), ("c", other)):
        run_board("private-set", "--seed-file", path, "--out", tmp_path / name, "--homes", 4)
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


def test_a_home_without_twins_is_named(run_board, made, secret, tmp_path):
    made.failures.append("kitchen: no plan")
    code, output, err = run_board("private-set", "--seed-file", secret, "--out", tmp_path / "out")
    assert code == 1
    assert "to publish" in output
    assert "left out: kitchen: no plan" in err


def test_some_kinds_alone(run_board, made, secret, tmp_path):
    run_board(
        "private-set", "--seed-file", secret, "--out", tmp_path / "out", "--kinds", "move,swap"
    )
    assert made.settings[0].kinds == ("move", "swap")
    ended = run_board(
        "private-set", "--seed-file", secret, "--out", tmp_path / "b", "--kinds", "mov"
    )
    assert_refused(ended, "did you mean 'move'?", program="infthor-board")


def test_what_is_no_secret(run_board, tmp_path):
    secret = tmp_path / "secret.txt"
    secret.write_text("42")
    ended = run_board("private-set", "--seed-file", secret, "--out", tmp_path / "out")
    words = ("32 to 256 hexadecimal digits", "openssl rand -hex 32")
    assert_refused(ended, *words, program="infthor-board")
