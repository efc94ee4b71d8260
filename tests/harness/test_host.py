"""lm-eval as the host: its own command on our task files, with its model and with ours."""

import json
import sys
from pathlib import Path

import pytest

from infthor_eval.storage.folders import packaged_folder
from tests.harness.conftest import LM_EVAL, OURS_WITH_ALL_TASKS, read_samples
from tests.helpers.command_line import assert_refused, option_words

PEERS = Path(sys.prefix) / "test-peers"
SHIM = Path(__file__).parents[1] / "peers"
TASKS = packaged_folder("tasks")


@pytest.fixture
def ours(make_nieh_set, tmp_path, run_cli):
    """The set, and the samples that our own command exports of a model on it."""

    def ours(model, *options):
        data = make_nieh_set()
        arguments = option_words(
            model=model, tasks="nieh_gt,nieh_full", data=data, out=tmp_path / "ours"
        )
        code, _, err = run_cli(*arguments, *options)
        assert code == 0, err
        return data, read_samples(tmp_path / "ours")

    return ours


@pytest.mark.skipif(
    not PEERS.is_dir(), reason=f"no torchvision in {PEERS}; `make test` puts it there"
)
def test_hf_multimodal_runs_the_tasks_and_says_what_our_model_says(tmp_path, ours, start):
    from model_adapters.tiny.qwen2_5_vl import save_tiny_checkpoint

    checkpoint = tmp_path / "checkpoint"
    save_tiny_checkpoint(checkpoint, seed=0)
    data, our_samples = ours(
        "qwen2.5-vl", "--model-args", f"pretrained={checkpoint},dtype=float32,device=cpu"
    )
    arguments = [
        "--model",
        "hf-multimodal",
        "--model_args",
        f"pretrained={checkpoint},dtype=float32",
    ]
    arguments += [
        "--tasks",
        "nieh_gt,nieh_full",
        "--include_path",
        TASKS,
        "--metadata",
        json.dumps({"data": str(data)}),
    ]
    arguments += ["--apply_chat_template", "--device", "cpu", "--batch_size", 1]
    start(
        LM_EVAL,
        "run",
        *arguments,
        "--log_samples",
        "--output_path",
        tmp_path / "theirs",
        path=[SHIM, PEERS],
    )

    def replies(of):
        return {
            (task, row["doc"]["question_id"]): row["resps"][0][0]
            for task, rows in of.items()
            for row in rows
        }

    theirs = replies(read_samples(tmp_path / "theirs"))
    assert len(theirs) == 10
    assert replies(our_samples) == theirs


def test_our_model_under_lm_evals_own_command_gives_the_samples_of_our_own(tmp_path, ours, start):
    data, our_samples = ours("qwen2.5-vl-tiny")
    # Named by their files, as lm-eval 0.4.13 imports a task's functions, and so ours, before it
    # looks for the model.
    tasks = f"{TASKS / 'nieh' / 'nieh_gt.yaml'},{TASKS / 'nieh' / 'nieh_full.yaml'}"
    arguments = ["--model", "infthor", "--model_args", "adapter=qwen2.5-vl-tiny", "--tasks", tasks]
    arguments += ["--metadata", json.dumps({"data": str(data)})]
    start(LM_EVAL, "run", *arguments, "--log_samples", "--output_path", tmp_path / "theirs")
    theirs = read_samples(tmp_path / "theirs")
    assert {task: len(rows) for task, rows in theirs.items()} == {"nieh_gt": 5, "nieh_full": 5}
    assert our_samples == theirs


def test_our_command_starts_lm_evals_with_any_adapter_and_tasks_by_name(
    make_nieh_set, tmp_path, start
):
    package = tmp_path / "site"
    write_adapter(package)
    data = make_nieh_set(size=56)
    arguments = [
        "--model",
        "infthor",
        "--model_args",
        "adapter=constant,word=mug",
    ]
    arguments += ["--tasks", "nieh_gt", "--metadata", json.dumps({"data": str(data)})]
    out = tmp_path / "theirs"
    start(
        OURS_WITH_ALL_TASKS,
        "lm-eval",
        "run",
        *arguments,
        "--log_samples",
        "--output_path",
        out,
        path=[package],
    )
    (rows,) = read_samples(out).values()
    assert [row["resps"][0][0] for row in rows] == ["mug"] * 5


def test_what_lm_eval_raises_is_one_line(run_cli, monkeypatch):
    import lm_eval.tasks

    def misspelt():
        raise ValueError("Tasks not found: nieh_mni")

    monkeypatch.setattr("lm_eval.__main__.cli_evaluate", misspelt)
    monkeypatch.setattr(lm_eval.tasks, "TaskManager", lm_eval.tasks.TaskManager)
    assert_refused(
        run_cli("lm-eval", "run"),
        "lm-eval fails (Tasks not found: nieh_mni); `infthor-eval ls tasks` lists those",
    )


def test_a_file_that_a_task_includes_and_that_is_not_there_is_named(run_cli, monkeypatch, tmp_path):
    import lm_eval.tasks
    from lm_eval.tasks._yaml_loader import load_yaml

    task = tmp_path / "mine.yaml"
    task.write_text("include: _nieh.yaml\ntask: mine\n")
    monkeypatch.setattr("lm_eval.__main__.cli_evaluate", lambda: load_yaml(task))
    monkeypatch.setattr(lm_eval.tasks, "TaskManager", lm_eval.tasks.TaskManager)
    assert_refused(
        run_cli("lm-eval", "run"),
        f"lm-eval fails ({tmp_path / '_nieh.yaml'}: No such file or directory); what a task file "
        "includes stands beside it",
    )


@pytest.mark.parametrize(
    "words, said",
    [
        (("--model_args", "adapter=blind"), "blind is a baseline, not a model; run it with"),
        (("--model_args", "adapter=qwen2.5-vl-tiny,dtyp=x"), "has no option dtyp"),
        (
            ("--model_args", "adapter=qwen2.5-vl-tiny", "--metadata", '{"data": "nowhere"}'),
            "nowhere: no such folder",
        ),
    ],
)
def test_lm_evals_own_script_prints_our_errors_in_one_line(start, words, said):
    task = TASKS / "nieh" / "nieh_gt.yaml"
    err = start(LM_EVAL, "run", "--model", "infthor", *words, "--tasks", task, code=1)
    assert "Traceback" not in err
    (line,) = [line for line in err.splitlines() if line.startswith("infthor-eval: ")]
    assert said in line


def write_adapter(site):
    """An installed package with a model that has no option `device`, counts no tokens and knows no
    ids."""
    info = site / "constant-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: constant\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[infthor_eval.models]\nconstant = constant:Constant\n")
    (site / "constant.py").write_text(
        """
from dataclasses import dataclass

from model_adapters import Capabilities, Reply, Transcript


@dataclass(frozen=True)
class Options:
    word: str = "yes"


class Talk(Transcript):
    n_tokens = None

    def __init__(self, word):
        super().__init__()
        self._word = word

    def reply(self, decoding):
        return Reply(self._word)


class Constant:
    Options = Options
    capabilities = Capabilities(counts_tokens=False, token_ids=False)

    def __init__(self, name, word):
        self.name, self._word = name, word

    @classmethod
    def build(cls, name, options, seed):
        return cls(name, options.word)

    def identity(self):
        return {"word": self._word}

    def tokens_per_frame(self, frame):
        return None

    def conversation(self):
        return Talk(self._word)

    def close(self):
        pass
"""
    )
