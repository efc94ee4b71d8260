"""Our runs in lm-eval's files, read by lm-eval's own readers."""

import json
import shutil

from lm_eval.utils import (
    get_results_filenames,
    get_sample_results_filenames,
    hash_string,
    make_table,
)

from tests.harness.conftest import read_samples
from tests.helpers.command_line import assert_refused, option_words
from tests.helpers.files import find_one


def test_lm_evals_readers_take_the_files(make_nieh_set, tmp_path, run_cli):
    arguments = option_words(
        model="oracle", tasks="nieh", data=make_nieh_set(size=56), out=tmp_path
    )
    assert run_cli(*arguments)[0] == 0
    names = [str(path) for path in find_one(tmp_path, "lm_eval").rglob("*.json*")]
    (results,) = get_results_filenames(names)
    assert len(get_sample_results_filenames(names)) == 2
    with open(results) as file:  # noqa: PTH123
        document = json.load(file)
    table = make_table(document)
    assert "nieh_full" in table
    assert "reference" in table
    assert document["results"]["nieh_gt"]["strict,none"] == 1.0
    assert document["n-samples"]["nieh_gt"] == {"original": 5, "effective": 5}
    hashes = "".join(
        row["doc_hash"] + row["prompt_hash"] + row["target_hash"]
        for row in read_samples(tmp_path)["nieh_gt"]
    )
    assert document["task_hashes"]["nieh_gt"] == hash_string(hashes)


def test_what_a_killed_run_left_of_its_files_is_gone_after_the_next(
    make_nieh_set, tmp_path, run_cli
):
    arguments = option_words(
        model="oracle", tasks="nieh_gt", data=make_nieh_set(size=56), out=tmp_path / "out"
    )
    assert run_cli(*arguments)[0] == 0
    folder = find_one(tmp_path / "out", "lm_eval") / "oracle"
    for name in ("samples_nieh_gt", "results"):
        (folder / f".{name}.partial").write_text("half")
        (folder / f".{name}.lock").touch()
    assert run_cli(*arguments)[0] == 0
    assert not list(folder.glob(".*"))


def test_datasets_reads_the_samples(make_nieh_set, tmp_path, run_cli):
    from datasets import load_dataset

    run_cli(
        *option_words(model="blind", tasks="nieh_gt", data=make_nieh_set(size=56), out=tmp_path)
    )
    rows = load_dataset(
        "json", data_files=str(find_one(tmp_path, "samples_*.jsonl")), split="train"
    )
    assert len(rows) == 5
    assert rows[0]["metrics"] == ["reference", "strict"]
    assert set(rows[0]) >= {
        *("doc_id", "doc", "target", "arguments", "resps", "filtered_resps", "filter", "strict")
    }


def test_others_get_the_files_that_the_run_wrote(questions_run, export):
    out = export(questions_run, "lm-eval")
    written = sorted(path.name for path in (questions_run / "lm_eval" / "random").iterdir())
    assert sorted(path.name for path in (out / "random").iterdir()) == written
    (results,) = out.rglob("results_*.json")
    (units,) = json.loads(results.read_text())["infthor_eval"]["units"].values()
    assert (units["failed"], units["not_asked"], units["excluded"]) == (0, 0, 0)


def test_files_older_than_the_journal_are_refused(questions_run, tmp_path, run_cli):
    run = tmp_path / "run"
    shutil.copytree(questions_run, run)
    (samples,) = (run / "lm_eval").rglob("samples_*.jsonl")
    samples.write_text("".join(samples.read_text().splitlines(keepends=True)[:-1]))
    ended = run_cli("export", run, "--format", "lm-eval", "--out", tmp_path / "out")
    assert_refused(ended, "is older than the run's journal; run its command again")


def test_a_run_without_them_is_refused(arm_run, tmp_path, run_cli):
    ended = run_cli("export", arm_run, "--format", "lm-eval", "--out", tmp_path / "out")
    assert_refused(ended, "has no lm_eval/, which a run writes at its end")
