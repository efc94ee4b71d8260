"""`infthor-eval private-set`, as it is typed."""

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.replies.answer_key import read_key
from tests.helpers.command_line import assert_refused


def test_a_set_from_a_secret(run_cli, tmp_path):
    (tmp_path / "secret.txt").write_text("5eed" * 16)
    out = tmp_path / "out"
    code, output, err = run_cli(
        "private-set", "--seed-file", tmp_path / "secret.txt", "--out", out, "--homes", 1,
        "--min-steps", 60, "--per-trajectory", 4,
    )  # fmt: skip
    assert code == 0, err
    assert f"to publish: {out / 'public'}" in output
    assert f"to keep secret: {out / 'key'}" in output
    public = NiehSet(out / "public")
    key = read_key(out / "key")
    assert len(public.questions) == len(key.data.questions) == len(key.ids) > 0
    assert all(key.question(question.id).pair for question in public.questions)
    # Neither the homes nor the steps can be made again by who tries out small numbers.
    scenes = {pair.floor_plan for pair in key.data.twins.values()}
    assert all(int(scene.rpartition("-")[2]) > 2**40 for scene in scenes)
    assert "5eed5eed" not in output + err
    assert (out / "key").stat().st_mode & 0o077 == 0


def test_what_is_no_secret(run_cli, tmp_path):
    (tmp_path / "secret.txt").write_text("42")
    ended = run_cli(
        "private-set", "--seed-file", tmp_path / "secret.txt", "--out", tmp_path / "out"
    )
    assert_refused(ended, "32 to 256 hexadecimal digits", "openssl rand -hex 32")
