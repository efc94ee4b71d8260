// Frames that open large at a click, with what is known of each beside it; the arrow keys go on, Esc closes.
const enlarged = make("dialog", { id: "enlarged", "aria-label": "Frame" });
const openEnlarged = (() => {
  let views = [];
  let at = 0;
  const button = (text, label, act) => {
    const made = make("button", { type: "button", title: label }, text);
    made.addEventListener("click", act);
    return made;
  };
  const go = by => {
    if (views[at + by]) { at += by; draw(); }
  };
  const image = make("img");
  const [count, heading, list] = ["span", "h3", "dl"].map(name => make(name));
  const before = button("←", "Frame before (left arrow)", () => go(-1));
  const after = button("→", "Next frame (right arrow)", () => go(1));
  const close = button("×", "Close (Esc)", () => enlarged.close());
  enlarged.append(image, make("div", { class: "facts" }, make("div", { class: "go" }, before, count, after, close), heading, list));
  document.body.append(enlarged);

  const draw = () => {
    const { number, alt, facts } = views[at];
    image.src = sourceOf(large[number] ?? number);
    image.alt = heading.textContent = alt;
    count.textContent = `${at + 1} of ${views.length}`;
    before.disabled = at === 0;
    after.disabled = at === views.length - 1;
    list.replaceChildren(...facts.filter(([, value]) => value !== undefined && value !== "")
      .flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, String(value))]));
  };
  addEventListener("keydown", event => {
    const by = enlarged.open && { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (by) { go(by); event.preventDefault(); }
  });
  enlarged.addEventListener("click", event => { if (event.target === enlarged) enlarged.close(); }); // beside its contents
  return (those, start) => {
    [views, at] = [those, start];
    draw();
    enlarged.showModal();
  };
})();

// A picture that opens large, one of the views between which the arrow keys go; a blank where there was no room for it.
const picture = (number, alt, views, facts = [], attributes = {}) => {
  if (number === undefined || number === null) return make("div", { class: "blank" }, "no picture");
  const place = views.push({ number, alt, facts }) - 1;
  const button = make("button", { type: "button", class: "frame", title: "Enlarge" },
    make("img", { src: sourceOf(number), alt, loading: "lazy", ...attributes }));
  button.addEventListener("click", () => openEnlarged(views, place));
  return button;
};
