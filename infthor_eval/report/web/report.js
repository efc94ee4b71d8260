// The browser of samples with its filters, its list and its keys.
(() => {
  if (!byId("samples")) {
    markWide();
    return;
  }

  // -- filters

  const fill = (id, values, all) => {
    const select = byId(id);
    select.append(make("option", { value: "" }, all), ...values.map(([value, text]) => make("option", { value }, text)));
    if (values.length < 2) select.parentElement.hidden = true;
  };
  const distinct = name => [...new Set(samples.map(sample => sample[name]).filter(Boolean))].sort().map(v => [v, v]);
  fill("task", distinct("task"), "all");
  fill("kind", distinct("kind"), "all");
  fill("clues", distinct("clues"), "all");
  fill("run", runs.map((label, at) => [String(at), label]), "any");
  fill("against", runs.map((label, at) => [String(at), label]), "-");
  fill("sort", [...Object.keys(ORDERS), ...metrics].map(name => [name, name]), "as asked");
  fill("outcome", Object.keys(MARKS).map(name => [name, name]), "all");
  if (metrics.length < 2 || !Object.values(suites).some(labels => labels.compares_scorers)) byId("disagree").parentElement.hidden = true;
  if (runs.length < 2) byId("differ").parentElement.hidden = true;

  // Two runs disagree where the outcomes of a question differ, in whichever context each was asked it.
  const outcomesOf = (sample, at) => sample.results[at] ? [sample.results[at].outcome]
    : sameQuestion(sample).map(({ results }) => results[at]?.outcome).filter(Boolean);
  const disagreeOn = (sample, one, other) => Boolean(sample.results[one] ?? sample.results[other])
    && outcomesOf(sample, one).some(outcome => outcomesOf(sample, other).some(theirs => theirs !== outcome));
  const disagrees = result => {
    const scores = metrics.map(name => result.scores?.[name]).filter(score => score !== undefined);
    return new Set(scores).size > 1;
  };
  const wordsOf = sample => [
    sample.title, sample.target, sample.cluster, sample.id, sample.variant,
    ...resultsOf(sample).flatMap(result => [
      result.reply, result.reason, ...(result.details ?? []).map(number => details[number][1]), ...(result.steps ?? []).map(step => step.action)]),
  ];
  const textOf = sample => [sample.id, ...membersOf(sample).flatMap(wordsOf)].join("\n").toLowerCase();
  let texts = null; // made when the page is there and nobody waits, or at the first search if that comes before
  const index = () => { texts ??= samples.map(textOf); };
  (window.requestIdleCallback ?? setTimeout)(index); // Safari has no idle callbacks
  const contains = wanted => {
    index();
    return (_, at) => texts[at].includes(wanted);
  };

  // The tests of the filters that are set. They are read once, not for each of many thousand samples; the search is
  // last, as it takes longest.
  const setFilters = () => {
    const [task, kind, clues, run, against, outcome] = ["task", "kind", "clues", "run", "against", "outcome"].map(id => byId(id).value);
    const wanted = byId("search").value.trim().toLowerCase();
    const of = run === "" ? resultsOf : sample => [sample.results[Number(run)]].filter(Boolean);
    return [
      task && (sample => sample.task === task),
      kind && (sample => sample.kind === kind),
      clues && (sample => sample.clues === clues),
      run && (sample => sample.results[Number(run)]),
      outcome && (sample => of(sample).some(result => result.outcome === outcome)),
      against && (sample => (run === "" ? runs.map((_, at) => at) : [Number(run)]).some(at => disagreeOn(sample, at, Number(against)))),
      byId("disagree").checked && (sample => suites[sample.suite].compares_scorers && membersOf(sample).flatMap(of).some(disagrees)),
      byId("differ").checked && (sample => new Set(ofSuite(sample).map(([result]) => result?.outcome)).size > 1),
      wanted && contains(wanted),
    ].filter(Boolean);
  };

  // -- the list

  const HEIGHT = 78; // pixels of an item, as in the style sheet: by it the list knows which ones are in view
  const BEYOND = 10; // items above and below those in view
  const list = byId("list");
  const items = list.appendChild(make("div", { class: "items" }));
  let shown = [];
  let chosen = -1; // place among the shown ones

  const item = place => {
    const sample = samples[shown[place]];
    const marks = make("span", {}, ...ofSuite(sample).map(([result, at]) => mark(result, runs[at])));
    const facts = [sample.kind, sample.variant, sample.cluster].filter(Boolean).map(text => make("span", {}, text));
    const element = make(
      "div", { class: "item", role: "option", "data-place": place, id: `item-${place}`, "aria-selected": place === chosen,
        "aria-posinset": place + 1, "aria-setsize": shown.length },
      make("div", { class: "q" }, sample.title), make("div", { class: "of" }, marks, ...facts));
    element.style.top = `${place * HEIGHT}px`;
    return element;
  };
  // Only the items in view are elements: thousands would block the page for seconds.
  const draw = () => {
    const first = Math.max(Math.floor(list.scrollTop / HEIGHT) - BEYOND, 0);
    const end = Math.min(Math.ceil((list.scrollTop + list.clientHeight) / HEIGHT) + BEYOND, shown.length);
    items.style.height = `${shown.length * HEIGHT}px`;
    items.replaceChildren(...Array.from({ length: Math.max(end - first, 0) }, (_, offset) => item(first + offset)));
  };
  list.addEventListener("scroll", draw);
  addEventListener("resize", draw);
  list.addEventListener("click", event => {
    const clicked = event.target.closest(".item");
    if (clicked) choose(Number(clicked.dataset.place));
  });

  const filter = (setsAddress, fromTop = false) => {
    const tests = setFilters();
    const before = fromTop ? undefined : shown[chosen];
    const order = orderOf(byId("sort").value, byId("run").value, byId("descending").checked);
    shown = tests.length ? order.filter(at => tests.every(test => test(samples[at], at))) : order;
    byId("descending").parentElement.hidden = !byId("sort").value;
    byId("count").textContent = `${shown.length} of ${samples.length}`;
    chosen = -1;
    list.scrollTop = 0;
    if (shown.length) {
      choose(Math.max(shown.indexOf(before), 0), setsAddress);
    } else {
      draw();
      byId("sample").replaceChildren(make("p", { class: "note" }, "No sample matches the filters."));
    }
  };

  const choose = (place, setsAddress = true) => {
    const sample = samples[shown[place]];
    chosen = place;
    draw(); // the list has its height before it is scrolled
    const top = place * HEIGHT;
    if (top < list.scrollTop) list.scrollTop = top;
    if (top + HEIGHT > list.scrollTop + list.clientHeight) list.scrollTop = top + HEIGHT - list.clientHeight;
    draw();
    list.setAttribute("aria-activedescendant", `item-${place}`);
    byId("sample").replaceChildren(...partsOf(sample));
    markWide(byId("sample"));
    if (setsAddress) history.replaceState(null, "", addressOf(sample));
  };

  // The page opens with the sample of its address, which no filter hides then.
  const openAddressed = () => {
    if (!hasAddress()) return;
    const at = findAddressed();
    byId("samples").scrollIntoView();
    if (at < 0) {
      byId("sample").prepend(make("p", { class: "error" }, `This page has no sample ${location.hash}; others are in the list.`));
      return;
    }
    if (!shown.includes(at)) {
      byId("filters").reset();
      filter(false);
    }
    choose(shown.indexOf(at));
  };

  // -- keyboard

  addEventListener("keydown", event => {
    if (event.ctrlKey || event.metaKey || event.altKey || enlarged.open) return;
    const isTyping = ["INPUT", "SELECT"].includes(event.target.tagName);
    if (event.key === "Escape") { byId("filters").reset(); event.target.blur(); return; }
    if (isTyping) return;
    const isInList = event.target === list;
    if (event.key === "j" || (isInList && event.key === "ArrowDown")) {
      if (chosen + 1 < shown.length) choose(chosen + 1);
    } else if (event.key === "k" || (isInList && event.key === "ArrowUp")) {
      if (chosen > 0) choose(chosen - 1);
    } else if (event.key === "/") byId("search").focus();
    else if (event.key === "b") byId("sample").querySelector(".switch")?.click();
    else return;
    event.preventDefault();
  });
  // An address that the page has is that of the sample shown; a page without one gets it with the first choice.
  const filterAnew = ({ target }) => filter(hasAddress(), ["sort", "descending"].includes(target.id)); // another order begins at its top
  byId("filters").addEventListener("input", filterAnew);
  byId("filters").addEventListener("submit", event => event.preventDefault());
  byId("filters").addEventListener("reset", () => setTimeout(() => filter(hasAddress()))); // the fields have their values after the event
  addEventListener("hashchange", openAddressed);
  filter(false);
  openAddressed();
  markWide();
})();
