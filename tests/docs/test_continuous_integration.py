"""What runs on GitHub and before a commit is what runs here, in the same versions."""

import re

import yaml

from .blocks import ROOT


def commands_of(workflow):
    """The commands of a workflow's only job."""
    (job,) = yaml.safe_load((ROOT / ".github/workflows" / workflow).read_text())["jobs"].values()
    return [step["run"] for step in job["steps"] if "run" in step]


def test_a_commit_is_checked_by_the_ruff_of_the_environment():
    sources = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    (ruff,) = [source for source in sources if source["repo"].endswith("/ruff-pre-commit")]
    (version,) = re.findall(r"^ruff==(\S+)$", (ROOT / "constraints.txt").read_text(), re.MULTILINE)
    assert ruff["rev"] == f"v{version}"


def test_the_workflows_do_what_a_contributor_does():
    assert commands_of("ci.yml") == [".ci/run"]
    assert commands_of("docs.yml") == ["make docs"]


def test_the_site_is_kept_from_where_it_is_built():
    built = re.search(r"^site_dir: (\S+)$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE)[1]
    assert f"path: {built}\n" in (ROOT / ".github/workflows/docs.yml").read_text()
