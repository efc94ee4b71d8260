"""The page in a real browser, from its file: it opens, filters work, pictures load, hostile text
stays text."""

from urllib.parse import parse_qs, quote

import msgspec
import pytest

from .conftest import HOSTILE, changed


def count(tab):
    return tab.locator("#count").inner_text()


def test_it_opens_without_errors_and_fetches_nothing(page, open_page):
    opened = open_page(page)
    assert count(opened.tab) == f"{len(page.samples)} of {len(page.samples)}"
    assert opened.tab.locator("#sample h3").inner_text() == page.samples[0].title
    assert opened.tab.locator("figure.chart svg").count() == sum(
        len(section.charts) for section in page.sections
    )
    assert all(url.startswith(("file:", "data:")) for url in opened.requests)


def test_filters_show_what_they_say(page, tab):
    blind = next(at for at, run in enumerate(page.runs) if run.label == "blind")
    tab.select_option("#run", label="blind")
    tab.select_option("#outcome", "wrong")
    wrong = [sample for sample in page.samples if sample.results[blind].outcome == "wrong"]
    assert count(tab) == f"{len(wrong)} of {len(page.samples)}"
    assert tab.locator("#sample h3").inner_text() == wrong[0].title
    tab.keyboard.press("Escape")
    tab.wait_for_function(
        "document.getElementById('count').textContent.startsWith("
        + repr(f"{len(page.samples)} of")
        + ")"
    )
    tab.check("#disagree")
    disagreed = sum(
        any(len(set(it.scores.values())) > 1 for it in sample.results) for sample in page.samples
    )
    assert count(tab).startswith(f"{disagreed} of")
    tab.uncheck("#disagree")
    tab.check("#differ")
    differ = sum(len({it.outcome for it in sample.results}) > 1 for sample in page.samples)
    assert count(tab).startswith(f"{differ} of")
    tab.fill("#search", page.samples[3].title)
    assert tab.locator(".item").count() >= 1
    assert tab.locator("#sample h3").inner_text() == page.samples[3].title


def test_pictures_of_a_sample_load(page, tab):
    tab.locator("#sample").scroll_into_view_if_needed()
    tab.eval_on_selector_all(
        "#sample > .frames img", "them => Promise.all(them.map(it => it.decode())).then(() => true)"
    )
    widths = tab.eval_on_selector_all(
        "#sample > .frames img", "them => them.map(it => it.naturalWidth)"
    )
    assert len(widths) == len(page.samples[0].timeline.frames)
    assert all(width > 100 for width in widths)


def test_an_absence_has_five_frames_and_no_clue(page, tab):
    place = next(
        at
        for at, sample in enumerate(page.samples)
        if "no frame is evidence" in sample.timeline.note
    )
    tab.fill("#search", page.samples[place].title)
    tab.select_option("#clues", "absence")
    assert tab.locator("#sample > .frames figure").count() == 5
    assert tab.locator("#sample .clue").count() == 0
    assert "no frame is evidence" in tab.locator("#sample").inner_text()
    assert "orange" not in tab.locator("#sample").inner_text()


def test_samples_of_a_suite_have_its_runs_alone(make_page, nieh_runs, scripted_run, open_page):
    page = make_page(*nieh_runs, scripted_run, episodes=0)
    tab = open_page(page).tab
    labels = {suite: {page.runs[at].label for at in it.runs} for suite, it in page.suites.items()}
    for suite, task in (("nieh", "nieh_mini_gt"), ("plans", "infthor_plans")):
        tab.select_option("#task", task)
        assert (
            set(tab.locator("#sample .results tbody tr td:first-child").all_inner_texts())
            == labels[suite]
        )
        assert tab.locator(".item >> nth=0").locator(".mark").count() == len(labels[suite])
        assert "not evaluated" not in tab.locator("#sample").inner_text()


def test_a_run_without_the_task_of_a_sample_is_not_listed_and_one_that_stopped_before_it_is(
    page, open_page
):
    def only(sample, place):
        results = tuple(result if at == place else None for at, result in enumerate(sample.results))
        return msgspec.structs.replace(sample, results=results)

    first, second, third = (
        msgspec.structs.replace(page.samples[at], task=task)
        for at, task in enumerate(("a", "a", "b"))
    )
    samples = [first, only(second, 0), only(third, 1)]
    tab = open_page(changed(page, samples=samples)).tab
    listed = []
    for _ in samples:
        rows = tab.locator("#sample .results tbody tr")
        listed.append([rows.nth(at).inner_text().split()[0] for at in range(rows.count())])
        tab.keyboard.press("j")
    labels = [run.label for run in page.runs]
    assert listed == [labels, labels, labels[1:]]


def title(tab):
    return tab.locator("#sample h3").inner_text()


def facts(tab):
    return tab.locator("#sample > .note").last.inner_text()


def test_a_sample_has_an_address_that_opens_it(page, tab):
    there = page.samples[-1]
    file, _, fragment = tab.url.partition("#")
    assert fragment == ""
    tab.goto(f"{file}#sample={quote(there.id, safe='')}&variant={quote(there.variant)}")
    assert (there.id in facts(tab), there.variant in facts(tab)) == (True, True)
    tab.keyboard.press("k")
    before = page.samples[-2]
    address = tab.url
    in_address = parse_qs(address.partition("#")[2])
    assert (in_address["sample"], in_address["task"]) == ([before.id], [before.task])
    tab.goto("about:blank")
    tab.goto(address)
    assert title(tab) == before.title
    assert tab.locator('[aria-selected="true"]').get_attribute("data-place") == str(
        len(page.samples) - 2
    )


def test_the_address_survives_filters_that_its_sample_passes(page, tab):
    tab.locator(".item >> nth=4").click()
    address, sample = tab.url, page.samples[4]
    for change in (
        lambda: tab.select_option("#task", sample.task),
        lambda: tab.fill("#search", sample.title),
    ):
        change()
        assert (tab.url, title(tab)) == (address, sample.title)
    tab.fill("#search", "no such words")
    assert tab.url == address
    tab.keyboard.press("Escape")
    tab.wait_for_selector("#sample h3")
    other = next(it for it in page.samples if it.kind != sample.kind)
    tab.select_option("#kind", other.kind)  # another sample is shown, and its address
    assert parse_qs(tab.url.partition("#")[2])["sample"] == [other.id]


def test_an_address_is_followed_on_the_open_page_and_past_filters(page, tab):
    tab.fill("#search", "no such words")
    tab.evaluate(
        "address => { location.hash = address }", f"sample={quote(page.samples[7].id, safe='')}"
    )
    tab.wait_for_selector("#sample h3")
    assert title(tab) == page.samples[7].title
    assert count(tab).startswith(f"{len(page.samples)} of")
    tab.evaluate("location.hash = 'sample=nowhere'")
    assert "This page has no sample #sample=nowhere" in tab.locator("#sample .error").inner_text()


def test_the_link_of_a_sample_is_copied(page, open_page):
    tab = open_page(page, permissions=["clipboard-read", "clipboard-write"]).tab
    tab.keyboard.press("j")
    tab.click("button.link")
    tab.wait_for_function("document.querySelector('button.link').textContent === 'copied'")
    assert tab.evaluate("navigator.clipboard.readText()") == tab.url
    assert parse_qs(tab.url.partition("#")[2])["sample"] == [page.samples[1].id]


def test_without_a_clipboard_the_link_is_there_to_be_copied_by_hand(tab):
    tab.evaluate("void (navigator.clipboard.writeText = () => Promise.reject(new Error('denied')))")
    tab.keyboard.press("j")
    tab.click("button.link")
    assert tab.locator("input.link").input_value() == tab.url
    assert tab.evaluate("getSelection().toString()") == tab.url


def enlarged(tab):
    terms, values = (tab.locator(f"#enlarged {name}").all_inner_texts() for name in ("dt", "dd"))
    return dict(zip(terms, values, strict=True))


def test_a_frame_opens_large_with_its_step_and_the_arrows_go_on(page, tab):
    frames = page.samples[0].timeline.frames
    tab.fill("#search", page.samples[0].title)
    tab.locator("#sample > .frames button.frame").nth(1).click()
    image = tab.locator("#enlarged img")
    image.evaluate("it => it.decode()")
    assert image.evaluate("it => it.naturalWidth") == 300  # the set's own size
    facts = page.frames[frames[1].facts]
    assert enlarged(tab)["action"] == facts.action
    assert enlarged(tab)["step"] == str(facts.step)
    assert enlarged(tab)["succeeded"] == "yes"
    assert enlarged(tab)["in view"] == ", ".join(facts.objects)
    assert enlarged(tab)["agent"] == facts.pose
    enlarged_frames = [enlarged(tab)["frame"]]
    # The first one has none before it.
    for key in ("ArrowRight", "ArrowLeft", "ArrowLeft", "ArrowLeft"):
        tab.keyboard.press(key)
        enlarged_frames.append(enlarged(tab)["frame"])
    at = [f"{frame.index}, a clue" if frame.is_clue else str(frame.index) for frame in frames]
    assert enlarged_frames == [at[1], at[2], at[1], at[0], at[0]]
    tab.keyboard.press("j")  # a key of the page behind it
    assert title(tab) == page.samples[0].title
    tab.keyboard.press("Escape")
    assert tab.locator("#enlarged").is_hidden()
    assert tab.input_value("#search") == page.samples[0].title  # which Esc would have emptied


def go_to_episode(tab, page):
    """Choose the first sample with pictures of its episode; its result."""
    place = next(at for at, sample in enumerate(page.samples) if sample.results[0].map is not None)
    for _ in range(place):
        tab.keyboard.press("j")
    return page.samples[place].results[0]


def test_a_frame_of_an_episode_opens_large_with_its_action(
    make_page, scripted_run, scripted_data, open_page
):
    page = make_page(scripted_run, data=scripted_data, episodes=2)
    tab = open_page(page).tab
    episode = go_to_episode(tab, page)
    tab.locator(".steps button.frame").nth(1).click()
    assert enlarged(tab)["action"] == episode.steps[0].action
    tab.get_by_title("Close").click()
    assert tab.locator("#enlarged").is_hidden()


def test_keys_go_through_the_samples(page, tab):
    for key, place in (("j", 1), ("j", 2), ("k", 1)):
        tab.keyboard.press(key)
        assert tab.locator('[aria-selected="true"]').get_attribute("data-place") == str(place)
        assert tab.locator("#sample h3").inner_text() == page.samples[place].title
    tab.keyboard.press("/")
    tab.keyboard.type("jk")  # letters of a search, not keys
    assert tab.input_value("#search") == "jk"
    tab.keyboard.press("Escape")
    tab.keyboard.press("t")
    assert tab.evaluate("document.documentElement.dataset.theme") == "dark"


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_can_be_read_in_both_schemes(page, open_page, scheme):
    tab = open_page(page, color_scheme=scheme).tab
    ink, paper = (
        tab.evaluate(f"getComputedStyle(document.body).{name}").removeprefix("rgb(").split(",")[0]
        for name in ("color", "backgroundColor")
    )
    assert (int(ink) > 200, int(paper) < 60) == (
        (True, True) if scheme == "dark" else (False, False)
    )
    in_chart = tab.evaluate(
        "getComputedStyle(document.querySelector('figure.chart svg text')).fill"
    )
    assert in_chart == tab.evaluate("getComputedStyle(document.body).color")


def test_hostile_text_stays_text(page, open_page):
    sample = page.samples[0]
    results = tuple(
        msgspec.structs.replace(it, reply=HOSTILE, reason=HOSTILE, faults=(HOSTILE,))
        for it in sample.results
    )
    hostile = msgspec.structs.replace(
        sample,
        title=HOSTILE,
        target=HOSTILE,
        kind=HOSTILE,
        cluster=HOSTILE,
        variant=HOSTILE,
        results=results,
    )
    runs = [
        page.runs[0].__class__(HOSTILE, ((HOSTILE, HOSTILE),), HOSTILE, HOSTILE) for _ in page.runs
    ]
    opened = open_page(changed(page, samples=[hostile], runs=runs, title=HOSTILE))
    assert opened.tab.locator("#sample h3").inner_text().startswith("</script><img")
    assert opened.tab.evaluate("window.hacked") is None
    assert opened.tab.locator("#sample img[onerror], #list img, main img[src=x]").count() == 0


def test_an_episode_has_its_steps_and_its_map(make_page, scripted_run, scripted_data, open_page):
    page = make_page(scripted_run, data=scripted_data, episodes=2)
    tab = open_page(page).tab
    steps = go_to_episode(tab, page).steps
    assert tab.locator(".steps tbody tr").count() == len(steps) + 1
    assert tab.locator("img.map").evaluate("it => it.naturalWidth") == 300


def test_of_many_samples_only_those_in_view_are_elements(page, open_page):
    many = changed(page, samples=list(page.samples) * 10)
    tab, last = open_page(many).tab, len(many.samples) - 1
    assert 1 < tab.locator(".item").count() < 50
    tab.locator("#list").evaluate("it => it.scrollTo(0, it.scrollHeight)")
    tab.locator(f'.item[data-place="{last}"]').click()
    assert tab.locator("#sample h3").inner_text() == many.samples[last].title
    assert tab.locator(".item").count() < 50
    tab.keyboard.press("k")
    chosen = tab.locator('[aria-selected="true"]')
    assert chosen.get_attribute("data-place") == str(last - 1)
    assert (chosen.get_attribute("aria-posinset"), chosen.get_attribute("aria-setsize")) == (
        str(last),
        str(last + 1),
    )
