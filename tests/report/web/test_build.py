"""What stands on the page of real runs."""

from collections import Counter
from copy import copy
from itertools import pairwise

import msgspec

from infthor_eval.nieh.samples import open_set
from infthor_eval.report.svg import draw
from infthor_eval.report.web.build import PageRequest, build_page
from infthor_eval.run import open_runs
from infthor_eval.storage.folders import packaged_folder

from ...helpers.command_line import option_words

DATA = packaged_folder("sets/nieh_mini")


def replace_simulator(runs, simulator):
    """The same runs, of a set that another simulator rendered."""
    replaced = []
    for run in runs:
        tasks = {
            name: msgspec.structs.replace(task, simulator=simulator)
            for name, task in run.header.config.tasks.items()
        }
        config = msgspec.structs.replace(run.header.config, tasks=tasks)
        header = msgspec.structs.replace(run.header, config=config)
        other = copy(run)
        other.own_header = other.header = header
        replaced.append(other)
    return replaced


def test_every_sample_of_every_run_is_there_with_its_frames(page, nieh_runs):
    questions = {question.id: question for question in open_set(str(DATA)).questions}
    samples = [sample for sample in page.samples if sample.task == "nieh_mini_gt"]
    assert {sample.id for sample in samples} == set(questions)
    assert len(page.samples) > len(samples)  # the haystack's too, at each depth
    for sample in page.samples:
        question = questions[sample.id]
        assert (sample.title, len(sample.results)) == (question.text, len(nieh_runs))
        clues = {frame.index for frame in sample.timeline.frames if frame.is_clue}
        assert clues == (set() if question.absence else set(question.clues))
        assert all(frame.picture is not None for frame in sample.timeline.frames)
        beside = {
            near
            for at in clues
            for near in (at - 1, at + 1)
            if 0 <= near < sample.timeline.n_frames
        }
        assert {frame.index for frame in sample.timeline.frames} >= beside


def test_absences_show_five_frames_evenly_spaced_and_none_is_a_clue(page):
    absence_questions = {
        question.id for question in open_set(str(DATA)).questions if question.absence
    }
    absences = [sample for sample in page.samples if sample.id in absence_questions]
    assert absences
    for sample in absences:
        places = [frame.index for frame in sample.timeline.frames]
        assert (len(places), places[0], places[-1]) == (5, 0, sample.timeline.n_frames - 1)
        steps = [later - earlier for earlier, later in pairwise(places)]
        assert max(steps) - min(steps) <= 1
        assert not any(frame.is_clue for frame in sample.timeline.frames)
        assert "no frame is evidence" in sample.timeline.note


def test_outcomes_are_what_the_strict_scorer_says(page):
    place = next(at for at, run in enumerate(page.runs) if run.label == "oracle")
    assert {sample.results[place].outcome for sample in page.samples} == {"right"}
    other = 1 - place
    for sample in page.samples:
        result = sample.results[other]
        score = result.scores["strict"]
        assert result.outcome == ("right" if score >= 1 else "partly" if score else "wrong")


def test_the_sections_have_their_pictures_and_tables(page):
    sections = {section.key: section for section in page.sections}
    assert list(sections) == ["results", "nieh", "comparison", "cost", "left-out"]
    titles = [chart.title for chart in sections["nieh"].charts]
    assert "nieh_mini_gt: accuracy by number of clues" in titles
    assert "oracle: accuracy by depth and size of the context" in titles
    drawn = map(draw, sections["nieh"].charts)
    assert all(svg.startswith("<svg") and "viewBox" in svg for svg in drawn)
    assert any(
        "Table 4" in row.cells[1]
        for table in sections["nieh"].tables
        for row in table.rows
        if row.is_published
    )
    primary_metrics = {row.cells[:2]: row.cells[3] for row in sections["results"].tables[0].rows}
    assert primary_metrics["oracle", "nieh_mini_gt"] == "100.0"


def test_a_run_on_blank_frames_beside_another_shows_the_gain(make_page, tmp_path, run_cli):
    words = option_words(model="oracle", tasks="nieh_mini_gt", limit="12", frames="shown,blank")
    assert run_cli(*words, "--out", tmp_path)[0] == 0
    page = make_page(*sorted((tmp_path / "oracle").iterdir()))
    (questions,) = (section for section in page.sections if section.key == "nieh")
    (chart,) = (chart for chart in questions.charts if chart.title == "Gain over blank frames")
    assert chart.description == "oracle, nieh_mini_gt +0.0"
    assert "95 % interval" in chart.caption


def test_frames_that_there_is_no_room_for_are_counted_and_clues_come_first(make_page, nieh_runs):
    page = make_page(nieh_runs[0], data=DATA, pictures=100_000)
    assert sum(map(len, page.pictures)) <= 100_000
    assert any("pictures left out" in note for note in page.notes)
    frames = [
        (sample.cluster, frame) for sample in page.samples for frame in sample.timeline.frames
    ]
    clues = {(trajectory, frame.index) for trajectory, frame in frames if frame.is_clue}
    pictured = {
        (trajectory, frame.index) for trajectory, frame in frames if frame.picture is not None
    }
    assert pictured < clues


def test_without_its_set_or_with_another_one_there_are_no_frames_and_it_is_said(
    make_page, nieh_runs, make_nieh_set, tmp_path
):
    page = make_page(nieh_runs[0], data=make_nieh_set())
    assert any("has changed since" in note for note in page.notes)
    haystack = [sample for sample in page.samples if sample.task != "nieh_mini_gt"]
    assert haystack
    assert all(sample.timeline is None for sample in haystack)


def test_the_footer_names_the_embedded_simulator_only_where_it_was_used(page, make_page, nieh_runs):
    embedded = [run for run in open_runs(nieh_runs) if "embedded" in run.simulator]
    assert bool(embedded) == bool(page.remark)
    elsewhere = replace_simulator(open_runs(nieh_runs)[:1], None)
    assert build_page(elsewhere, PageRequest(pictures=0)).remark == ""


def test_plans_have_their_steps_and_what_was_seen(make_page, scripted_run, scripted_data):
    page = make_page(scripted_run, data=scripted_data, episodes=3)
    keys = {section.key for section in page.sections}
    assert keys >= {"results", "plans", "rewards-infthor_plans", "cost"}
    seen = [sample for sample in page.samples if sample.results[0].map is not None]
    assert len(seen) == 3
    for sample in seen:
        result = sample.results[0]
        assert result.start is not None
        assert all(step.picture is not None for step in result.steps)
        assert not result.note  # it went as it was recorded
    unseen = next(
        sample for sample in page.samples if sample.results[0].steps and sample not in seen
    )
    assert unseen.results[0].steps[0].action


def test_what_takes_long_is_counted_to_its_end(nieh_runs, scripted_run, scripted_data):
    begun, counted = {}, Counter()

    class Watching:
        def begin(self, what, n):
            begun[what] = begun.get(what, 0) + n

        def advance(self, what, detail=""):
            counted[what] += 1

    runs = open_runs([*nieh_runs, scripted_run])
    build_page(runs, PageRequest(episodes=1), Watching())
    assert set(begun) == {"runs summarised", "frames read", "episodes replayed"}
    assert counted == begun
