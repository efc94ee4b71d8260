"""Causes planted between two runs, and what `explain` names."""

import io
import json
import re
import shutil
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from infthor_eval.cli import main
from model_adapters.tiny.qwen2_5_vl import save_tiny_checkpoint

from ...helpers.command_line import assert_refused, option_words, read_success
from ...helpers.journals import write_run
from ...helpers.nieh_runs import make_record
from ...helpers.plan_runs import make_plan_record, make_plans_run

TASKS = {
    "my_last_1k": "{context: truncate_head, ctx_size: 1, bundled: nieh_mini}",
    "my_last_2k": "{context: truncate_head, ctx_size: 2, bundled: nieh_mini}",
    "my_last_1k_of_data": "{context: truncate_head, ctx_size: 1}",
    "my_penalty": "{context: clues, bundled: nieh_mini}\n"
    "generation_kwargs: {until: [], max_gen_toks: 50, temperature: 0.0, repetition_penalty: 1.3}",
    "my_short": "{context: clues, bundled: nieh_mini}\n"
    "generation_kwargs: {until: [], max_gen_toks: 20, temperature: 0.0}",
}
MOST = re.compile(r"Most (?:is|can be) explained by ([^:(]+?)[:(\n]")
SHUFFLED = {"tasks": "nieh_mini_gt", "limit": 4, "frames": "shuffled"}


@pytest.fixture(scope="module")
def tasks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with task files of one's own."""
    folder = tmp_path_factory.mktemp("tasks")
    for name, content in TASKS.items():
        (folder / f"{name}.yaml").write_text(
            f"include: _nieh.yaml\ntask: {name}\ndataset_kwargs: {content}\n"
        )
    return folder


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, tasks: Path) -> Callable[..., Path]:
    """Runs the tiny model, once for equal options; returns the folder of the run."""
    done: dict[str, Path] = {}

    def run(**changes: object) -> Path:
        options = {"model": "qwen2.5-vl-tiny", "tasks": "nieh_mini_gt", "limit": 3} | changes
        if str(options) not in done:
            output = tmp_path_factory.mktemp("run")
            words = option_words(**options, out=output, include_path=tasks)
            with redirect_stdout(io.StringIO()), pytest.raises(SystemExit) as ended:
                main([*words, "--quiet"])
            assert ended.value.code == 0
            (journal,) = output.rglob("journal")
            done[str(options)] = journal.parent
        return done[str(options)]

    return run


def edited(folder: Path, to: Path, edit: Callable[[list[dict[str, Any]]], None]) -> Path:
    """A copy of a run whose journal's lines are changed."""
    shutil.copytree(folder, to)
    path = to / "journal" / "worker-0.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    requests = [line for line in lines if line["type"] == "artifact"]
    lines = [line for line in lines if line not in requests]
    edit(lines)
    path.write_text("".join(json.dumps(line) + "\n" for line in (*lines, *requests)))
    return to


def most(out: str) -> str:
    (name,) = MOST.findall(out)
    return name.strip()


@pytest.mark.parametrize(
    ("first", "second", "cause", "setting"),
    [
        ({}, {"model_args": "max_pixels=50000"}, "the size of images", "longest_edge"),
        ({}, {"model_args": "prompt=plain"}, "the chat template or system prompt", "model.prompt"),
        ({}, {"model_args": "dtype=bfloat16"}, "the precision", "model.dtype"),
        ({}, {"tasks": "my_penalty"}, "the repetition penalty", "decoding.repetition_penalty"),
        ({}, {"tasks": "my_short"}, "where replies end", "decoding.max_new_tokens"),
        ({"temperature": 1}, {}, "the temperature", "decoding.temperature"),
        ({"limit": 4}, SHUFFLED, "the frame ablation", "frames"),
        ({"tasks": "my_last_1k"}, {"tasks": "my_last_2k"}, "the context or its window", "ctx_size"),
        ({}, {"limit": 2}, "which questions are asked", "limit"),
        ({}, {"model": "blind"}, "the model", "model.name"),
    ],
)
def test_a_planted_cause_is_named(run, run_cli, first, second, cause, setting):
    code, out, err = run_cli("explain", run(**first), run(**second))
    assert (code, err) == (1, "")
    assert most(out) == cause
    assert setting in out.split("Where")[0]


def test_another_version_of_ones_own_file_is_named(run, run_cli, tmp_path):
    runs = []
    for reply in ("yes", "no"):
        file = tmp_path / reply / "mine.py"
        file.parent.mkdir()
        file.write_text(f"def answer(images, text):\n    return {reply!r}\n")
        runs.append(run(model=f"{file}:answer"))
    assert most(run_cli("explain", *runs)[1]) == "the file or package that the model comes from"


def test_the_seed_and_a_truncated_context_are_named(run, run_cli, make_nieh_set):
    """All questions of a set are asked: the seed draws those of a limit too."""
    data = make_nieh_set(size=300, n_frames=12)
    whole = {"tasks": "nieh_full", "data": data, "limit": 5}
    drawn = [run(**whole, temperature=1, seed=seed) for seed in (0, 1)]
    assert most(run_cli("explain", *drawn)[1]) == "the seed"
    _, out, _ = run_cli("explain", run(**whole), run(**whole | {"tasks": "my_last_1k_of_data"}))
    assert most(out) == "the context or its window"
    assert "tasks.*.config.dataset_kwargs.context is trajectory in A, truncate_head in B" in out


def test_a_missing_system_prompt_is_told_from_the_same_weights(run, run_cli, tmp_path):
    folders = [tmp_path / name / "checkpoint" for name in ("with", "without")]
    for folder in folders:
        save_tiny_checkpoint(folder, 0)
    (template,) = folders[1].glob("chat_template*")
    text = template.read_text()
    system = re.search(r"\{\{- '<\|im_start\|>system.*?-\}\}", text)
    assert system is not None
    template.write_text(text.replace(system[0], ""))
    runs = [run(model="qwen2.5-vl", model_args=f"pretrained={it},dtype=float32") for it in folders]
    code, out, _ = run_cli("explain", *runs)
    assert (code, most(out)) == (1, "the chat template or system prompt")
    assert "As much may be explained by: the checkpoint's files." in out


def test_frames_as_jpeg_are_told_by_the_set_and_frames_of_one_size_by_hashes(
    run, run_cli, make_nieh_set
):
    """The set's digest has the sizes of frames, and each record the digests of its own."""
    numbers = np.random.default_rng(0)
    data = [make_nieh_set(size=56, name=name) for name in ("png", "jpeg", "other")]
    for path in sorted(data[0].rglob("*.png")):
        pixels = numbers.integers(0, 256, (56, 56, 3), dtype=np.uint8)
        jpeg = io.BytesIO()
        Image.fromarray(pixels).save(jpeg, "JPEG", quality=20)
        place = path.relative_to(data[0])
        for root, picture in zip(
            data, (pixels, np.asarray(Image.open(jpeg)), 255 - pixels), strict=True
        ):
            # Uncompressed, so that the frames of one size are files of one size.
            Image.fromarray(picture).save(root / place, "PNG", compress_level=0)
    for path in data[1].rglob("*.png"):
        Image.open(path).save(path, "PNG")
    runs = [run(tasks="nieh_gt", data=root) for root in data]
    assert most(run_cli("explain", runs[0], runs[1])[1]) == "the question set or its frames"
    _, out, _ = run_cli("explain", runs[0], runs[2])
    assert most(out) == "frames or words that no setting accounts for"
    assert "the content of the frames, or the words, changed" in out


def test_other_tokens_and_other_pixels_of_the_same_request_are_told_by_their_hashes(
    run, run_cli, tmp_path
):
    """As many tokens as before, and settings that are equal: the hashes alone tell."""

    def change(name: str) -> Callable[[list[dict[str, Any]]], None]:
        def edit(lines: list[dict[str, Any]]) -> None:
            for line in lines[1:]:
                line["read"][name] = "00000000"
                line["payload"]["reply"] = "another"

        return edit

    for name, cause in (("context", "tokens"), ("frames", "pixels")):
        other = edited(run(), tmp_path / name, change(name))
        assert most(run_cli("explain", run(), other)[1]) == f"{cause} that no setting accounts for"


def test_near_ties_alone_have_an_exit_code_of_their_own(run, run_cli, tmp_path):
    with_margins = run(model_args="margins=true")

    def tie(margin: float) -> Callable[[list[dict[str, Any]]], None]:
        def edit(lines: list[dict[str, Any]]) -> None:
            for line in lines[1:]:
                payload = line["payload"]
                payload["reply"] += "s"
                payload["reply_ids"][4] += 1
                payload["margins"][4] = margin

        return edit

    close, near, far = (
        edited(with_margins, tmp_path / f"{margin}", tie(margin)) for margin in (0.01, 0.02, 0.9)
    )
    code, out, _ = run_cli("explain", close, edited(near, tmp_path / "again", tie(0.02)))
    assert code == 3
    assert "Near ties: all of these" in out
    assert "0.020" in out
    code, out, _ = run_cli("explain", close, edited(far, tmp_path / "far again", tie(0.9)))
    assert code == 1
    assert "Near ties" not in out


def test_another_revision_is_named(run, run_cli, tmp_path):
    def revise(revision: str) -> Callable[[list[dict[str, Any]]], None]:
        def edit(lines: list[dict[str, Any]]) -> None:
            lines[0]["config"]["model"]["revision"] = revision
            for line in lines[1:]:
                line["payload"]["reply"] = f"the reply of {revision}"

        return edit

    runs = [edited(run(), tmp_path / name, revise(name)) for name in ("old", "new")]
    code, out, _ = run_cli("explain", *runs)
    assert (code, most(out)) == (1, "the model's revision")
    assert "model.revision is old in A, new in B (3 of the 3 questions that differ, +0.00)." in out


def test_settings_that_one_engine_alone_has_are_the_engine(run, run_cli, tmp_path):
    def in_vllm(lines: list[dict[str, Any]]) -> None:
        model = lines[0]["config"]["model"]
        del model["share_prefix"]
        model.update(name=f"{model['name']}@vllm", engine="vllm", max_frames=40)
        for line in lines[1:]:
            line["payload"]["reply"] = "another reply"

    code, out, _ = run_cli("explain", run(), edited(run(), tmp_path / "vllm", in_vllm))
    assert (code, most(out)) == (1, "the engine")
    assert "As much may be explained" not in out
    listed = out.split("What differs")[1].split("Where")[0]
    assert all(f"model.{name}" in listed for name in ("share_prefix", "max_frames"))


def test_a_scorer_is_named_and_carries_what_it_changes(source, rescore, run_cli):
    records = [
        make_record(0, "Sofa", ("Sofa",), scores={"reference": 1.0, "strict": 0.0}),
        make_record(1, "Bed", ("Bed",)),
    ]
    folder = source(records, n_samples=2)
    _, _, again = rescore(folder)
    code, out, _ = run_cli("explain", folder, again)
    assert (code, most(out)) == (1, "the scorer")
    assert "0 of 2 replies differ, 1 equal reply scored otherwise" in out
    assert "strict is 50.00 in A, 100.00 in B (+50.00)." in out
    assert "(1 of the 1 questions that differ, +50.00)." in out


def test_what_questions_carry_adds_up_to_the_difference(source, run_cli, tmp_path):
    """Of 1, 0, 1 strict in A, B has 0 and 0: 50 points by the first, the rest by the missing."""

    def drop(lines: list[dict[str, Any]]) -> None:
        lines[1]["payload"] |= {"reply": "Bed", "scores": {"reference": 0.0, "strict": 0.0}}
        del lines[3]

    records = [make_record(number, reply) for number, reply in enumerate(("mug", "cup", "mug"))]
    first = source(records, n_samples=3)
    code, out, _ = run_cli("explain", first, edited(first, tmp_path / "b", drop))
    assert (code, most(out)) == (1, "nothing that is recorded")
    assert "strict is 66.67 in A, 0.00 in B (-66.67)." in out
    assert "Also: questions that one run did not come to (1 of the 2 questions that" in out
    where = out.split("Where")[1].splitlines()
    assert [line.split()[-1] for line in where if "not in the run" in line] == ["-16.67"]
    assert [line.split()[-7:] for line in where if "Bed" in line] == [
        ["Bed", "1", "-", "-", "100.00", "0.00", "-50.00"]
    ]


def test_a_failed_request_is_told_with_its_reason_and_what_it_carries(run, run_cli, tmp_path):
    def fail(lines: list[dict[str, Any]]) -> None:
        lines[1]["failure"] = "the server said 500"
        del lines[1]["payload"]["reply"], lines[1]["payload"]["scores"]

    code, out, _ = run_cli("explain", run(), edited(run(), tmp_path / "failed", fail))
    assert (code, most(out)) == (1, "questions that failed or were not asked")
    assert "1 failed, the server said 500." in out
    assert "0 of 2 replies differ, 1 question with a result in one alone" in out


def test_what_is_not_recorded_is_said_to_be_so(run, run_cli, tmp_path):
    def say_otherwise(lines: list[dict[str, Any]]) -> None:
        for line in lines[1:]:
            line["payload"]["reply"] = line["payload"]["reply"][:7] + "\x1b[2J"

    other = edited(run(), tmp_path / "other", say_otherwise)
    code, out, _ = run_cli("explain", run(), other)
    assert (code, most(out)) == (1, "nothing that is recorded")
    assert "to see whether the model repeats itself" in out
    assert "\x1b" not in out
    rows = [line.split() for line in out.split("Where")[1].splitlines() if "+0.00" in line]
    assert [row[-6] for row in rows] == ["8", "8", "8"]


def test_equal_runs_are_equal_also_with_settings_that_make_no_difference(run, run_cli):
    out, _ = read_success(run_cli("explain", run(), run()))
    assert out.splitlines()[2] == "Equal: replies and scores of 3 questions."
    out, _ = read_success(run_cli("explain", run(), run(model_args="batch_size=1")))
    assert "Settings differ, and made no difference: other settings of the model." in out


def test_causes_that_the_records_do_not_tell_apart_are_all_named(run, run_cli):
    both = run(model_args="dtype=bfloat16", tasks="my_penalty")
    code, out, _ = run_cli("explain", run(), both)
    assert (code, most(out)) == (1, "the repetition penalty")
    assert "As much may be explained by: the precision." in out


def test_all_questions_are_shown_if_asked(run, run_cli):
    runs = (run(limit=7), run(limit=7, model_args="dtype=bfloat16"))
    few, every = (run_cli("explain", *runs, *words)[1] for words in ((), ("--all",)))
    n_hidden = int(few.partition(" more differ: --all shows them.")[0].rsplit(maxsplit=1)[-1])
    assert n_hidden > 0 and "more differ" not in every
    assert every.count("+0.00  ") == few.count("+0.00  ") + n_hidden


def test_runs_that_cannot_be_explained_are_refused(run, run_cli, tmp_path, make_nieh_set):
    plans = write_run(make_plans_run("p", [make_plan_record("a", 0, (0, 1), 4.4)]), tmp_path)
    assert_refused(run_cli("explain", plans, plans), "no replies to compare")
    assert_refused(run_cli("explain", run(), plans), "give runs of one suite")
    other = run(model="blind", tasks="nieh_gt", data=make_nieh_set(size=56))
    assert_refused(run_cli("explain", run(), other), "share no question of one task")
