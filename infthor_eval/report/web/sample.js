// One sample: the question, the results of all runs, frames and episodes.
const partsOf = sample => {
  const facts = [sample.suite, sample.task, sample.kind, sample.clues && `clues: ${sample.clues}`, sample.variant,
    sample.cluster, sample.id].filter(Boolean).join("  ·  ");
  // Parts of each member, which are named where there are several.
  const ofEach = partsOfOne => membersOf(sample).flatMap((member, at) => partsOfOne(member, nameOf(sample, at)));
  const shown = isAligned(sample) ? strips(sample) : ofEach(member => member.timeline ? timeline(member, member.timeline) : []);
  return [
    make("div", { class: "head" }, make("h3", {}, sample.title), linkTo(sample)),
    ...targets(sample),
    sample.members ? groupResults(sample) : results(sample),
    ...answers(sample),
    ...shown,
    ...ofEach(episodes),
    ...ofEach((member, name) => folded(name && `Further facts, ${name}`, detailRows(member))),
    ...ofEach(tracebacksOf),
    ...ofEach(promptsOf),
    make("p", { class: "note" }, facts),
  ];
};

// What is right: of each member where there are several, with its own title if that is another one.
const targets = sample => {
  const told = membersOf(sample).map((member, at) => [member, nameOf(sample, at)]).filter(([member]) => member.target);
  return told.length === 0 ? [] : [make("p", { class: "target" }, `${suites[sample.suite].target}: `, ...told.map(([member, name]) => make("span", {},
    name && `${name} `, member.title === sample.title ? "" : `${member.title} `, make("b", {}, member.target))))];
};

const numberCell = (name, value) => make("td", { class: "n", "data-name": name }, value); // on narrow pages its name is beside it
const metricsOf = members => metrics.filter(name => members.flatMap(resultsOf).some(result => result.scores?.[name] !== undefined));
const secondsOf = result => (result.seconds ?? 0).toFixed(2);
const tokensOf = ({ tokens: [context, cached] = [] }) =>
  context == null ? "-" : context.toLocaleString("en") + (cached ? ` (${cached.toLocaleString("en")} cached)` : "");
const reasonOf = result => {
  const reason = [result.reason, ...(result.faults ?? [])].filter(Boolean).join("; ");
  return reason ? make("span", { class: "note" }, ` (${reason})`) : "";
};
const resultTable = (head, n_words, rows) => make("div", { class: "scroll" }, make("table", { class: "results" },
  make("thead", {}, make("tr", {}, ...head.map((name, at) => make("th", at < n_words ? {} : { class: "n" }, name)))),
  make("tbody", {}, ...rows)));

const results = sample => {
  const names = metricsOf([sample]);
  const head = ["run", "outcome", suites[sample.suite].reply, ...names, "seconds", "tokens"];
  const rows = ofSuite(sample).map(([result, at]) => {
    const name = make("td", { class: "run" }, runs[at]);
    if (!result) return make("tr", {}, name, make("td", {}, mark(null, runs[at])), make("td", { class: "note" }, "not evaluated"));
    const reply = make("td", { class: "reply" }, result.reply ?? "", reasonOf(result));
    const scores = names.map(metric => numberCell(metric, result.scores?.[metric]?.toFixed(2) ?? "-"));
    return make("tr", {}, name, make("td", {}, mark(result, runs[at]), ` ${result.outcome}`), reply,
      ...scores, numberCell("seconds", secondsOf(result)), numberCell("tokens", tokensOf(result)));
  });
  return resultTable(head, 3, rows);
};

// Parts below a heading that unfolds them; as they are without one.
const folded = (heading, parts) => heading && parts.length ? [make("details", {}, make("summary", {}, heading), ...parts)] : parts;

// Further facts: once where all runs have the same, else by run.
const detailRows = sample => {
  const told = ofSuite(sample).filter(([result]) => result?.details).map(([result, at]) => [detailsOf(result), runs[at]]);
  const isCommon = (name, value) => told.length > 1 && told.every(([facts]) => facts[name] === value);
  const block = (heading, facts) => facts.length === 0 ? [] : [make("div", { class: "details" }, make("b", {}, heading),
    make("dl", {}, ...facts.flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)])))];
  const [common, own] = [true, false].map(wanted => told.map(([facts, label]) =>
    [label, Object.entries(facts).filter(([name, value]) => isCommon(name, value) === wanted)]));
  return [...(common.length ? block("all runs", common[0][1]) : []), ...own.flatMap(([label, facts]) => block(label, facts))];
};

const factsOf = ({ index, is_clue, facts }, without) => {
  const { step, action, error, objects = [], held = [], pose, changed = [] } = frames[facts] ?? {};
  return [
    ["frame", is_clue ? `${index}, a clue` : index], ["step", step], ["action", action || (index === 0 ? "none yet" : "")],
    ["succeeded", action ? (error ? `no: ${error}` : "yes") : ""], ["in the hand", held.join(", ")],
    ["in view", objects.join(", ")], ["agent", pose], ["differs in", changed.join(", ")],
    ["not shown to", without.join(", ")]];
};

// Whether a frame is a clue, and whether the contexts of the runs showed it; the enlarged frame says which left it out.
const rankOf = (frame, without, n_known) => {
  if (!frame.is_clue) return "";
  if (without.length === 0) return "clue";
  return without.length === n_known ? "clue outside" : "clue partly-outside";
};
const RANKS = { "": "", clue: " clue", "clue outside": " clue, not shown", "clue partly-outside": " clue, not shown to all" };

const timeline = (sample, { n_frames, frames: shown = [], note }) => {
  const left = frame => `left: ${(100 * frame.index / Math.max(n_frames - 1, 1)).toFixed(2)}%`;
  const line = make("div", { class: "line", role: "img", "aria-label": `where the frames lie among ${n_frames}` });
  const n_known = ofSuite(sample).filter(([result]) => isKnown(result)).length;
  const views = [];
  const cards = shown.map(frame => {
    const without = runsWithout(sample, frame.index);
    const rank = rankOf(frame, without, n_known);
    const place = make("i", { class: rank, title: `frame ${frame.index}${RANKS[rank]}` });
    place.style.cssText = left(frame);
    line.append(place);
    return make("figure", { class: rank }, picture(frame.picture, `frame ${frame.index}`, views, factsOf(frame, without)),
      make("figcaption", {}, `${frame.index}${RANKS[rank]}`));
  });
  const clues = shown.some(frame => frame.is_clue) ? "; clues are framed in orange, dashed where a context left them out" : "";
  const remark = make("p", { class: "note" }, `${n_frames} frames in the trajectory${clues}${note ? `; ${note}` : ""}`);
  return [line, make("div", { class: "frames" }, ...cards), remark];
};

// Of many runs the first two are open, the others at a click.
const episodes = (sample, name) => sample.results
  .map((result, at) => result?.steps ? [result, runs[at]] : null).filter(Boolean)
  .map(([result, label], number) => episode(result, withName(label, name), number < 2));

const factsOfStep = ({ action, error, reply, reward, note }) => [
  ["action", action || "none that is valid"], ["succeeded", error ? `no: ${error}` : "yes"], ["reply", reply],
  ["reward", reward?.toFixed(1)], ["note", note]];

const episode = (result, label, isOpen) => {
  const views = [];
  const seen = result.start !== undefined || result.steps.some(step => step.picture !== undefined);
  const earns = result.steps.some(step => step.reward !== undefined);
  const head = ["", ...(seen ? ["frame after it"] : []), "action", ...(earns ? ["reward"] : []), ""];
  const start = seen && result.start !== undefined
    ? [make("tr", {}, make("td", {}, "0"), make("td", {}, picture(result.start, "at the start", views)), make("td", { class: "note" }, "at the start"))] : [];
  const rows = result.steps.map((step, at) => make("tr", {},
    make("td", {}, String(at + 1)),
    ...(seen ? [make("td", {}, step.picture === undefined ? "" : picture(step.picture, `after action ${at + 1}`, views, factsOfStep(step)))] : []),
    make("td", {}, make("code", {}, step.action || "(no valid action)"),
      step.reply ? make("div", { class: "note" }, `reply: ${step.reply}`) : null,
      step.error ? make("div", { class: "error" }, step.error) : null),
    ...(earns ? [make("td", { class: "n" }, step.reward === undefined ? "" : step.reward.toFixed(1))] : []),
    make("td", { class: "note" }, step.note ?? "")));
  const table = make("table", {}, make("thead", {}, make("tr", {}, ...head.map(name => make("th", {}, name)))),
    make("tbody", {}, ...start, ...rows));
  const map = result.map === undefined ? null
    : picture(result.map, "map at the end", [], [], { class: "map", loading: "eager" });
  const count = `${result.steps.length} ${result.steps.length === 1 ? "action" : "actions"}`;
  return make("details", isOpen ? { open: "" } : {}, make("summary", {}, make("b", {}, label), `: ${count}`),
    result.note ? make("p", { class: "note" }, `the replay differs from the run: ${result.note}`) : null,
    make("div", { class: "episode" }, make("div", { class: "steps" }, table), map));
};
