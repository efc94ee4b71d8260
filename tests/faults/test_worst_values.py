"""Whatever code and files of others give: what was accepted can be read by everything that reads a
run, and the run goes on."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from infthor_eval import runs
from infthor_eval.runs import RunRequest, TaskRequest, execute, prepare, read_run
from infthor_eval.runs.journals.record_encoder import RecordEncoder, RefusedRecordError
from infthor_eval.suites import find_suite

from ..helpers.command_line import read_success
from ..helpers.nieh_runs import make_record
from ..helpers.spoiled import SUITES, WORST, fields_of, replace_field
from ..helpers.toy_suite import Prepared

Spoiled = list[tuple[tuple[Any, ...], Any]]


@pytest.fixture(autouse=True)
def fast_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Thousands of records are not synced one by one."""
    monkeypatch.setattr("os.fsync", lambda _: None)


def spoiling_suite(name: str, spoiled: Spoiled) -> Any:
    """The suite of a name that gives its whole record, with one field spoiled in each unit."""
    suite = find_suite(name)
    header, whole = SUITES[name]()
    keys = [runs.UnitKey(whole.task, f"u{n}", whole.variant) for n in range(len(spoiled))]
    units = [runs.Unit(key, f"t{n % 4}", whole.payload) for n, key in enumerate(keys)]

    class Bound:
        workload = runs.Workload([runs.Group(units)], (), header.config)

        def run(self, group: Any, session: Any) -> Any:
            for unit in group.units:
                path, value = spoiled[int(unit.key.id[1:])]
                record = msgspec.structs.replace(whole, id=unit.key.id, cluster=unit.cluster)
                yield session.find_record(unit, "f") or replace_field(record, path, value)

        def close(self) -> None:
            """Nothing is held."""

    class Given(Prepared):
        def to_doc(self, _: Any, record: Any) -> Any:
            return runs.UnitDoc(0, {}, "", record.id, {}, str(record.payload))

    class Spoiling:
        def __getattr__(self, attribute: str) -> Any:
            return getattr(suite, attribute)

        def prepare(self, _: Any) -> Any:
            return Given(Bound)

    return Spoiling()


def read_in_every_way(run_cli: Callable[..., tuple[int, str, str]], folder: Path) -> None:
    """Read a run by every command that reads one."""
    forms = [("--format", form) for form in ("csv", "latex", "markdown")]
    shown = [(), ("--full",), ("--json",), *(("--full", *form) for form in forms)]
    samples = [("--per-sample", "--format", form) for form in ("csv", "parquet")]
    commands: list[Sequence[object]] = [("show", folder, *how) for how in (*shown, *samples)]
    commands.append(("compare", folder, folder))
    commands.append(("report", folder, "--out", folder.parent / "page.html"))
    commands.append(("ls", "runs", folder.parent))
    for command in commands:
        _, err = read_success(run_cli(*command))
        assert "left out" not in err


@pytest.mark.parametrize("name", SUITES)
def test_every_field_of_every_record_takes_the_worst_values(name, run_cli, tmp_path) -> None:
    _, whole = SUITES[name]()
    # A unit's own key and cluster are not in its hands.
    paths = [path for path in fields_of(whole) if path[0] not in ("task", "id", "variant")]
    spoiled = [(path, value) for path in paths for value in WORST]
    suite = spoiling_suite(name, spoiled)
    request = RunRequest(next(iter(suite.baselines)), TaskRequest([], None), ("t",), tmp_path)
    outcome = execute(prepare(request, suite))
    assert len(outcome.records) == len(spoiled)
    failed = [record for record in outcome.records if record.failure is not None]
    assert len(spoiled) // 2 < len(failed) < len(spoiled)
    assert all("\n" not in record.failure for record in failed)
    assert read_run(outcome.folder, suite.records)[1] == outcome.records
    read_in_every_way(run_cli, outcome.folder)
    again = execute(prepare(request, suite))
    assert again.summary.summary == outcome.summary.summary


def _worst_values() -> st.SearchStrategy[Any]:
    text = st.text(st.characters(codec=None))  # with lone surrogates
    single = st.one_of(
        st.none(),
        st.booleans(),
        st.integers(),
        st.floats(),
        text,
        st.binary(),
        st.complex_numbers(),
    )
    return st.recursive(
        st.one_of(single, st.integers(0, len(WORST) - 1).map(WORST.__getitem__)),
        lambda inner: st.one_of(
            st.lists(inner, max_size=3),
            st.lists(inner, max_size=3).map(tuple),
            st.dictionaries(text, inner, max_size=3),
        ),
        max_leaves=5,
    )


@pytest.mark.parametrize("name", SUITES)
@settings(max_examples=100, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_what_passes_the_gate_is_read_as_it_was_given(name: str, data: st.DataObject) -> None:
    suite = find_suite(name)
    _, whole = SUITES[name]()
    path = data.draw(st.sampled_from(list(fields_of(whole))))
    record = replace_field(whole, path, data.draw(_worst_values()))
    try:
        line = RecordEncoder(suite.records).encode(record)
    except RefusedRecordError as error:
        assert "\n" not in str(error)
        return
    read = suite.records.decoder().decode(line)
    assert read == record
    assert suite.records.decoder().decode(msgspec.json.encode(read)) == read


# -- an adapter, a judge


OWN = """
import itertools
from dataclasses import dataclass
from model_adapters import Capabilities, Reply, Transcript
from tests.helpers.spoiled import WORST

FIELDS = Reply.__dataclass_fields__
PAIRS = [(field, value) for field in FIELDS for value in WORST]

@dataclass(frozen=True)
class Options:
    start: int = 0

class Talk(Transcript):
    n_tokens = None
    def __init__(self, numbers):
        super().__init__()
        self.numbers = numbers
    def reply(self, decoding):
        field, value = PAIRS[next(self.numbers) % len(PAIRS)]
        return Reply(**{"text": "Yes.", field: value})

class Plain(Talk):
    def reply(self, decoding):
        return Reply("Yes.")

class Own:
    Options, capabilities = Options, Capabilities(counts_tokens=False, token_ids=False)
    name = "own"
    def __init__(self, start):
        self.numbers = itertools.count(start)
    @classmethod
    def build(cls, name, options, seed):
        return cls(options.start)
    def identity(self):
        return {}
    def tokens_per_frame(self, frame):
        return None
    def conversation(self):
        return Talk(self.numbers)
    def close(self):
        pass

class PlainModel(Own):
    def conversation(self):
        return Plain(self.numbers)
"""
N_PAIRS = 9 * len(WORST)  # fields of a reply


@pytest.fixture
def own(tmp_path: Path) -> str:
    (tmp_path / "own.py").write_text(OWN)
    return f"{tmp_path / 'own.py'}:Own"


def test_an_adapter_gives_the_worst_replies(own, run_cli, tmp_path) -> None:
    n_units = 127
    for start in range(0, N_PAIRS, n_units):
        model = ("--model", own, "--model-args", f"start={start}", "--out", tmp_path / "out")
        words = ("--tasks", "nieh_mini_gt", "--name", f"from{start}", "--quiet")
        code, _, err = run_cli("run", *model, *words)
        assert code == 1
        assert "Traceback" not in err
        (folder,) = (tmp_path / "out" / f"from{start}").iterdir()
        records = read_run(folder, find_suite("nieh").records)[1]
        n_failed = sum(record.failure is not None for record in records)
        assert 0 < n_failed < len(records) == n_units
    read_in_every_way(run_cli, folder)
    read_success(run_cli("rescore", folder, "--out", tmp_path / "rescored"))


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """A run with a reply for each pair of field and value."""
    from ..helpers.journals import write_journal
    from ..helpers.nieh_runs import make_config, make_header

    config = make_config(model="m", checkpoint=None, n_parameters=None)
    config["tasks"]["nieh_gt"]["n_samples"] = N_PAIRS
    records = [make_record(n, f"the soft {n}", (f"Sofa{n}",)) for n in range(N_PAIRS)]
    types = find_suite("nieh").records
    return write_journal(tmp_path / "source", make_header(config, "m"), records, types)


def test_a_judge_gives_the_worst_replies(own, source, run_cli, tmp_path) -> None:
    code, _, err = run_cli("rescore", source, "--judge", own, "--out", tmp_path / "judged")
    assert code == 1
    assert "Traceback" not in err
    (folder,) = (tmp_path / "judged").glob("*/*")
    read_in_every_way(run_cli, folder)
    assert run_cli("rescore", folder, "--out", tmp_path / "again")[0] == 0


SCORER = """
from tests.helpers.spoiled import WORST

def measure(reply, answers):
    return WORST[int(reply.split()[-1]) % len(WORST)]

def several(reply, answers):
    number = int(reply.split()[-1])
    value = WORST[number % len(WORST)]
    return {"a": 1.0, "b": 0.5} if number == 0 else {"a": value, "b": value}

def named(reply, answers):
    number = int(reply.split()[-1])
    return {"a": 1.0} if number == 0 else {WORST[number % len(WORST)]: 1.0}
"""


@pytest.mark.parametrize("function", ["measure", "several", "named"])
def test_a_scorer_gives_the_worst_scores(function, source, run_cli, tmp_path) -> None:
    (tmp_path / "scorer.py").write_text(SCORER)
    scorer = f"{tmp_path / 'scorer.py'}:{function}"
    code, _, err = run_cli("rescore", source, "--scorer", scorer, "--out", tmp_path / "out")
    assert code == 1
    assert "Traceback" not in err
    (folder,) = (tmp_path / "out").glob("*/*")
    read_in_every_way(run_cli, folder)
    assert run_cli("rescore", folder, "--out", tmp_path / "again")[0] == 0


MEMORY = """
import itertools
from infthor_eval.memory import MemoryCapabilities, Observation
from tests.helpers.spoiled import WORST

class Own:
    capabilities = MemoryCapabilities()
    numbers = itertools.count()
    def identity(self):
        return {}
    def begin(self, facts):
        self.steps = []
    def observe(self, observation):
        self.steps.append(observation)
    def recall(self, query, budget):
        number = next(Own.numbers)
        value = WORST[number % len(WORST)]
        kinds = (value, [value], [Observation(number=value, frame=query.present.frame)])
        return kinds[number % len(kinds)]
"""


def test_a_memory_recalls_the_worst(own, run_cli, tmp_path) -> None:
    (tmp_path / "memory.py").write_text(MEMORY)
    plain = own.removesuffix("Own") + "PlainModel"
    typed = ("run", "--model", plain, "--tasks", "nieh_mini_memory", "--limit", len(WORST))
    memory = f"{tmp_path / 'memory.py'}:Own"
    code, _, err = run_cli(*typed, "--memory", memory, "--out", tmp_path / "out", "--quiet")
    assert code == 1
    assert "Traceback" not in err
    (folder,) = (tmp_path / "out").glob("*/*")
    read_in_every_way(run_cli, folder)


# -- logs of others


def _as_json(value: Any) -> str | None:
    try:
        return json.dumps(value)
    except (TypeError, ValueError, RecursionError):
        return None


IN_JSON = [text for text in map(_as_json, WORST) if text is not None]
COLUMNS = ("reply", "n_context_tokens", "n_reply_tokens", "seconds", "frames_shown")


def test_a_log_has_the_worst_rows(make_nieh_set, run_cli, tmp_path) -> None:
    from infthor_eval.formats.nieh_set import NiehSet

    data = make_nieh_set(size=56)
    question = NiehSet(data).questions[0].id
    rows = [(column, text) for column in COLUMNS for text in IN_JSON]
    lines = [
        f'{{"question_id": {json.dumps(question)}, "reply": "mug", "{column}": {text}}}'
        for column, text in rows
    ]
    for number, line in enumerate(lines):
        log = tmp_path / "log.jsonl"
        log.write_text(f"{line}\n")
        typed = ("import-replies", log, "--data", data, "--model", f"m{number}")
        code, _, err = run_cli(*typed, "--out", tmp_path / "out")
        assert code in (0, 2), line
        assert "Traceback" not in err
    folders = sorted((tmp_path / "out").glob("*/*"))
    assert 0 < len(folders) < len(lines)
    for folder in folders[:: len(folders) // 4]:
        read_in_every_way(run_cli, folder)
