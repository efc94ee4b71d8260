"""Pairs of twins on the page: one sample of two worlds, also in a real browser."""

import pytest

from infthor_eval.cli import main
from infthor_eval.report.live.state import LiveRun
from infthor_eval.report.web.sample_groups import GroupKey, group_samples
from infthor_eval.report.web.samples import PageSample, SampleResult
from infthor_eval.run import open_runs

from ...helpers.twin_sets import CLUES, DIFFERING, STILL, write_twin_set

SECONDS_OF_A_BLINK = 0.7


@pytest.fixture(scope="module")
def twin_data(tmp_path_factory):
    return write_twin_set(tmp_path_factory.mktemp("twins") / "set")


@pytest.fixture(scope="module")
def twin_runs(tmp_path_factory, twin_data):
    """The key, which has every pair, and a guesser, who says the same in both worlds."""
    output = tmp_path_factory.mktemp("runs")
    words = ("--model", "oracle,blind", "--tasks", "nieh_twins", "--context", "clues")
    with pytest.raises(SystemExit) as ended:
        main([*words, "--data", str(twin_data), "--out", str(output)])
    assert ended.value.code == 0
    return sorted(folder for model in ("oracle", "blind") for folder in (output / model).iterdir())


@pytest.fixture(scope="module")
def page(make_page, twin_runs, twin_data):
    return make_page(*twin_runs, data=twin_data)


def place_of(page, label):
    return next(at for at, run in enumerate(page.runs) if run.label == label)


def test_a_pair_is_one_sample_and_right_if_both_replies_are(page):
    pairs = [f"swap-{base}/{number}" for base in (1, 2) for number in (1, 2)]
    assert [sample.id for sample in page.samples] == pairs
    oracle, blind = (place_of(page, label) for label in ("oracle", "blind"))
    for sample in page.samples:
        assert len(sample.members) == 2
        assert {member.title for member in sample.members} == {sample.title}
        assert len({member.target for member in sample.members}) == 2
        assert sample.results[oracle].outcome == "right"
        assert len({member.results[blind].reply for member in sample.members}) == 1
        assert sample.results[blind].outcome == "partly"
    assert page.metrics[0] == "strict"


def test_strips_have_the_same_frames_of_both_worlds_and_say_which_differ(page):
    for sample in page.samples:
        one, other = (member.timeline.frames for member in sample.members)
        assert [it.index for it in one] == [it.index for it in other] == [2, 3, 4, 5]
        assert {it.index for it in one if it.is_clue} == set(CLUES)
        for mine, theirs in zip(one, other, strict=True):
            assert mine.differs == theirs.differs == (mine.index in DIFFERING)
            # A picture that both worlds have is on the page once.
            assert (mine.picture != theirs.picture) == mine.differs
            facts = [page.frames[it.facts] for it in (mine, theirs)]
            assert {it.step for it in facts} == {mine.index}
            assert [it.action for it in facts] == ["Pass Mug", "Pass Cup"]
            changed = {it.changed for it in facts}
            assert changed == ({("Mug",), ("Cup",)} if mine.differs else {()})


def test_the_page_opens_with_pairs(page):
    keys = [section.key for section in page.sections]
    assert keys.index("pairs") == keys.index("nieh") - 1 == 1
    sections = {section.key: section for section in page.sections}
    titles = [table.title for table in sections["pairs"].tables]
    assert titles[0].startswith("Twins: net pairs")
    assert not set(titles) & {table.title for table in sections["nieh"].tables}
    measures = {row.cells[:3]: row.cells[3] for row in page.sections[0].tables[0].rows}
    assert measures["oracle", "nieh_twins", "net pairs"] == "100.0"
    assert measures["blind", "nieh_twins", "net pairs"] == "0.0"
    (compared,) = sections["comparison"].tables
    assert compared.rows[0].cells[1] == "net_pairs"


def test_without_its_set_a_pair_has_no_frames_and_it_is_said(
    make_page, twin_runs, make_nieh_set, open_page
):
    page = make_page(*twin_runs, data=make_nieh_set())
    tab = open_page(page).tab
    assert any("has changed since" in note for note in page.notes)
    assert len(page.samples) == 4
    assert tab.locator("#sample .results .reply").count() == 4
    assert tab.locator("#sample img, #sample .switch").count() == 0


def test_both_replies_stand_beside_each_other_and_filters_are_of_pairs(page, tab):
    sample = page.samples[0]
    assert tab.locator("#count").inner_text() == "4 of 4"
    heads = tab.locator("#sample .results thead th").all_inner_texts()
    assert heads[2:4] == ["reply, world A", "reply, world B"]
    targets = tab.locator("#sample .target span").all_inner_texts()
    assert targets == [
        f"world {name} {member.target}" for name, member in zip("AB", sample.members, strict=True)
    ]
    for at, run in enumerate(page.runs):
        row = tab.locator("#sample .results tbody tr").nth(at)
        assert row.locator("td").first.inner_text() == run.label
        replies = row.locator(".reply").all_inner_texts()
        assert [text[2:] for text in replies] == [it.results[at].reply for it in sample.members]
    tab.select_option("#outcome", "right")
    tab.select_option("#run", label="blind")
    assert tab.locator("#count").inner_text() == "0 of 4"
    tab.select_option("#run", label="oracle")
    assert tab.locator("#count").inner_text() == "4 of 4"
    tab.fill("#search", sample.members[1].id)
    assert tab.locator("#count").inner_text() == "1 of 4"


def test_a_question_of_a_pair_has_an_address_too(page, tab):
    for address, place in (("swap-2/1", 2), (page.samples[0].members[1].id, 0)):
        tab.evaluate("it => { location.hash = new URLSearchParams({ sample: it }) }", address)
        chosen = page.samples[place]
        tab.locator("#sample > .note", has_text=chosen.id).last.wait_for()
        assert tab.locator("#sample h3").inner_text() == chosen.title


@pytest.mark.parametrize("width", [1280, 400])
def test_frames_of_one_number_are_one_above_the_other(tab, width):
    tab.set_viewport_size({"width": width, "height": 1000})
    columns = tab.locator("#sample .strips figure")
    labels = columns.locator("figcaption").all_inner_texts()
    assert labels == ["2 ≠ clue", "3 clue", "4 clue", "5 ≠"]
    tops = []
    for at in range(columns.count()):
        first, second = (columns.nth(at).locator("img").nth(of).bounding_box() for of in (0, 1))
        assert (first["x"], first["width"]) == (second["x"], second["width"])
        assert first["y"] + first["height"] <= second["y"]
        tops.append((first["y"], second["y"]))
    assert len(set(tops)) == (1 if width > 1000 else 2)
    marked = [columns.nth(at).get_attribute("class") for at in range(columns.count())]
    assert marked == ["differs", None, None, "differs"]
    assert tab.evaluate("document.documentElement.scrollWidth") == width


def seen(tab):
    """The world that is seen on the stage, and the source of its picture."""
    stage = tab.locator("#sample .stage")
    visible = stage.locator("img").evaluate_all(
        "them => them.filter(it => getComputedStyle(it).visibility === 'visible').map(it => it.src)"
    )
    assert len(visible) == 1
    return stage.locator(".tag").inner_text(), visible[0]


def test_the_switch_blinks_one_world_over_the_other_until_it_is_pressed_again(tab):
    assert tab.locator("#sample .place").inner_text() == "frame 2"
    tab.clock.install(time=0)
    tab.clock.pause_at(3600)  # time goes on where the test says so
    start = seen(tab)
    switch = tab.locator("#sample .switch")
    switch.focus()
    tab.keyboard.press("Enter")
    assert switch.get_attribute("aria-pressed") == "true"
    other = seen(tab)
    assert (start[0], other[0]) == ("world A", "world B")
    assert start[1] != other[1]
    tab.clock.run_for(1000 * SECONDS_OF_A_BLINK)
    assert seen(tab) == start
    tab.clock.run_for(1000 * SECONDS_OF_A_BLINK)
    assert seen(tab) == other
    tab.keyboard.press("b")
    assert switch.get_attribute("aria-pressed") == "false"
    still = seen(tab)
    tab.clock.run_for(2000 * SECONDS_OF_A_BLINK)
    assert seen(tab) == still
    # Only frames that differ are gone through; any other is chosen at its number.
    tab.get_by_title("The next frame that differs").click()
    assert tab.locator("#sample .place").inner_text() == "frame 5"
    assert "Mug" in tab.locator("#sample .controls dl").inner_text()
    tab.locator("#sample .pick").nth(1).click()
    assert tab.locator("#sample .place").inner_text() == "frame 3"


def test_who_wants_less_motion_changes_worlds_by_hand(page, open_page):
    tab = open_page(page, reduced_motion="reduce").tab
    switch = tab.locator("#sample .switch")
    assert switch.inner_text() == "show the other"
    worlds = []
    for _ in range(3):
        switch.click()
        worlds.append(seen(tab)[0])
    tab.wait_for_timeout(2000 * SECONDS_OF_A_BLINK)
    assert [*worlds, seen(tab)[0]] == ["world B", "world A", "world B", "world B"]
    assert switch.get_attribute("aria-pressed") == "false"


def test_frames_of_a_group_open_large_with_their_own_steps(tab):
    buttons = tab.locator("#sample .strips figure").nth(0).locator("button.frame")
    for at, name in enumerate(("Mug", "Cup")):
        buttons.nth(at).click()
        dialog = tab.locator("#enlarged")
        assert f"world {'AB'[at]}" in dialog.locator("h3").inner_text()
        assert f"Pass {name}" in dialog.inner_text()
        tab.keyboard.press("Escape")


def sample(name, *outcomes, group=""):
    results = tuple(it and SampleResult(it) for it in outcomes)
    return GroupKey("task", "", 1, group), PageSample("suite", "task", name, "t", name, results)


def test_a_group_is_as_its_worst_member_and_stands_where_its_first_was():
    grouped = group_samples(
        [
            sample("a", "right", "right", "wrong", "failed", "excluded", None, group="g"),
            sample("b", "right"),
            sample("c", "right", "wrong", "wrong", "right", "failed", "right", group="g"),
            sample("d", "partly", group="alone"),
        ]
    )
    assert [it.id for it in grouped] == ["g", "b", "d"]
    outcomes = [result and result.outcome for result in grouped[0].results]
    assert outcomes == ["right", "partly", "wrong", "failed", "excluded", None]
    assert [member.id for member in grouped[0].members] == ["a", "c"]
    assert grouped[2].members == ()


def test_a_page_of_more_runs_has_the_results_of_members_in_their_places():
    (group,) = group_samples([sample("a", "right", group="g"), sample("b", "wrong", group="g")])
    spread = group.spread_over(3, [1])
    for part in (spread, *spread.members):
        assert [it is None for it in part.results] == [True, False, True]


def test_equal_pictures_of_different_steps_have_their_own_facts(page):
    frames = {it.index: it for it in page.samples[0].members[0].timeline.frames}
    first, second = (frames[index] for index in STILL)
    assert first.picture == second.picture
    assert [page.frames[it.facts].step for it in (first, second)] == list(STILL)


def test_the_page_on_a_run_as_it_goes_says_that_pairs_count(twin_runs):
    assert LiveRun(twin_runs[0]).state().measure == "net pairs"


def test_rows_of_samples_name_their_pair(twin_runs):
    (run,) = open_runs(twin_runs[:1])
    cells = {column.name: list(map(column.value, run.records)) for column in run.presenter.columns}
    assert sorted(cells["pair"]) == sorted(2 * ["swap-1/1", "swap-1/2", "swap-2/1", "swap-2/2"])
    assert set(cells["fact"]) == {"swap-1/mug", "swap-2/mug"}
