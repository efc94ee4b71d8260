// A sample of several members, such as both questions of a pair of twins: their replies side by side, their frames
// one above the other.
const sum = values => values.some(value => value == null) ? null : values.reduce((one, other) => one + other, 0);
const total = results => {
  const known = results.filter(Boolean);
  return { seconds: sum(known.map(of => of.seconds ?? 0)), tokens: [0, 1].map(at => sum(known.map(of => of.tokens?.[at]))) };
};

const groupResults = sample => {
  const { members } = sample;
  const names = metricsOf(members);
  const titles = members.map((_, at) => nameOf(sample, at));
  const head = ["run", "outcome", ...titles.map(name => `${suites[sample.suite].reply}, ${name}`), ...names, "seconds", "tokens"];
  const each = (results, value) => results.map(result => result ? value(result) : "-").join(" · ");
  const rows = ofSuite(sample).map(([result, at]) => {
    const results = members.map(member => member.results[at]);
    const replies = results.map((of, member) => make("td", { class: "reply", "data-name": titles[member] },
      mark(of, titles[member]), ` ${of ? of.reply ?? "" : "not evaluated"}`, of ? reasonOf(of) : ""));
    return make("tr", {}, make("td", { class: "run" }, runs[at]),
      make("td", {}, mark(result, runs[at]), ` ${result?.outcome ?? "not evaluated"}`), ...replies,
      ...names.map(metric => numberCell(metric, each(results, of => of.scores?.[metric] === undefined ? "-" : Number(of.scores[metric].toFixed(2))))),
      numberCell("seconds", secondsOf(total(results))), numberCell("tokens", tokensOf(total(results))));
  });
  return resultTable(head, 2 + members.length, rows);
};

const isAligned = sample => Boolean(sample.members?.every(member => member.timeline));

// A column per frame number, with the frame of each member in it; those that differ are marked.
const strips = sample => {
  const { members } = sample;
  const titles = members.map((_, at) => nameOf(sample, at));
  const n_known = ofSuite(members[0]).filter(([result]) => isKnown(result)).length;
  const columns = new Map();
  members.forEach(({ timeline }, at) => (timeline.frames ?? []).forEach(frame => {
    if (!columns.has(frame.index)) columns.set(frame.index, members.map(() => undefined));
    columns.get(frame.index)[at] = frame;
  }));
  const ordered = [...columns].sort(([one], [other]) => one - other);
  const blinking = blinker(titles, ordered.filter(([, frames]) => frames.every(frame => frame && frame.picture != null)));
  const views = members.map(() => []);
  const cards = ordered.map(([index, frames]) => {
    const differs = frames.some(frame => frame?.differs);
    const pictures = frames.map((frame, at) => {
      const without = frame ? runsWithout(members[at], index) : [];
      const cell = make("div", { class: `cell ${frame ? rankOf(frame, without, n_known) : ""}` },
        picture(frame?.picture, `frame ${index}, ${titles[at]}`, views[at], frame ? factsOf(frame, without) : []));
      cell.append(make("span", { class: "tag", "aria-hidden": "true" }, titles[at].slice(-1)));
      return cell;
    });
    const text = `${index}${differs ? " ≠" : ""}${frames.some(frame => frame?.is_clue) ? " clue" : ""}`;
    const label = blinking.has(index) ? make("button", { type: "button", class: "pick", title: "Show it above, to blink" }, text) : text;
    if (typeof label !== "string") label.addEventListener("click", () => blinking.show(index));
    return make("figure", differs ? { class: "differs" } : {}, ...pictures, make("figcaption", {}, label));
  });
  const n_differing = ordered.filter(([, frames]) => frames.some(frame => frame?.differs)).length;
  const clues = members.some(({ timeline: { frames: of = [] } }) => of.some(frame => frame.is_clue))
    ? "; clues are framed in orange, dashed where a context left them out" : "";
  const remark = `differing frames (≠, framed in blue): ${n_differing} of these ${ordered.length}; ` +
    `${members[0].timeline.n_frames} frames in the trajectory${clues}`;
  return [...blinking.elements, make("div", { class: "strips" }, ...cards), make("p", { class: "note" }, remark)];
};
