"""docs/where-things-go.md is what the ends of module docstrings say."""

import importlib.util
import sys

import pytest

from .blocks import ROOT
from .test_architecture import PLACE


def load_script():
    spec = importlib.util.spec_from_file_location(
        "where_things_go", ROOT / "docs" / "where_things_go.py"
    )
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where dataclasses look for it
    spec.loader.exec_module(module)
    return module


script = load_script()
PAGE = "# Page\n<!-- from docstrings -->\nold\n<!-- end -->\nby hand\n"


def changes_of(docstring, module="infthor_eval/memory/registry.py"):
    return list(script.changes_of(docstring, module))


def test_the_page_is_the_one_of_the_docstrings():
    page = script.PAGE.read_text()
    made = script.with_tables(page, script.find_changes())
    assert made == page, "run: python docs/where_things_go.py"


def test_places_are_beside_the_module_or_below_the_root():
    missing = []
    for change in script.find_changes():
        place = ROOT / change.place
        folder = place if place.is_dir() else place.parent
        for name, _ in PLACE.findall(change.how):
            if not (folder / name).exists() and not (ROOT / name).exists():
                missing.append(f"{change.place}: {name}")
    assert missing == []


def test_the_last_paragraphs_of_a_docstring_are_changes():
    found = changes_of(
        "Memories.\n\nMore.\n\nTo add a memory: a class\nhere.\n\n"
        "To add or change its rule: `check.py: RULES` beside it."
    )
    assert [(change.what, change.how) for change in found] == [
        ("a memory", "a class here"),
        ("its rule", "`check.py: RULES` beside it"),
    ]
    assert {change.place for change in found} == {"infthor_eval/memory/registry.py"}


def test_a_package_is_named_by_its_folder():
    (change,) = changes_of("All.\n\nTo add a type: here.", "infthor_sim/object_types/__init__.py")
    assert change.place == "infthor_sim/object_types/"


@pytest.mark.parametrize(
    ("docstring", "said"),
    [
        ("To add a memory, write a class.", "is not of the form"),
        ("To add a memory: a class", "is not of the form"),
        ("To add a|b: a class.", "is not of the form"),
        ("To add a memory: a class.\n\nMore.", "is not at the docstring's end"),
        (f"To add a memory: {'word ' * 31}.", "has 31 words; at most 30"),
    ],
)
def test_a_malformed_paragraph_is_refused(docstring, said):
    with pytest.raises(script.ChangeError, match=said) as caught:
        changes_of(docstring)
    assert str(caught.value).startswith("infthor_eval/memory/registry.py: ")


def test_one_change_has_one_place(tmp_path):
    for name in ("one", "two"):
        path = tmp_path / "infthor_eval" / f"{name}.py"
        path.parent.mkdir(exist_ok=True)
        path.write_text('"""It.\n\nTo add a memory: here.\n"""\n')
    with pytest.raises(script.ChangeError, match=r"two\.py: infthor_eval/one\.py has 'a memory'"):
        script.find_changes(tmp_path)


def test_tables_are_sorted_below_the_headings_of_their_packages():
    changes = [
        script.Change("the zoo", "infthor_eval/memory/zoo.py", "here"),
        script.Change("a yard", "infthor_eval/runs/work/yard.py", "there"),
        script.Change("an ant", "infthor_eval/memory/", "`ant.py`"),
    ]
    assert script.with_tables(PAGE, changes) == (
        "# Page\n<!-- from docstrings -->\n"
        "## Questions, models, policies\n| to add or change | in | how |\n|---|---|---|\n"
        "| an ant | `infthor_eval/memory/` | `ant.py` |\n"
        "| the zoo | `infthor_eval/memory/zoo.py` | here |\n\n"
        "## Simulator and workers\n| to add or change | in | how |\n|---|---|---|\n"
        "| a yard | `infthor_eval/runs/work/yard.py` | there |\n"
        "<!-- end -->\nby hand\n"
    )


def test_a_change_without_a_section_and_a_page_without_markers_are_refused():
    with pytest.raises(script.ChangeError, match="no section"):
        script.with_tables(PAGE, [script.Change("it", "tests/it.py", "here")])
    with pytest.raises(script.ChangeError, match="between two markers, 0 times"):
        script.with_tables("# Page\n", [])


def test_a_malformed_paragraph_ends_the_script_with_one_line(monkeypatch, capsys):
    monkeypatch.setattr(script, "find_changes", lambda: changes_of("To add it, do it."))
    assert script.main() == 1
    assert capsys.readouterr().err.count("\n") == 1
