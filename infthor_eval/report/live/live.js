"use strict";
// All that comes from the journal is set as text, never as HTML.
const EVERY_MS = 1000;
const MARKS = {right: "✓", partly: "◐", wrong: "✗", failed: "!", "not asked": "·", excluded: "–"};
const STATUS = {
  waiting: "has not started",
  running: "running",
  done: "done",
  stopped: "stopped",
  ended: "not running",
  unknown: "going on?",
  lost: "page has ended",
};
const at = id => document.getElementById(id);

function element(name, className, ...content) {
  const made = document.createElement(name);
  if (className) made.className = className;
  made.append(...content);
  return made;
}

const number = value => value.toLocaleString("en");
const percent = value => (100 * value).toFixed(1);

function duration(seconds) {
  if (seconds < 120) return seconds.toFixed(seconds < 1 ? 2 : seconds < 10 ? 1 : 0) + " s";
  return seconds < 7200 ? Math.round(seconds / 60) + " min" : (seconds / 3600).toFixed(1) + " h";
}

function explain(state) {
  const first = ` Its first sample is waited for in ${state.folder}.`;
  const texts = {
    waiting: "The run has not started." + first,
    ended: "No process of this machine writes the journal, and there are no results: the run was killed, or goes on elsewhere. The same command continues it.",
    stopped: "The run was stopped before its end. The same command continues it.",
    unknown: state.problem ? "" : "This system does not tell whether the run goes on.",
  };
  const {n_done, n_failed, n_not_asked} = state.totals;
  const lost = state.status !== "waiting" && n_failed + n_not_asked ? "Not whole: failed samples and those that were not asked are in no score; the same command tries them again." : "";
  const none = n_done && !Object.keys(state.metrics).length ? "No sample has a result yet, so there is no score." : "";
  return [state.problem, texts[state.status] || "", lost, none].filter(Boolean).join(" ");
}

function showStatus(status) {
  at("status").textContent = STATUS[status];
  at("status").className = "status " + status;
}

function showFacts(state) {
  const totals = state.totals, usage = totals.usage, facts = [];
  facts.push(["tasks", state.tasks.join(", ")]);
  if (state.simulator) facts.push(["simulator", state.simulator]);
  if (totals.n_done) {
    facts.push(["time", `${duration(totals.seconds / totals.n_done)} a sample, ${duration(totals.seconds)} of all samples`]);
  }
  if (usage.requests) {
    const cached = usage.context ? ` (${percent((usage.cached || 0) / usage.context)} % cached)` : "";
    facts.push(["tokens", `${number(usage.context || 0)} read${cached}, ${number(usage.reply || 0)} written, ${number(usage.requests)} requests`]);
  }
  if (usage.cost != null) facts.push(["cost", `${usage.cost.toFixed(4)} US dollars`]);
  if (state.age != null) facts.push(["last written", `${duration(state.age)} ago`]);
  facts.push(["folder", state.folder]);
  at("facts").replaceChildren(...facts.flatMap(([name, value]) => [element("dt", "", name), element("dd", "", value)]));
}

function showProgress(state) {
  const {n_done, n_failed, n_not_asked, n_excluded} = state.totals, total = state.n_units;
  const bar = at("bar");
  if (total) { bar.max = total; bar.value = Math.min(n_done, total); } else { bar.removeAttribute("value"); }
  if (state.status === "waiting") { bar.max = 1; bar.value = 0; }
  const of = total ? ` of ${number(total)} (${Math.floor(100 * n_done / total)} %)` : " samples";
  const more = [n_failed && `${number(n_failed)} failed`, n_not_asked && `${number(n_not_asked)} not asked`, n_excluded && `${number(n_excluded)} excluded`].filter(Boolean);
  at("count").textContent = [number(n_done) + of, ...more].join(", ");
  document.title = total ? `${number(n_done)} / ${number(total)} ${state.name}` : `${number(n_done)} ${state.name || "a run"}`;
}

function shareOf(rate) {
  const share = element("div", "share"), mean = document.createElement("b");
  if (rate.low != null) {
    const range = document.createElement("i");
    range.style.left = percent(rate.low) + "%";
    range.style.width = percent(rate.high - rate.low) + "%";
    share.append(range);
  }
  mean.style.left = percent(rate.mean) + "%";
  share.append(mean);
  return share;
}

function showMetrics(state) {
  at("results").hidden = !Object.keys(state.metrics).length;
  at("measure").textContent = state.measure + ", %";
  at("metrics").replaceChildren(...Object.entries(state.metrics).map(([task, rate]) => element("tr", "",
    element("td", "", task),
    element("td", "n", percent(rate.mean) + (rate.n_all ? ` of ${number(rate.n)} answered` : "")),
    element("td", "n", rate.low == null ? "-" : `${percent(rate.low)}–${percent(rate.high)}`),
    element("td", "n", number(rate.n_all || rate.n)),
    element("td", "", shareOf(rate)),
  )));
}

function showFailures(state) {
  at("failed").hidden = !state.failures.length;
  at("reasons").replaceChildren(...state.totals.reasons.map(([reason, n]) => element("li", "", `${number(n)} × ${reason}`)));
  at("failures").replaceChildren(...state.failures.map(sample => element("tr", "",
    element("td", "", sample.task), element("td", "", sample.id), element("td", "failed", sample.reason),
  )));
}

function sampleOf(sample, targetLabel) {
  const [read, written] = sample.tokens;
  const scores = Object.entries(sample.scores).map(([name, score]) => `${name} ${Number(score.toFixed(3))}`);
  const tokens = read == null ? [] : [`${number(read)} tokens` + (written == null ? "" : ` + ${number(written)}`)];
  const of = [sample.task, sample.id, ...(sample.target ? [`${targetLabel}: ${sample.target}`] : []), ...scores, duration(sample.seconds), ...tokens];
  return element("article", "sample",
    element("div", "q", element("span", "mark " + sample.outcome.replace(" ", "-"), MARKS[sample.outcome] || ""), " " + sample.title),
    element("div", "reply", sample.reason || sample.reply || "(empty)"),
    element("div", "of", ...of.map(text => element("span", "", text))),
  );
}

let shown = "";
function show(state) {
  const problem = explain(state);
  at("problem").textContent = problem;
  at("problem").hidden = !problem;
  showStatus(state.status);
  at("name").textContent = state.name || "A run";
  showProgress(state);
  showFacts(state);
  const rest = JSON.stringify([state.metrics, state.failures, state.totals.reasons, state.newest]);
  if (rest === shown) return;  // so that a selection of text, or a place in a long reply, remains
  shown = rest;
  showMetrics(state);
  showFailures(state);
  at("samples").hidden = !state.newest.length;
  at("newest").replaceChildren(...state.newest.map(sample => sampleOf(sample, state.target_label)));
}

async function ask() {
  try {
    const answer = await fetch("state.json");
    if (!answer.ok) throw new Error(`the page's server answers ${answer.status}`);
    show(await answer.json());
  } catch (error) {
    showStatus("lost");
    at("problem").textContent = `This page is no longer kept up to date (${error.message}); the run is not affected. Type the command again for a new address.`;
    at("problem").hidden = false;
  }
  setTimeout(ask, EVERY_MS);
}

ask();
