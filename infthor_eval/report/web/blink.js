// One member's frame over another's, in one place: what differs is what moves. Whoever wants less motion goes on by hand.
const BLINK_MS = 700; // well below the three flashes a second that harm some readers
const BLINK_KEY = "b";

const blinker = (titles, columns) => {
  const differing = columns.filter(([, frames]) => frames.some(frame => frame.differs));
  const choices = differing.length ? differing : columns;
  if (choices.length === 0) return { elements: [], has: () => false, show: () => {} };
  const isClue = ([, frames]) => frames.some(frame => frame.is_clue);
  let column = choices.find(isClue) ?? choices[0];
  let top = 0; // the member that is seen
  let timer = null;

  const stage = make("div", { class: "stage", role: "img", "aria-live": "off" }); // nobody is told of each blink
  const place = make("span", { class: "place", role: "status" });
  const list = make("dl");
  const button = (text, title, act) => {
    const made = make("button", { type: "button", title }, text);
    made.addEventListener("click", act);
    return made;
  };
  const wantsLess = () => matchMedia("(prefers-reduced-motion: reduce)").matches;
  const turn = () => {
    top = (top + 1) % titles.length;
    [...stage.children].forEach((image, at) => { if (image.tagName === "IMG") image.classList.toggle("top", at === top); });
    stage.lastChild.textContent = titles[top];
  };
  const stop = () => {
    clearInterval(timer);
    timer = null;
    toggle.setAttribute("aria-pressed", "false");
  };
  // A sample that is no longer shown stops by itself.
  const tick = () => (stage.isConnected ? turn() : stop());
  const toggle = button("", `Show each ${titles[0].split(" ")[0]} over the other (${BLINK_KEY})`, () => {
    if (wantsLess()) turn();
    else if (timer !== null) stop();
    else {
      turn();
      timer = setInterval(tick, BLINK_MS);
      toggle.setAttribute("aria-pressed", "true");
    }
  });
  toggle.className = "switch";
  toggle.textContent = wantsLess() ? "show the other" : "blink";
  toggle.setAttribute("aria-pressed", "false");
  const go = by => show(choices[choices.indexOf(column) + by][0]);
  const before = button("←", "The frame before it that differs", () => go(-1));
  const after = button("→", "The next frame that differs", () => go(1));

  const draw = () => {
    const [index, frames_] = column;
    stage.setAttribute("aria-label", `frame ${index}, ${titles.join(" over ")}`);
    stage.replaceChildren(...frames_.map(({ picture }, at) =>
      make("img", { src: sourceOf(large[picture] ?? picture), alt: "", ...(at === top ? { class: "top" } : {}) })),
      make("span", { class: "tag" }, titles[top]));
    place.textContent = `frame ${index}`;
    const at = choices.indexOf(column);
    before.disabled = at <= 0;
    after.disabled = at < 0 || at === choices.length - 1;
    const changed = frames_.map(({ facts }) => frames[facts]?.changed ?? []);
    const isOne = changed.every(types => types.join() === changed[0].join());
    const told = isOne ? [["differs in", changed[0].join(", ")]] : titles.map((name, of) => [`differs in, ${name}`, changed[of].join(", ")]);
    const done = frames_.map(({ facts }) => frames[facts]?.action ?? "");
    const actions = done.every(action => action === done[0]) ? [["action", done[0]]] : titles.map((name, of) => [`action, ${name}`, done[of]]);
    list.replaceChildren(...[...told, ...actions].filter(([, value]) => value)
      .flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)]));
  };
  const show = index => {
    column = columns.find(([at]) => at === index);
    draw();
  };
  draw();
  const controls = make("div", { class: "controls" },
    make("p", { class: "go" }, before, place, after), make("p", {}, toggle), list);
  return { elements: [make("div", { class: "blinking" }, stage, controls)], has: index => columns.some(([at]) => at === index), show };
};
