"""Code of one's own that does what it should not: one failed unit, or one line and exit code 2."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.records import RECORDS
from infthor_eval.runs import read_run
from infthor_eval.storage.files import file_name
from infthor_eval.storage.limits import OWN_CODE_SECONDS
from model_adapters.policies.parity import load_policy

from ..helpers.command_line import read_success
from ..helpers.journals import write_journal
from ..helpers.nieh_runs import make_config, make_header, make_record
from ..helpers.processes import run_python
from ..model_adapters.policies.servers import policy_answers, serve

MODEL = """
from dataclasses import dataclass
from model_adapters import Capabilities, Reply, Transcript

class Odd(BaseException):
    pass

@dataclass(frozen=True)
class Options:
    pass

n_replies = 0

class Talk(Transcript):
    n_tokens = None
    def reply(self, decoding):
        global n_replies
        n_replies += 1
        print("a print of mine")
        REPLY
        return Reply("Yes.")

class Own:
    Options, capabilities = Options, Capabilities(counts_tokens=False, token_ids=False)
    name = "own"
    @classmethod
    def build(cls, name, options, seed):
        return cls()
    def identity(self):
        return IDENTITY
    def tokens_per_frame(self, frame):
        return None
    def conversation(self):
        return Talk()
    def close(self):
        CLOSE
"""
RAISES = (
    "raise SystemExit(0)",
    "raise GeneratorExit",
    "raise Odd('x')",
    "import sys; sys.exit()",
    "import os; os._exit(0)",
)
Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run_own(tmp_path: Path, run_cli: Run) -> Run:
    """Runs a model of one's own on three questions."""

    def run_own(*more: object, reply: str = "", identity: str = "{}", close: str = "") -> Any:
        source = MODEL.replace("REPLY", reply or "pass").replace("IDENTITY", identity)
        (tmp_path / "own.py").write_text(source.replace("CLOSE", close or "pass"))
        typed = ("--model", f"{tmp_path / 'own.py'}:Own", "--tasks", "nieh_mini_gt", "--limit", 3)
        return run_cli("run", *typed, "--out", tmp_path / "out", *more)

    return run_own


@pytest.fixture
def rescored_by(tmp_path: Path) -> Callable[[str], tuple[object, ...]]:
    """Writes a scorer `own` and a run; gives the words that score the run by it."""

    def rescored_by(source: str) -> tuple[object, ...]:
        scorer, run = tmp_path / "mine.py", tmp_path / "run"
        scorer.write_text(source)
        write_journal(run, make_header(make_config()), [make_record(0, "mug")], RECORDS)
        return "rescore", run, "--scorer", f"{scorer}:own", "--output", tmp_path / "out"

    return rescored_by


@pytest.mark.parametrize("statement", RAISES)
def test_an_adapter_that_ends_the_program_fails_its_unit_alone(run_own, tmp_path, statement):
    code, out, err = run_own(reply=f"if n_replies == 2: {statement}")
    assert code == 1
    assert "Traceback" not in err
    assert "own fails on the request (" in err
    (folder,) = (tmp_path / "out").glob("*/*")
    records = read_run(folder, RECORDS)[1]
    assert sorted(record.failure is not None for record in records) == [False, False, True]
    assert "nieh_mini_gt" in out


@pytest.mark.parametrize("statement", ["os._exit(0)", "raise SystemExit(0)"])
def test_a_scorer_that_ends_the_program_fails_its_sample_alone(run_cli, rescored_by, statement):
    code, _, err = run_cli(*rescored_by(f"import os\ndef own(reply, answers): {statement}\n"))
    assert code == 1
    assert "1 sample(s) failed" in err
    assert "own fails: SystemExit in " in err
    assert statement.startswith("raise") or ("own_code.py" in err and statement in err)


def test_a_forked_process_ends_as_it_wants(run_cli, rescored_by):
    words = rescored_by(
        "import multiprocessing\nfork = multiprocessing.get_context('fork')\n"
        "def own(reply, answers):\n"
        "    child = fork.Process(target=int)\n    child.start()\n    child.join()\n"
        "    return 1.0 - child.exitcode\n"
    )
    code, out, err = run_cli(*words)
    assert (code, "own" in out) == (0, True), err


@pytest.mark.parametrize("is_daemon", [False, True])
def test_a_thread_that_is_left_does_not_keep_the_process(rescored_by, is_daemon):
    words = rescored_by(
        "import threading, time\ndef own(reply, answers):\n"
        f"    threading.Thread(target=time.sleep, args=(9**9,), daemon={is_daemon}).start()\n"
        "    return 1.0\n"
    )
    program = "from infthor_eval.cli import main; main()"
    done = run_python(program, *words, env={**os.environ, OWN_CODE_SECONDS.name: "1"})
    assert done.returncode == 0, done.stderr
    assert "100.00" in done.stdout
    assert ("your own code left a thread that runs on" in done.stderr) is not is_daemon


@pytest.mark.parametrize("statement", ["raise SystemExit(0)", "raise ValueError('x')", "1 / 0"])
def test_a_close_that_fails_is_one_line_below_the_results(run_own, statement):
    code, out, err = run_own(close=statement)
    assert code == 2
    assert "nieh_mini_gt" in out
    assert sum("close() fails" in line for line in err.splitlines()) == 1
    assert "Traceback" not in err


@pytest.mark.parametrize("endless", ["while True: pass", "import time; time.sleep(600)"])
def test_a_close_that_does_not_end_is_one_line_below_the_results(run_own, monkeypatch, endless):
    monkeypatch.setenv(OWN_CODE_SECONDS.name, "1")
    code, out, err = run_own(close=endless)
    assert code == 2
    assert "nieh_mini_gt" in out
    assert (
        f"close() fails: it is not done after 1 s; if this is intended, set {OWN_CODE_SECONDS.name}"
        in (" ".join(err.split()))
    )
    assert "Traceback" not in err


@pytest.mark.parametrize(
    "typed",
    [
        ("run", "--tasks", "nieh_mini_gt", "--limit", 1, "--model"),
        ("run", "--model", "blind", "--tasks", "nieh_mini_memory", "--budget", 200, "--memory"),
        ("check", "adapter"),
        ("check", "memory"),
        ("check", "parity", "--reference-url", "http://127.0.0.1:9"),
    ],
    ids=lambda typed: typed[-1],
)
def test_a_file_whose_import_does_not_end_is_one_line(run_cli, tmp_path, monkeypatch, typed):
    monkeypatch.setenv(OWN_CODE_SECONDS.name, "1")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.py").write_text(f"# {typed[0]} {typed[-1]}\nimport time\ntime.sleep(600)\n")
    code, out, err = run_cli(*typed, f"{tmp_path / 'own.py'}:Own")
    assert (code, out) == (2, "")
    assert "fails when it is imported: it is not done after 1 s" in " ".join(err.split())
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("identity", "words"),
    [
        ("{'rate': float('nan')}", "identity()['rate'] is nan"),
        ("{'a': {'b': [1, {2}]}}", "identity()['a']['b'][1] is a set"),
        ("{'model': object()}", "identity()['model'] is a object"),
        ("{'f': len}", "identity()['f'] is a builtin_function_or_method"),
        ("{1: 2}", "identity() has the key 1"),
        ("{'text': '\\ud800'}", "identity()['text'] is '\\ud800'"),
        ("None", "own: "),
    ],
)
def test_an_identity_that_is_no_json_is_refused_with_the_fields_name(run_own, identity, words):
    code, out, err = run_own(identity=identity)
    assert (code, out) == (2, "")
    assert words in err
    assert "Traceback" not in err


def test_what_own_code_prints_is_not_among_the_results(run_own):
    code, out, err = run_own("--json")
    assert code == 0
    assert json.loads(out)[0]["suite"] == "nieh"
    assert "a print of mine" in err


@pytest.mark.parametrize(
    "parts",
    [{"reply": "raise SystemExit(0)"}, {"close": "raise SystemExit(0)"}, {"identity": "exit(0)"}],
)
def test_check_adapter_never_ends_well_after_a_failure(run_own, run_cli, tmp_path, parts):
    run_own(**parts)
    code, _, err = run_cli("check", "adapter", f"{tmp_path / 'own.py'}:Own")
    assert code in (1, 2)
    assert "Traceback" not in err


POLICY = """
from dataclasses import dataclass
from model_adapters import ArmDelta

@dataclass(frozen=True)
class Options:
    pass

class Own:
    Options = Options
    name = "own"
    chunk_size = 1
    @classmethod
    def build(cls, name, options, seed):
        return cls()
    def identity(self):
        return {}
    def reset(self):
        pass
    def act(self, frame, instruction):
        ACT
        return [ArmDelta((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0)]
    def close(self):
        CLOSE
"""


@pytest.mark.parametrize(
    ("act", "close"),
    [("raise SystemExit(0)", "pass"), ("pass", "raise SystemExit(0)"), ("return None", "pass")],
)
def test_check_parity_never_ends_well_after_a_failure(run_cli, tmp_path, act, close):
    source = POLICY.replace("ACT", act).replace("CLOSE", close)
    (tmp_path / "own.py").write_text(source)
    with serve(policy_answers(load_policy("openvla-tiny", {}))) as url:
        name = f"{tmp_path / 'own.py'}:Own"
        code, _, err = run_cli("check", "parity", name, "--reference-url", url)
    assert code in (1, 2)
    assert "Traceback" not in err
    assert "own" in err


MEMORY = """
from infthor_eval.memory import MemoryCapabilities

class Own:
    capabilities = MemoryCapabilities()
    def __init__(self):
        INIT
    def identity(self):
        return {}
    def begin(self, facts):
        self.steps = []
    def observe(self, observation):
        self.steps.append(observation)
    def recall(self, query, budget):
        RECALL
        return []
"""


@pytest.mark.parametrize(
    ("begin", "recall"),
    [
        ("raise SystemExit(0)", "pass"),
        ("pass", "raise SystemExit(0)"),
        ("self.capabilities = None", "pass"),
    ],
)
def test_check_memory_never_ends_well_after_a_failure(run_cli, tmp_path, begin, recall):
    (tmp_path / "own.py").write_text(MEMORY.replace("INIT", begin).replace("RECALL", recall))
    code, _, err = run_cli("check", "memory", f"{tmp_path / 'own.py'}:Own")
    assert code in (1, 2)
    assert "Traceback" not in err


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    """A run of two questions that has the worst name."""
    config = make_config(model="m", checkpoint=None, n_parameters=None)
    config["tasks"]["nieh_gt"]["n_samples"] = 2
    records = [make_record(n, "Sofa", ("Sofa",)) for n in range(2)]
    return write_journal(
        tmp_path / "in" / "run", make_header(config, "../../evil"), records, RECORDS
    )


# -- what comes from elsewhere


def test_no_name_of_a_run_writes_outside_the_output(stored, run_cli, tmp_path):
    output = tmp_path / "a" / "b" / "out"
    assert run_cli("rescore", stored, "--out", output)[0] == 0
    (folder,) = output.iterdir()
    assert folder.name.startswith("_.._evil-rescored-")
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["b"]
    assert [path.name for path in (tmp_path / "a" / "b").iterdir()] == ["out"]


def test_a_line_of_an_older_version_is_named_and_the_rest_is_shown(stored, run_cli, tmp_path):
    """Seconds of NaN were written as null."""
    path = stored / "journal" / "worker-0.jsonl"
    header, first, second = path.read_bytes().splitlines()
    bad = first[:-1] + b',"seconds":null}'
    path.write_bytes(b"\n".join([header, bad, second]) + b"\n")
    commands = (
        ("show", stored),
        ("show", stored, "--per-sample", "--format", "csv"),
        ("compare", stored, stored),
        ("report", stored, "--out", tmp_path / "page.html"),
        ("rescore", stored, "--out", tmp_path / "out"),
    )
    for command in commands:
        _, err = read_success(run_cli(*command))
        assert f"left out: {path}, line 2: not a line of a journal" in "".join(err.split("\n"))
    assert [record.id for record in read_run(stored, RECORDS, lambda _: None)[1]] == ["q1"]


def test_no_name_of_a_model_writes_outside_the_output(make_nieh_set, run_cli, tmp_path):
    data = make_nieh_set(size=56)
    question = NiehSet(data).questions[0].id
    log = tmp_path / "log.jsonl"
    log.write_text(json.dumps({"question_id": question, "reply": "mug"}))
    output = tmp_path / "a" / "out"
    typed = ("--data", data, "--model", "../../evil", "--out", output)
    assert run_cli("import-replies", log, *typed)[0] == 0
    assert [path.name for path in output.iterdir()] == [file_name("../../evil")]
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["out"]
