// One question side by side: what each run replied to it, in each context or with each memory, and what it was shown.
const MOST_FRAMES = 24; // of an answer; longer contexts are told in words

// The samples that ask the same question, in other tasks or at other depths; with itself.
const sameQuestion = (() => {
  let groups = null; // made at the first need: a page may have many thousand samples
  const keyOf = ({ suite, id, cluster, title, target }) => [suite, id, cluster, title, target ?? ""].join("\n");
  return sample => {
    if (!groups) {
      groups = new Map();
      for (const one of samples) {
        const key = keyOf(one);
        if (groups.has(key)) groups.get(key).push(one); else groups.set(key, [one]);
      }
    }
    return groups.get(keyOf(sample));
  };
})();

// Frames that an answer was given: what a memory recalled, else what the request held, as far as it is known.
const placesOf = result => {
  if (result.recalled) return result.recalled.filter(part => typeof part === "number");
  return (promptOf(result)?.shown ?? []).flatMap(([first, last]) => Array.from({ length: last - first + 1 }, (_, at) => first + at));
};

const framesOf = (member, result) => {
  const places = placesOf(result);
  const texts = (result.recalled ?? []).filter(part => typeof part === "string");
  const told = texts.map(text => make("pre", { class: "recalled", tabindex: "0" }, text));
  if (places.length === 0) return told;
  const known = new Map([...(member.timeline?.frames ?? []), ...(member.timeline?.recalled ?? [])].map(frame => [frame.index, frame]));
  const views = [];
  const pictured = places.filter(place => known.get(place)?.picture != null);
  const cards = pictured.slice(0, MOST_FRAMES).map(place => {
    const frame = known.get(place);
    return make("figure", { class: frame.is_clue ? "clue" : "" }, picture(frame.picture, `frame ${place}`, views, factsOf(frame, [])),
      make("figcaption", {}, `${place}${frame.is_clue ? " clue" : ""}`));
  });
  const n_hidden = places.length - cards.length;
  const count = `${places.length} ${places.length === 1 ? "frame" : "frames"} ${result.recalled ? "recalled" : "shown"}`;
  const note = make("p", { class: "note" }, n_hidden > 0 ? `${count}, ${cards.length} of them here` : count);
  return [make("div", { class: "frames small" }, ...cards), note, ...told];
};

const whyOf = result => {
  if (result.why === undefined) return [];
  const text = make("pre", { tabindex: "0" });
  const fold = make("details", {}, make("summary", {}, "Why this score"), text);
  fold.addEventListener("toggle", async () => { text.textContent = (await explanationsRead())[result.why]; }, { once: true });
  return [fold];
};

const answerPart = (member, name, at) => {
  const result = member.results[at];
  if (!result) return [];
  const scores = metricsOf([member]).map(metric => `${metric} ${result.scores?.[metric]?.toFixed(2) ?? "-"}`);
  const facts = [...scores, `${secondsOf(result)} s`, `${tokensOf(result)} tokens`].join(" · ");
  return [
    make("p", { class: "reply" }, mark(result, runs[at]), ` ${name ? `${name}: ` : ""}${result.reply || result.outcome}`, reasonOf(result)),
    make("p", { class: "note" }, facts), ...framesOf(member, result), ...whyOf(result)];
};

const answers = sample => {
  const columns = sameQuestion(sample).flatMap(same => ofSuite(same).filter(([result]) => result).map(([, at]) => [same, at]));
  if (columns.length < 2) return [];
  const contexts = new Set(columns.map(([same]) => withName(same.task, same.variant)));
  const cards = () => columns.map(([same, at]) => make("section", { class: "answer" },
    make("h4", {}, runs[at], contexts.size > 1 ? make("span", { class: "note" }, ` ${withName(same.task, same.variant)}`) : null),
    ...membersOf(same).flatMap((member, number) => answerPart(member, nameOf(same, number), at))));
  const within = contexts.size > 1 ? ` in ${contexts.size} contexts` : "";
  const fold = make("details", { class: "answers" }, make("summary", {}, `Side by side: ${columns.length} answers${within}, what each was shown, and why it got its score`));
  const fill = () => {
    answers.isOpen = fold.open;
    if (fold.open && !fold.querySelector(".columns")) fold.append(make("div", { class: "columns" }, ...cards()));
  };
  fold.addEventListener("toggle", fill);
  fold.open = answers.isOpen; // as it was left at the sample before
  if (fold.open) fill();
  return [fold];
};
answers.isOpen = samples.some(({ results }) => results.some(result => result?.recalled)) || new Set(samples.map(({ task }) => task)).size > 1;
