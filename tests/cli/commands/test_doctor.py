"""`doctor`: what is installed and what is missing, with a hint, and no token in it."""

import json
import time
from types import SimpleNamespace

import pytest
from PIL import Image

from infthor_eval.cli.commands import doctor as checks
from infthor_eval.cli.commands.doctor import Check
from infthor_eval.formats.question import Question

from ...helpers.bundled import BUNDLED
from ...helpers.command_line import assert_refused, read_success
from ...helpers.questions import make_question

TOKEN = "hf_of_nobody_0123456789"


@pytest.fixture(autouse=True)
def offline(monkeypatch):
    """The hub takes its time, as where a name cannot be looked up."""
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_OFFLINE", False)
    monkeypatch.setattr(checks, "_HUB_TIMEOUT_S", 0.1)
    monkeypatch.setattr(checks, "_connection_problem", lambda url: time.sleep(5) or "")


def test_everything_is_checked_and_what_is_missing_has_a_hint(run_cli, monkeypatch):
    monkeypatch.setenv("HF_TOKEN", TOKEN)
    code, out, err = run_cli("doctor", "--json")
    assert (code, err) == (0, "")
    by_name = {check["name"]: check for check in json.loads(out)}
    assert set(by_name) >= {
        *("Python", "torch", "memory", "embedded simulator", "AI2-THOR", "display", "hub token"),
        *("hub", "disk, here", "disk, cache", "NIEH data"),
        *(f"extra {name}" for name in checks._EXTRAS),
    }
    assert all(check["hint"] for check in by_name.values() if check["state"] != "ok")
    assert by_name["hub"]["detail"].endswith("cannot be reached (no answer in 0.1 s)")
    token = {"name": "hub token", "state": "ok", "detail": "stored", "hint": ""}
    assert by_name["hub token"] == token
    assert "fetch nieh" in by_name["NIEH data"]["hint"]
    assert TOKEN not in out


@pytest.mark.parametrize(("n_gpus", "hinted"), [(1, False), (4, True)])
def test_several_gpus_are_for_several_workers_or_one_model_that_is_split(
    n_gpus, hinted, monkeypatch
):
    card = SimpleNamespace(name="A card", total_memory=80e9)
    monkeypatch.setattr("torch.cuda.is_available", lambda: True)
    monkeypatch.setattr("torch.cuda.device_count", lambda: n_gpus)
    monkeypatch.setattr("torch.cuda.get_device_properties", lambda number: card)
    check = checks._torch()
    assert check.state == "ok"
    assert check.detail.endswith(("4 GPUs: " if hinted else "") + "A card, 80 GB")
    words = ("--workers 4 puts a model on each", "--engine vllm", "tensor_parallel_size=4")
    assert all(text in check.hint for text in words) if hinted else not check.hint


def test_people_read_lines(run_cli):
    out, _ = read_success(run_cli("doctor"))
    assert any(line.startswith("ok       Python: 3.") for line in out.splitlines())
    assert "`infthor-eval fetch nieh`" in out


def test_a_missing_requirement_sets_the_exit_code(run_cli, monkeypatch):
    monkeypatch.setattr(
        checks, "_torch", lambda: Check("torch", "wrong", "none", "pip install torch")
    )
    code, out, _ = run_cli("doctor")
    assert code == 1
    assert "wrong    torch: none\n         pip install torch" in out


@pytest.mark.parametrize("url", ["http://localhost:9", "no address"])
def test_a_hub_that_refuses_is_reported_at_once(url, monkeypatch):
    monkeypatch.undo()
    assert checks._connection_problem(url)


def checks_of(run_cli, *words):
    code, out, err = run_cli("doctor", *words, "--json")
    assert err == ""
    return code, {check["name"]: check for check in json.loads(out)}


def test_a_set_is_read_whole_and_what_can_be_asked_is_said(run_cli):
    code, by_name = checks_of(run_cli, "--data", str(BUNDLED))
    assert code == 0
    rows = (BUNDLED / "qa_set_nieh_mini.csv").read_text().count("\n") - 1
    assert by_name["questions qa_set_nieh_mini"]["detail"].startswith(f"{rows}: object_presence")
    assert by_name["trajectories"]["detail"].startswith("6 of 6 can be read")
    assert by_name["pictures"]["detail"] == "in img; 300x300 pixels"
    assert by_name["step logs"]["detail"] == "a list of entries"
    assert by_name["task nieh_full"]["detail"] == f"{rows} of {rows} samples can be asked"
    assert "the window reaches outside" in by_name["task nieh_haystack_1m"]["hint"]
    assert "left out" not in by_name


def test_what_a_set_lacks_is_counted_by_reason(run_cli, make_nieh_set):
    complete = Question("t", "Have you seen a mug?", (1,), ("yes",))
    root = make_nieh_set([complete, make_question(clues=(99,)), make_question(clues=(98,))])
    (root / "metadata" / "other").mkdir()
    (root / "qa_set_x.csv").write_text(
        "traj_id,question,gt_img_idx,answer\ngone,q,[1],['a']\nt,q,[1,['a']\n"
    )
    (root / "metadata" / "t" / "expert_log.json").unlink(missing_ok=True)
    code, by_name = checks_of(run_cli, "--data", str(root))
    assert code == 0
    assert by_name["rows"]["detail"].startswith("1 are no question: ")
    assert "3 questions: " in by_name["left out"]["detail"]
    assert "trajectory gone is not in metadata/ (1)" in by_name["left out"]["detail"]
    assert by_name["trajectories"]["detail"].startswith("1 of 2 can be read")
    assert by_name["trajectories"]["detail"].endswith("; 1 more without a question")
    assert by_name["unreadable trajectories"]["detail"] == "1 cannot be read"
    assert by_name["task nieh_gt"]["detail"] == "1 of 5 samples can be asked"


def test_pictures_that_are_converted_are_counted_by_kind(run_cli, tmp_path):
    turned = Image.Exif()
    turned[0x0112] = 6
    plain = Image.new("RGB", (30, 20), "red")
    for number in range(2):
        plain.save(tmp_path / f"{number}.png", exif=turned)
    Image.new("I;16", (30, 20), 40_000).save(tmp_path / "2.png")
    plain.save(tmp_path / "3.jpg")
    (tmp_path / "4.png").write_bytes(b"no picture")
    (tmp_path / "questions.csv").write_text("question,answer\nWhat is it?,red\n")
    _, by_name = checks_of(run_cli, "--data", str(tmp_path))
    assert by_name["pictures"]["detail"].endswith(
        "20x30 pixels; converted for models, as a browser shows them: EXIF orientation 6 (2); "
        "16-bit grey (1)"
    )


def test_a_set_of_which_nothing_can_be_asked_sets_the_exit_code(run_cli, make_nieh_set):
    root = make_nieh_set([make_question(clues=(99,))])
    code, by_name = checks_of(run_cli, "--data", str(root))
    assert code == 1
    assert by_name["questions"]["detail"] == "none can be asked"


def test_question_files_alone_have_no_frames(run_cli, tmp_path):
    (tmp_path / "qa_set_x.csv").write_text("traj_id,question,gt_img_idx,answer\nt,q,[1],['a']\n")
    code, by_name = checks_of(run_cli, "--data", str(tmp_path))
    assert code == 0
    assert "metadata.tar" in by_name["frames"]["hint"]
    assert checks_of(run_cli, "--data", str(tmp_path / "qa_set_x.csv")) == (code, by_name)


def test_what_is_no_set_is_one_line(run_cli, tmp_path):
    assert_refused(run_cli("doctor", "--data", str(tmp_path)), "qa_set")
    assert_refused(run_cli("doctor", "--trajectories", str(tmp_path)), "--data", after_notes=True)
