"""Nothing that a stranger's run names is opened, imported or called."""

import sys
from pathlib import Path

import pytest
from msgspec.structs import replace

from infthor_eval.cli.commands.rescore import read_source
from infthor_eval.nieh.rescoring.rescore import Source
from infthor_eval.run import Run
from tests.infthor_board.material import edit_journal, reader, reply_with, run_model, submit

from .forging import honest, with_config, with_task

_BAIT = "bait-of-a-stranger"  # a folder that is there, in every place that could name one
_seen: list[str] = []


def _watch(event, args):
    if event in ("open", "import", "os.listdir", "os.scandir", "socket.getaddrinfo", "exec"):
        _seen.extend(event for arg in args if _BAIT in str(arg))


sys.addaudithook(_watch)


@pytest.fixture(scope="module")
def recalled(material, tmp_path_factory) -> Source:
    """A run behind a memory, with the replies of an honest model."""
    root = tmp_path_factory.mktemp("recalled")
    (path,) = run_model(
        root, model="random", tasks="nieh_memory", memory="last", data=material.homes
    )
    return reply_with(read_source(Run.open(path)), reader(0.5, "honest"))


@pytest.fixture
def bait(tmp_path: Path) -> str:
    folder = tmp_path / _BAIT
    folder.mkdir()
    (folder / "pytorch_model.bin").write_bytes(b"no pickle")
    (folder / "memory.py").write_text("raise SystemExit('run')")
    return str(folder)


@pytest.mark.parametrize(
    ("memory", "memory_args"),
    [
        ("clip", "retriever={}"),
        ("clip-view", "k=3,retriever={}"),
        ("clip", "retriever_revision={}"),
    ],
)
def test_the_retriever_of_a_memory_is_not_opened(
    recalled, check, tmp_path, bait, memory, memory_args
):
    run = with_config(recalled, memory=memory, memory_args=memory_args.format(bait))
    folder = submit(tmp_path, "sent", run)
    _seen.clear()  # of what the test itself wrote
    verdict = check(folder)
    assert _seen == []
    # A baseline recalls nothing; all else of the run is set up, and well.
    assert {problem.check for problem in verdict.refusals} == {"frames"}


def test_a_retriever_of_ours_is_not_opened_either(material, check, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "model_adapters.hf.retrieval", None)
    run = honest(material)
    task = run.header.config.tasks["nieh_gt"]
    settings = {**task.settings, "dataset_kwargs": {"context": "clip_retrieval"}}
    config = replace(
        run.header.config,
        tasks={"nieh_clip_retrieval": replace(task, settings=settings, sources={"retriever": {}})},
    )
    records = [replace(it, task="nieh_clip_retrieval") for it in run.records]
    header = replace(run.header, config=config, units_by_task={"nieh_clip_retrieval": len(records)})
    verdict = check(submit(tmp_path, "sent", Source(header, records)))
    assert verdict.refusals == []
    assert any("retrieved by a model" in problem.text for problem in verdict.warnings)


def _everywhere(run, bait):
    """What refuses nothing by itself, all at once."""
    task = run.header.config.tasks["nieh_gt"]
    names = ("data", "bundled", "retriever", "trajectories", "memory", "prompt")
    own = {**task.settings["dataset_kwargs"], **dict.fromkeys(names, bait)}
    functions = dict.fromkeys(("process_docs", "process_results", "doc_to_text"), _BAIT)
    run = with_task(
        run,
        settings={**task.settings, "dataset_kwargs": own, **functions, "include": bait},
        sources={"retriever": {"checkpoint": bait}},
        simulator=bait,
    )
    return with_config(
        run,
        model={**run.header.config.model, "checkpoint": bait, "base_url": f"http://{_BAIT}"},
        adapter={"file": f"{bait}/memory.py"},
        suite_code={"package": _BAIT},
        simulator=bait,
        host=_BAIT,
    )


_PLACES = {
    "everywhere": _everywhere,
    "memory": lambda run, bait: with_config(run, memory=f"{bait}/memory.py:Memory"),
    "memory, a name": lambda run, _: with_config(run, memory=_BAIT),
    "prompt": lambda run, bait: with_config(run, prompt=bait),
    "frames": lambda run, bait: with_config(run, frames=bait),
    "budget": lambda run, bait: with_config(run, budget=bait),
}


@pytest.mark.parametrize("place", _PLACES)
def test_nothing_that_a_config_names_is_opened(material, check, tmp_path, bait, place):
    folder = submit(tmp_path, "sent", _PLACES[place](honest(material), bait))
    _seen.clear()  # of what the test itself wrote
    assert check(folder).refusals
    assert _seen == []


def test_the_suite_of_a_header_is_not_imported(material, check, tmp_path):
    folder = submit(tmp_path, "sent", honest(material))
    edit_journal(folder, lambda lines: lines[0].update(suite=_BAIT))
    _seen.clear()
    assert "readable" in {problem.check for problem in check(folder).refusals}
    assert _seen == []
