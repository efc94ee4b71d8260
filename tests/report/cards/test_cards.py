"""`card`: what is said of a set when it is published; Croissant is read by mlcroissant itself."""

import csv
import json
import re
import shutil

import mlcroissant
import pytest
import yaml
from PIL import Image

from infthor_eval.formats.question import Question
from infthor_eval.storage.folders import packaged_folder
from tests.helpers.command_line import assert_refused

LEARNED = re.compile(r"(?:\n\| (?:learner: [^|]*|blind) \|| blind has) ([\d.]+) [|%]")
DAY = ("--day", "2026-11-25")
# What NeurIPS 2026 asks for.
RESPONSIBLE = (
    *("rai:dataLimitations", "rai:dataBiases", "rai:personalSensitiveInformation"),
    *("rai:dataUseCases", "rai:dataSocialImpact", "rai:hasSyntheticData"),
    *("prov:wasDerivedFrom", "prov:wasGeneratedBy"),
)


def read_croissant(folder):
    """The data set, held to have neither errors nor warnings."""
    read = mlcroissant.Dataset(jsonld=str(folder / "croissant.json"))
    issues = read.metadata.ctx.issues
    assert not issues.errors
    assert not issues.warnings
    return read


def test_a_set_of_ones_own_gets_a_card(make_nieh_set, tmp_path, run_cli):
    questions = [
        Question(f"t{n % 3}", f"Where is thing {n} | now?", (1, 2, 4), ("table", "a desk"))
        for n in range(5)
    ]
    data = make_nieh_set(questions, size=20)
    (tmp_path / "cite.bib").write_text("@misc{me, title={Mine}}\n")
    typed = ("card", data, "--licence", "CC-BY-4.0", *DAY, "--creator", "A. Person")
    code, out, err = run_cli(*typed, "--citation", tmp_path / "cite.bib", "--name", "Mine")
    assert (code, err) == (0, "")
    assert out.split() == [f"{data}/croissant.json", f"{data}/README.md"]
    described = json.loads((data / "croissant.json").read_text())
    assert all(described[field] for field in RESPONSIBLE)
    assert described["license"] == "https://spdx.org/licenses/CC-BY-4.0"
    assert described["citeAs"] == "@misc{me, title={Mine}}"
    (table,) = read_croissant(data).metadata.record_sets
    rows = list(read_croissant(data).records(table.uuid))
    with (data / "qa_set_test.csv").open(newline="") as file:
        expected = list(csv.DictReader(file))
    assert [row["qa_set_test/question"].decode() for row in rows] == [
        row["question"] for row in expected
    ]
    card = (data / "README.md").read_text()
    front, text = card.removeprefix("---\n").split("---\n", 1)
    assert yaml.safe_load(front)["license"] == "cc-by-4.0"
    assert "| questions | 5 |" in text
    assert "| trajectories | 3 |" in text
    assert "@misc{me" in text
    with Image.open(data / "card.png") as picture:
        assert picture.size == (3 * 186 - 6, 180)


def test_questions_without_frames_get_a_card_without_a_picture(make_nieh_set, tmp_path, run_cli):
    data = make_nieh_set(size=8)
    alone = tmp_path / "alone"
    alone.mkdir()
    shutil.copy(data / "qa_set_test.csv", alone)
    assert run_cli("card", alone / "qa_set_test.csv", "--licence", "MIT", *DAY)[0] == 0
    assert "no frames" in (alone / "README.md").read_text()
    assert not (alone / "card.png").exists()
    read_croissant(alone)


def test_it_needs_a_set_a_licence_and_a_day(make_nieh_set, tmp_path, run_cli):
    data = make_nieh_set(size=8)
    assert_refused(run_cli("card", tmp_path / "no", "--licence", "MIT"), "no such folder")
    assert_refused(run_cli("card", data), "--licence")
    assert_refused(
        run_cli("card", data, "--licence", "MIT", "--day", "2026-02-30"),
        "is no day; write YYYY-MM-DD",
    )
    assert run_cli("init-set", tmp_path / "mine")[0] == 0
    assert_refused(
        run_cli("card", tmp_path / "mine", "--licence", "MIT"),
        "has frames of your own, and a card speaks of simulated homes",
    )


@pytest.mark.parametrize(
    "name", ["nieh_mini", pytest.param("nieh_mini_twins", marks=pytest.mark.slow)]
)
def test_the_bundled_sets_have_the_cards_that_they_would_get_now(name, tmp_path, run_cli):
    bundled = packaged_folder(f"sets/{name}")
    made = tmp_path / "card"
    day = json.loads((bundled / "croissant.json").read_text())["datePublished"]
    code, _, err = run_cli(
        "card", bundled, "--licence", "MIT", "--creator", "the infthor-eval authors",
        "--set-version", "0.1.0", "--day", day, "--out", made,
    )  # fmt: skip
    assert code == 0, err
    for file in ("README.md", "croissant.json"):
        now, then = ((folder / file).read_text() for folder in (made, bundled))
        assert LEARNED.sub("", now) == LEARNED.sub("", then)
        # Near ties of a regression fall otherwise on another kind of processor.
        rates = [float(rate) for text in (now, then) for rate in LEARNED.findall(text)]
        half = len(rates) // 2
        assert rates[:half] == pytest.approx(rates[half:], abs=1)
    folder = tmp_path / "set"
    shutil.copytree(made, folder)
    for file in (*bundled.glob("*.csv"), *bundled.glob("*.jsonl")):
        shutil.copy(file, folder)
    counts = {
        table.uuid: len(list(read_croissant(folder).records(table.uuid)))
        for table in read_croissant(folder).metadata.record_sets
    }
    with next(folder.glob("*.csv")).open(newline="") as file:
        assert len(list(csv.DictReader(file))) in counts.values()
    pairs = folder / "twins.jsonl"
    n_worlds = len(pairs.read_text().splitlines()) if pairs.exists() else None
    assert counts.get("pairs") == n_worlds
