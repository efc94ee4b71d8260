"""The runs, and what is looked at of each: a row is a case, a string the words of a command."""

import hashlib
import io
import json
import os
import re
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from http.server import BaseHTTPRequestHandler
from itertools import product
from pathlib import Path
from typing import Any

from infthor_eval.cli import main
from tests.helpers.command_line import read_remarks
from tests.model_adapters.served.talking import completion, serve_chat

ROOT = Path(__file__).parents[2]
_PORT = 18975  # the address of a served model is a part of its runs' identity
_SERVED = (
    f"--model openai --model-args base_url=http://127.0.0.1:{_PORT}/v1,model=m,max_in_flight=1"
)
_SET = f"--data {ROOT}/infthor_eval/sets/nieh_mini"
_NANO = "--model qwen2.5-vl-nano"
_SOME = "--tasks nieh_mini_gt --limit 24"
_TWINS = "--tasks nieh_mini_twins --limit 16"
_UNIFORM = f"{_TWINS} --context memory --memory uniform --budget 27"
_WINDOWS = "nieh_haystack_8k,nieh_haystack_16k,nieh_truncate_head_8k"
_TEXTS = "nieh_interleaved,nieh_interleaved_plans,nieh_text_state,nieh_video"
_EXPORTED = "import-replies ../questions/exported"
# The commands of a case have a folder each, in which no two runs have one model and one name.
CASES = {
    "questions": (
        "--model oracle,blind,random --tasks nieh_mini --limit 40",
        f"{_NANO} {_SOME}",
        f"{_NANO} {_SOME} --frames blank",
        f"--model random {_SOME} --repeats 2",
    ),
    "windows": (
        f"--model oracle,blind --tasks {_WINDOWS} {_SET} --limit 12 --tokens-per-frame 100",
    ),
    "twins": (
        "--model oracle,blind,random,flip --tasks nieh_mini_twins --limit 40",
        f"{_NANO} {_TWINS}",
        f"{_NANO} {_TWINS} --frames no-clue",
    ),
    "memory": (
        f"--model blind,qwen2.5-vl-nano {_UNIFORM}",
        "--model oracle,blind --tasks nieh_mini_memory --memory random --budget 1k --limit 20",
    ),
    "plans": ("--model planner,scripted --tasks infthor_plans_mini --limit 1",),
    "final": ("--model planner,scripted --tasks infthor_final_mini --limit 1",),
    "agents": ("--model planner,history --tasks infthor_twins_mini --limit 1",),
    "arms": ("--model planner-arm,still --tasks manipulathor_mini --limit 1",),
    "served": (
        f"{_SERVED} --tasks nieh_mini --limit 6",
        f"{_SERVED} --tasks {_TEXTS} {_SET} --limit 3",
        f"{_SERVED} {_UNIFORM} --tokens-per-frame 1",
    ),
    "served_agents": (
        f"{_SERVED} --tasks infthor_plans_mini --limit 1",
        f"{_SERVED} --tasks infthor_twins_mini --limit 1 --history memory --memory uniform",
    ),
    "imported": (  # needs the first
        f"{_EXPORTED}/inspect/1-qwen2.5-vl-nano/*.eval {_SET}",
        f"{_EXPORTED}/every-eval-ever/3-random/data/*/*/*/*.jsonl {_SET}",
    ),
    "replies": (
        "--model oracle --tasks nieh_mini_gt",
        f"import-replies replies.jsonl --model me {_SET}",
    ),
}
# By format: what it needs to be told.
EXPORTS = {
    "every-eval-ever": "--organization lab",
    "hf-eval-results": "--dataset lab/set",
    "inspect": "",
    "lm-eval": "",
}
# What models say to a question, right, in part and wrong, in words that scorers take apart.
_FORMS = (
    "{first}",
    "{every}, lamp",
    "It is the {every}.",
    "{every} and {first}",
    "Not {every}",
    "I saw it.\n{every}",
    "{every} or lamp",
    "A {first}s",
)
_WITH_FRAMES = ("twins", "memory")  # requests of few frames
_REPLAYED = ("plans",)  # as a replay costs as much as the run
_DATE = 1_700_000_000  # of every journal
_SECONDS = re.compile(r'("(?:seconds|build_s|recall_s)":)[0-9.e-]+')
_PROGRESS = re.compile(r".*: [\d,]+ of [\d,]+ \(\d+ %\).*")  # comes where a unit takes long
_WORDS = ("yes", "no", "1", "2", "fridge", "MoveAhead", "RotateRight", "LookDown")


def run_cases(work: Path, names: list[str]) -> None:
    """Do the named cases, or all, each in a folder of its name below `work`."""
    # What the machine's user has set is not to be seen in what is printed.
    os.environ |= {"COLUMNS": "250", "OPENAI_API_KEY": "sk-golden", "no_proxy": "127.0.0.1"}
    with serve_chat(_answer, port=_PORT):
        for name in names or CASES:
            start = sum(os.times()[:4])
            (work / name / "printed").mkdir(parents=True)
            with chdir(work / name):
                _run_case(name)
            print(f"{name}: {sum(os.times()[:4]) - start:.0f} s of a processor", file=sys.stderr)


def _answer(request: dict[str, Any], _handler: BaseHTTPRequestHandler) -> dict[str, Any]:
    """A word that follows from every byte of the request, so that one that changes is seen."""
    sent = json.dumps(request, sort_keys=True).encode()
    word = _WORDS[hashlib.sha256(sent).digest()[0] % len(_WORDS)]
    return completion(word, (len(sent) // 1000, len(sent) % 7 + 1, len(sent) // 2000))


def _run_case(name: str) -> None:
    for number, command in enumerate(CASES[name]):
        if "replies.jsonl" in command:
            _write_replies()
        _call(f"run{number}.txt", f"{command} --out runs/{number}")
    _set_times()
    runs = sorted(path.parent for path in Path("runs").glob("*/*/*/results.json"))
    together = " ".join(map(str, runs))
    with (runs[0] / "scores.jsonl").open(encoding="utf-8") as lines:
        unit = json.loads(lines.readline())["id"]
    _call("show.txt", f"show {together}")
    _call("full.txt", f"show {together} --full")
    _call("samples.csv", f"show {together} --per-sample --format csv")
    _call("question.txt", f"show {together} --question {unit}")
    _call("compare.txt", f"compare {together}")
    _call("same_questions.txt", f"compare {together} --same-questions")
    _call("explain.txt", f"explain {runs[0]} {runs[1]}")
    _call("report.txt", f"report {together} --out report.html --episodes {int(name in _REPLAYED)}")
    _call("table.csv", f"report {together} --tables csv")
    for kind, run in product(EXPORTS, runs):
        label = f"{run.parts[1]}-{run.parts[2]}"
        frames = "--frames" * (kind == "inspect" and name in _WITH_FRAMES)
        words = f"--format {kind} --out exported/{kind}/{label} {EXPORTS[kind]} {frames}"
        _call(f"{kind}-{label}.txt", f"export {run} {words}")


def _write_replies() -> None:
    """Answer the questions of the first run, those with several answers each in another form."""
    (samples,) = Path("runs/0").rglob("samples_*.jsonl")
    docs = [json.loads(line)["doc"] for line in samples.read_text(encoding="utf-8").splitlines()]
    answers = {doc["question_id"]: json.loads(doc["answers"]) for doc in docs}
    lines = []
    for number, name in enumerate(sorted(answers, key=lambda it: (-len(answers[it]), it))):
        words = {"first": answers[name][0], "every": ", ".join(map(str, answers[name]))}
        reply = _FORMS[number % len(_FORMS)].format(**words)
        lines.append(json.dumps({"question_id": name, "reply": reply}) + "\n")
    Path("replies.jsonl").write_text("".join(lines), encoding="utf-8")


def _set_times() -> None:
    """Give all units the same time, and all journals a date, before pages and exports have them: so
    what is made of times is compared, too."""
    for path in Path("runs").rglob("journal/*"):
        if path.suffix == ".jsonl":
            text = path.read_text(encoding="utf-8")
            path.write_text(_SECONDS.sub(r"\g<1>0.25", text), encoding="utf-8")
        os.utime(path, (_DATE, _DATE))


def _call(name: str, command: str) -> None:
    """Run a command; keep what it prints, and how it ends."""
    streams = out, err = [io.TextIOWrapper(io.BytesIO(), encoding="utf-8") for _ in range(2)]
    code = None
    try:
        with redirect_stdout(out), redirect_stderr(err):
            main([str(next(Path().glob(it))) if "*" in it else it for it in command.split()])
    except SystemExit as ended:
        code = ended.code
    if code in (130, 143):  # by Ctrl-C, or SIGTERM
        raise KeyboardInterrupt
    for stream in streams:
        stream.seek(0)
    said = [line for line in read_remarks(err.read()) if not _PROGRESS.fullmatch(line)]
    remarks = "\n".join((f"ends with {code}", *said, ""))
    Path("printed", name).write_text(out.read(), encoding="utf-8")
    Path("printed", f"{name}.remarks").write_text(remarks, encoding="utf-8")
