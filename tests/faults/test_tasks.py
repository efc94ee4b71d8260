"""Task files with wrong types, circles, slips and bombs: one line, exit code 2."""

import pytest

from infthor_eval.runs import Catalog
from infthor_eval.suites import find_suite

from ..helpers.command_line import assert_refused, option_words

SETTING = "own.yaml: dataset_kwargs:"
HEAD = "include: _nieh.yaml\ntask: own\n"
CLUES = HEAD + "dataset_kwargs: {context: clues"
BOMB = "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(
    f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]\n" for n in range(1, 9)
)

SETTINGS = {
    "ctx_size: two": "ctx_size is 'two'; it is a number of kilo-tokens above 0",
    "ctx_size: -8": "ctx_size is -8; it is a number of kilo-tokens above 0",
    "depths: 0.2": "depths is 0.2; it is a list of numbers from 0 to 1",
    "depths: [a]": "depths is ['a']; it is a list of numbers from 0 to 1",
    "depths: [2]": "depths is [2]; it is a list of numbers from 0 to 1",
    "depths: []": "depths is []; it is a list of numbers from 0 to 1",
    "top_k: true": "top_k is True; it is a whole number from 1",
    "top_k: 0": "top_k is 0; it is a whole number from 1",
    "top_k: ten": "top_k is 'ten'; it is a whole number from 1",
    "budget: 0": "budget is 0; it is a whole number of tokens from 1",
    "budget: -1": "budget is -1; it is a whole number of tokens from 1",
    "budget: 2.5": "budget is 2.5; it is a whole number of tokens from 1",
    "k_tokens: 1023": "k_tokens is 1023; it is 1000 or 1024",
    "seed: x": "seed is 'x'; it is a whole number",
    "frames: grey": "frames is 'grey'; it is one of shown, blank, shuffled, other",
    "prompt: mine": "prompt is 'mine'; it is published-main or published-logs",
    "retriever: 5": "retriever is 5; it is a text",
    "bundled: 5": "bundled is 5; it is a name",
    "bundled: no": "bundled is False; it is a name",
    "bundled: none": "bundled is 'none': the installation lacks its data folder",
}
FILES = [
    *((f"{CLUES}, {text}}}", f"{SETTING} {reason}") for text, reason in SETTINGS.items()),
    (CLUES + ", depthz: [0.2]}", "depthz is not known; did you mean depths?"),
    (CLUES + ", top-k: 3}", "top-k is not known; did you mean top_k?"),
    (HEAD + "dataset_kwargs: {contxt: clues}", "contxt is not known; did you mean context?"),
    (CLUES + ", 5: 3}", "not"),
    (CLUES + ", ctx_size: .nan}", "holds what JSON cannot"),
    (
        HEAD + "dataset_kwargs: {context: video, prompt: published-logs}",
        f"{SETTING} prompt published-logs: the context video is asked in words of its own; it is "
        "for clues, trajectory",
    ),
    (
        CLUES + "}\nmetric_list: [{metric: exact}]",
        "metric_list: exact is none of our scorers, reference, strict",
    ),
    (
        HEAD + "dataset_kwargs: {context: clue}",
        f"{SETTING} context is 'clue'; it is one of clues, trajectory",
    ),
    (
        HEAD + "dataset_kwargs: {context: haystack}",
        f"{SETTING} ctx_size is missing; haystack needs it",
    ),
    (HEAD + "dataset_kwargs: {context: [clues]}", "name of a context"),
    (HEAD + "dataset_kwargs: {}", "name of a context"),
    (HEAD + "dataset_kwargs: 5", "must be a mapping"),
    (HEAD + "dataset_kwargs: [context]", "must be a mapping"),
    (
        CLUES + "}\ngeneration_kwargs: 5",
        "own.yaml: generation_kwargs is 5; it is a mapping of settings",
    ),
    (CLUES + "}\ngeneration_kwargs: [until]", "it is a mapping of settings"),
    (CLUES + "}\ngeneration_kwargs: {max_gen_toks: 5, 7: 1}", "not"),
    (CLUES + "}\ndescription: 2020-01-01", "holds what JSON cannot"),
    (CLUES + "}\ndescription: !!binary aGk=", "holds what JSON cannot"),
    (CLUES + "}\ndescription: !!set {a, b}", "holds what JSON cannot"),
    (CLUES + "}\ndescription: !!python/object/apply:os.system [ls]", "not YAML"),
    (CLUES + "}\ntask: again", "the key 'task' is there twice"),
    (CLUES + "}\n" + BOMB, "set INFTHOR_EVAL_MAX_YAML_NODES to more than"),
    (CLUES + "}\na: &a [*a]", "an alias refers to a node that contains it"),
    (CLUES + "}\na: &a {b: *a}", "an alias refers to a node that contains it"),
    (CLUES + "}\na: *nothing", "not YAML"),
    (CLUES + "}\na: " + "[" * 5000, "not YAML"),
    (CLUES + "}\n\x07: 1", "not YAML"),
    ("include: own.yaml\ntask: own", "includes own.yaml, which includes it"),
    ("include: ../nieh/own.yaml\ntask: own", "which includes it"),
    ("include: 5\ntask: own", "include is 5, not the name of a file"),
    ("include: [a]\ntask: own", "not the name of a file"),
    ("include: nothing.yaml\ntask: own", "cannot be read (No such file or directory)"),
    ("include: .\ntask: own", "is a folder, not a file"),
    ("include: /dev/zero\ntask: own", "is a pipe or a device, not a file"),
    ("group: own\ntask: [own]", "the group own is in itself"),
    ("group: own\ntask: [5]", "must be a list of task names"),
    ("group: own\ntask: {a: 1}", "must be a list of task names"),
    ("group: own\ntask: [nieh_gtt]", "did you mean"),
    ("task: own\nmetadata: [suite]", "no suite"),
    ("task: [own]", "neither a task nor a group name"),
    ("5: 6", "not a mapping of settings"),
    ("text", "not a mapping of settings"),
    ("", "not a mapping of settings"),
]


@pytest.mark.parametrize(
    ("content", "expected"),
    FILES,
    ids=[f"{n}: {expected}" for n, (_, expected) in enumerate(FILES)],
)
def test_a_task_file_that_is_not_what_it_should_be(
    make_nieh_set, tmp_path, run_cli, task_files, content, expected
):
    (task_files / "nieh" / "own.yaml").write_text(content)
    data = make_nieh_set(size=56)
    ended = run_cli(
        "--model", "oracle", "--tasks", "own", "--data", data, "--out", tmp_path / "out"
    )
    assert_refused(ended, expected)


def test_groups_in_a_circle_are_told(tmp_path, run_cli, task_files):
    (task_files / "nieh" / "one.yaml").write_text("group: one\ntask: [other]")
    (task_files / "nieh" / "other.yaml").write_text("group: other\ntask: [one]")
    assert_refused(
        run_cli("--model", "oracle", "--tasks", "one", "--out", tmp_path), "is in itself"
    )


def test_a_larger_document_is_read_where_the_limit_is_raised(
    make_nieh_set, tmp_path, run_cli, task_files, monkeypatch
):
    (task_files / "nieh" / "own.yaml").write_text(
        CLUES + "}\nmetadata: {suite: nieh, a: &a [1, 1, 1, 1], b: [*a, *a]}\n"
    )
    arguments = option_words(
        model="oracle", tasks="own", data=make_nieh_set(size=56), out=tmp_path / "out"
    )
    monkeypatch.setenv("INFTHOR_EVAL_MAX_YAML_NODES", "10")
    assert_refused(run_cli(*arguments), "has more than 10 values")
    monkeypatch.delenv("INFTHOR_EVAL_MAX_YAML_NODES")
    assert run_cli(*arguments)[0] == 0


@pytest.mark.parametrize(
    "settings", ["null", "[context]", "{context: trajctory}", "{context: clues, depthz: [0.2]}"]
)
def test_a_task_that_cannot_be_run_is_not_listed_as_if_it_could(tmp_path, run_cli, settings):
    (tmp_path / "own.yaml").write_text(f"{HEAD}dataset_kwargs: {settings}\n")
    (tmp_path / "good.yaml").write_text(
        "include: _nieh.yaml\ntask: good\ndataset_kwargs: {context: clues}\n"
    )
    code, out, err = run_cli("ls", "tasks", "--include-path", tmp_path)
    assert (code, err) == (0, "")
    listing = " ".join(out.split())
    assert (
        listing.count("not usable: ") == 1
        and "good context clues" in listing
        and "nieh_mini_gt" in listing
    )


def test_all_packaged_tasks_are_good():
    for task in Catalog.find_packaged().tasks.values():
        find_suite(task.suite).check_task(task)
