// What was sent: the whole prompt of a sample, which frames it shows, and the tracebacks of failures.
const within = (place, stretches) => stretches.some(([first, last]) => first <= place && place <= last);
const promptOf = result => (result?.prompt === undefined ? undefined : prompts[result.prompt]);
const isKnown = result => promptOf(result) !== undefined && !promptOf(result).problem;

const stretchesOf = places => places.map(([first, last]) => first === last ? `${first}` : `${first}–${last}`).join(", ");
const framesPart = ({ what = "frames", places = [], others = 0 }) => {
  const n = places.reduce((count, [first, last]) => count + last - first + 1, others);
  return make("span", { class: "frames-part" }, `⟦${n} × ${what}${places.length ? `: ${stretchesOf(places)}` : ""}⟧`);
};

// Labels of the runs by the value that their results have, in the order of the runs.
const runsByValue = (sample, valueOf) => {
  const labels = new Map();
  for (const [result, at] of ofSuite(sample)) {
    const value = result ? valueOf(result) : undefined;
    if (value !== undefined) labels.set(value, [...(labels.get(value) ?? []), runs[at]]);
  }
  return [...labels];
};

// The parts of a prompt, behind those of the prompts that it continues.
const promptParts = ({ parts = [], after }) => [...(after === undefined ? [] : promptParts(prompts[after])), ...parts];

const promptsOf = (sample, name) => runsByValue(sample, result => result.prompt).map(([number, labels]) => {
  const { problem, note } = prompts[number];
  const body = problem
    ? [make("p", { class: "note" }, `It is not known: ${problem}.`)]
    : [make("pre", {}, ...promptParts(prompts[number]).map(part => part === null ? sample.title : typeof part === "string" ? part : framesPart(part))),
      make("p", { class: "note" }, "As the run's journal has it. Each model has its own chat template around it.")];
  return make("details", { class: "prompt" }, make("summary", {}, "The whole prompt, ", make("b", {}, withName(labels.join(", "), name))),
    note ? make("p", { class: "note" }, note) : null, ...body);
});

const tracebacksOf = (sample, name) => runsByValue(sample, result => result.traceback).map(([number, labels]) =>
  make("details", { class: "traceback" }, make("summary", {}, "Traceback, ", make("b", {}, withName(labels.join(", "), name))),
    make("pre", {}, tracebacks[number])));

// Labels of the runs whose context left out a frame, of those whose prompt is known.
const runsWithout = (sample, place) => ofSuite(sample)
  .filter(([result]) => isKnown(result) && !within(place, promptOf(result).shown ?? []))
  .map(([, at]) => runs[at]);
