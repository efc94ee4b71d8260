"use strict";
// The browser of samples. Whatever the data hold is put into the page as text, never as markup.
(() => {
  const root = document.documentElement;
  const byId = id => document.getElementById(id);
  const toggleTheme = () => {
    const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    root.dataset.theme = dark ? "light" : "dark";
  };
  byId("theme").addEventListener("click", toggleTheme);
  if (!byId("samples")) {
    addEventListener("keydown", event => { if (event.key === "t") toggleTheme(); });
    return;
  }

  const { runs, suites, metrics, samples, pictures } = JSON.parse(byId("data").textContent);
  const MARKS = { right: "✓", partly: "◐", wrong: "✗", failed: "!", excluded: "–" };
  const BATCH = 120; // list items added at a time: thousands at once would block the page for seconds
  let shown = [];
  let chosen = -1;

  const make = (name, attributes = {}, ...children) => {
    const element = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.append(...children.filter(child => child !== null));
    return element;
  };
  const picture = (number, alt) => number === undefined || number === null
    ? make("div", { class: "blank" }, "no picture")
    : make("img", { src: `data:image/webp;base64,${pictures[number]}`, alt, loading: "lazy" });
    const mark = (result, label) => make(
    "span", { class: `mark ${result?.outcome ?? "none"}`, title: `${label}: ${result?.outcome ?? "not evaluated"}` },
    result ? MARKS[result.outcome] : "·");

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
  fill("outcome", Object.keys(MARKS).map(name => [name, name]), "all");
  if (metrics.length < 2 || !Object.values(suites).some(labels => labels.compares_scorers)) byId("disagree").parentElement.hidden = true;
  if (runs.length < 2) byId("differ").parentElement.hidden = true;

  const resultsOf = sample => sample.results.filter(Boolean);
  const ofSuite = sample => suites[sample.suite].runs.map(at => [sample.results[at], at]); // with places of the runs
  const disagrees = result => {
    const scores = metrics.map(name => result.scores?.[name]).filter(score => score !== undefined);
    return new Set(scores).size > 1;
  };
  const texts = samples.map(sample => [
    sample.title, sample.target, sample.cluster, sample.id, sample.variant,
    ...resultsOf(sample).flatMap(result => [
      result.reply, result.reason, ...Object.values(result.details ?? {}), ...(result.steps ?? []).map(step => step.action)]),
  ].join("\n").toLowerCase());

  const matches = (sample, at) => {
    const value = id => byId(id).value;
    const of = value("run") === "" ? resultsOf(sample) : [sample.results[Number(value("run"))]].filter(Boolean);
    return (!value("task") || sample.task === value("task"))
      && (!value("kind") || sample.kind === value("kind"))
      && (!value("clues") || sample.clues === value("clues"))
      && of.length > 0
      && (!value("outcome") || of.some(result => result.outcome === value("outcome")))
      && (!byId("disagree").checked || (suites[sample.suite].compares_scorers && of.some(disagrees)))
      && (!byId("differ").checked || new Set(ofSuite(sample).map(([result]) => result?.outcome)).size > 1)
      && texts[at].includes(value("search").trim().toLowerCase());
  };

  // -- the list

  const list = byId("list");
  const item = place => {
    const sample = samples[shown[place]];
    const marks = make("span", {}, ...ofSuite(sample).map(([result, at]) => mark(result, runs[at])));
    const facts = [sample.kind, sample.variant, sample.cluster].filter(Boolean).map(text => make("span", {}, text));
    const element = make("div", { class: "item", role: "option", "data-place": place, id: `item-${place}` },
      make("div", { class: "q" }, sample.title), make("div", { class: "of" }, marks, ...facts));
    if (place === chosen) element.setAttribute("aria-selected", "true");
    return element;
  };
  const more = () => {
    const from = list.children.length;
    list.append(...shown.slice(from, from + BATCH).map((_, offset) => item(from + offset)));
  };
  list.addEventListener("scroll", () => {
    if (list.scrollTop + list.clientHeight > list.scrollHeight - 400) more();
  });
  list.addEventListener("click", event => {
    const clicked = event.target.closest(".item");
    if (clicked) choose(Number(clicked.dataset.place));
  });

  const filter = () => {
    shown = samples.map((_, at) => at).filter(at => matches(samples[at], at));
    byId("count").textContent = `${shown.length} of ${samples.length}`;
    list.replaceChildren();
    list.scrollTop = 0;
    chosen = -1;
    more();
    if (shown.length) choose(0, false);
    else byId("sample").replaceChildren(make("p", { class: "note" }, "No sample matches the filters."));
  };

  const choose = (place, intoView = true) => {
    list.querySelector('[aria-selected="true"]')?.removeAttribute("aria-selected");
    chosen = place;
    while (list.children.length <= place) more();
    const element = list.children[place];
    element.setAttribute("aria-selected", "true");
    list.setAttribute("aria-activedescendant", element.id);
    if (intoView) element.scrollIntoView({ block: "nearest" });
    show(samples[shown[place]]);
  };

  // -- one sample

  const show = sample => {
    const facts = [sample.suite, sample.task, sample.kind, sample.clues && `clues: ${sample.clues}`, sample.variant,
      sample.cluster, sample.id].filter(Boolean).join("  ·  ");
    byId("sample").replaceChildren(
      make("h3", {}, sample.title),
      sample.target ? make("p", { class: "target" }, `${suites[sample.suite].target}: `, make("b", {}, sample.target)) : "",
      results(sample),
      ...details(sample),
      ...(sample.timeline ? timeline(sample.timeline) : []),
      ...episodes(sample),
      make("p", { class: "note" }, facts));
  };

  const results = sample => {
    const names = metrics.filter(name => resultsOf(sample).some(result => result.scores?.[name] !== undefined));
    const head = ["run", "", suites[sample.suite].reply, ...names, "seconds", "tokens"];
    const rows = ofSuite(sample).map(([result, at]) => {
      if (!result) return make("tr", {}, make("td", {}, runs[at]), make("td", {}, mark(null, runs[at])), make("td", { class: "note" }, "not evaluated"));
      const reason = [result.reason, ...(result.faults ?? [])].filter(Boolean).join("; ");
      const reply = make("td", {}, result.reply ?? "", reason ? make("span", { class: "note" }, ` (${reason})`) : "");
      const scores = names.map(name => make("td", { class: "n" }, result.scores?.[name]?.toFixed(2) ?? "-"));
      const [context, cached] = result.tokens ?? [];
      const tokens = context == null ? "-" : context.toLocaleString("en") + (cached ? ` (${cached.toLocaleString("en")} cached)` : "");
      return make("tr", {}, make("td", {}, runs[at]), make("td", {}, mark(result, runs[at]), ` ${result.outcome}`), reply,
        ...scores, make("td", { class: "n" }, (result.seconds ?? 0).toFixed(2)), make("td", { class: "n" }, tokens));
    });
    return make("div", { class: "scroll" }, make("table", { class: "results" },
      make("thead", {}, make("tr", {}, ...head.map((name, at) => make("th", at > 2 ? { class: "n" } : {}, name)))),
      make("tbody", {}, ...rows)));
  };

  // What the records of a suite without a presenter hold.
  const details = sample => sample.results
    .map((result, at) => result?.details ? [result.details, runs[at]] : null).filter(Boolean)
    .map(([facts, label]) => make("div", { class: "details" }, make("b", {}, label), make("dl", {},
      ...Object.entries(facts).flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)]))));

  const timeline = ({ n_frames, frames = [], note }) => {
    const left = frame => `left: ${(100 * frame.index / Math.max(n_frames - 1, 1)).toFixed(2)}%`;
    const line = make("div", { class: "line", role: "img", "aria-label": `where the frames lie among ${n_frames}` });
    for (const frame of frames) {
      const place = make("i", { class: frame.is_clue ? "clue" : "", title: `frame ${frame.index}` });
      place.style.cssText = left(frame);
      line.append(place);
    }
    const cards = frames.map(frame => make("figure", { class: frame.is_clue ? "clue" : "" },
      picture(frame.picture, `frame ${frame.index}`),
      make("figcaption", {}, `${frame.index}${frame.is_clue ? " clue" : ""}`)));
    const clues = frames.some(frame => frame.is_clue) ? "; clues are framed in orange" : "";
    const remark = make("p", { class: "note" }, `${n_frames} frames in the trajectory${clues}${note ? `; ${note}` : ""}`);
    return [line, make("div", { class: "frames" }, ...cards), remark];
  };

  // Of many runs the first two are open, the others at a click.
  const episodes = sample => sample.results
    .map((result, at) => result?.steps ? [result, runs[at]] : null).filter(Boolean)
    .map(([result, label], number) => episode(result, label, number < 2));

  const episode = (result, label, isOpen) => {
    const seen = result.start !== undefined || result.steps.some(step => step.picture !== undefined);
    const earns = result.steps.some(step => step.reward !== undefined);
    const head = ["", ...(seen ? ["frame after it"] : []), "action", ...(earns ? ["reward"] : []), ""];
    const start = seen && result.start !== undefined
      ? [make("tr", {}, make("td", {}, "0"), make("td", {}, picture(result.start, "at the start")), make("td", { class: "note" }, "at the start"))] : [];
    const rows = result.steps.map((step, at) => make("tr", {},
      make("td", {}, String(at + 1)),
      ...(seen ? [make("td", {}, step.picture === undefined ? "" : picture(step.picture, `after action ${at + 1}`))] : []),
      make("td", {}, make("code", {}, step.action || "(no valid action)"),
        step.reply ? make("div", { class: "note" }, `reply: ${step.reply}`) : null,
        step.error ? make("div", { class: "error" }, step.error) : null),
      ...(earns ? [make("td", { class: "n" }, step.reward === undefined ? "" : step.reward.toFixed(1))] : []),
      make("td", { class: "note" }, step.note ?? "")));
    const table = make("table", {}, make("thead", {}, make("tr", {}, ...head.map(name => make("th", {}, name)))),
      make("tbody", {}, ...start, ...rows));
    const map = result.map === undefined ? null
      : make("img", { class: "map", src: `data:image/webp;base64,${pictures[result.map]}`, alt: "map at the end" });
    const count = `${result.steps.length} ${result.steps.length === 1 ? "action" : "actions"}`;
    return make("details", isOpen ? { open: "" } : {}, make("summary", {}, make("b", {}, label), `: ${count}`),
      result.note ? make("p", { class: "note" }, `the replay differs from the run: ${result.note}`) : null,
      make("div", { class: "episode" }, make("div", { class: "steps" }, table), map));
  };

  // -- keyboard

  addEventListener("keydown", event => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const isTyping = ["INPUT", "SELECT"].includes(event.target.tagName);
    if (event.key === "Escape") { byId("filters").reset(); event.target.blur(); return; }
    if (isTyping) return;
    const isInList = event.target === list;
    if (event.key === "j" || (isInList && event.key === "ArrowDown")) {
      if (chosen + 1 < shown.length) choose(chosen + 1);
    } else if (event.key === "k" || (isInList && event.key === "ArrowUp")) {
      if (chosen > 0) choose(chosen - 1);
    } else if (event.key === "/") byId("search").focus();
    else if (event.key === "t") toggleTheme();
    else return;
    event.preventDefault();
  });
  byId("filters").addEventListener("input", filter);
  byId("filters").addEventListener("submit", event => event.preventDefault());
  byId("filters").addEventListener("reset", () => setTimeout(filter));
  filter();
})();
