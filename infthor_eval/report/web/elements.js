// What the parts of the browser of samples share. Whatever the data hold is put into the page as text, never as markup.
const byId = id => document.getElementById(id);
// Data of many samples, and of an index, are compressed.
const dataIn = async id => {
  const { dataset, textContent } = byId(id);
  if (dataset.packed === undefined) return JSON.parse(textContent);
  const letters = atob(textContent);
  const bytes = new Uint8Array(letters.length);
  for (let at = 0; at < letters.length; at += 1) bytes[at] = letters.charCodeAt(at); // no function for each letter
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).json();
};
const { runs, suites, metrics, samples, details, large, frames, prompts, tracebacks } = await dataIn("data");
const pictures = await dataIn("pictures");
// Why replies got their scores: read when the first one is unfolded, as there may be megabytes of them.
const explanationsRead = (() => {
  let read = null;
  return () => (read ??= dataIn("explanations"));
})();
const MARKS = { right: "✓", partly: "◐", wrong: "✗", failed: "!", "not asked": "·", excluded: "–" };

const make = (name, attributes = {}, ...children) => {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children.filter(child => child !== null));
  return element;
};
const sourceOf = number => `data:image/webp;base64,${pictures[number]}`;
const withName = (heading, name) => [heading, name].filter(Boolean).join(", ");
const mark = (result, label) => make(
  "span", { class: `mark ${(result?.outcome ?? "none").replace(" ", "-")}`, title: `${label}: ${result?.outcome ?? "not evaluated"}` },
  result ? MARKS[result.outcome] : "·");

const resultsOf = sample => sample.results.filter(Boolean);
// The samples that are one together, or the sample itself; each has a name where there are several.
const membersOf = sample => sample.members ?? [sample];
const nameOf = (sample, at) => sample.members ? `${suites[sample.suite].member} ${String.fromCharCode(65 + at)}` : "";
// Results with the places of their runs: those of the suite that have the task at all.
const runsWith = {};
for (const { task, results } of samples) results.forEach((result, at) => { if (result) (runsWith[task] ??= new Set()).add(at); });
const detailsOf = result => Object.fromEntries((result?.details ?? []).map(number => details[number]));
const ofSuite = sample => suites[sample.suite].runs.filter(at => runsWith[sample.task]?.has(at)).map(at => [sample.results[at], at]);
