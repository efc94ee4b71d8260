// Tables that are wider than the page say that they scroll, and can be scrolled with keys.
const markWide = (part = document) => {
  for (const scroll of part.querySelectorAll(".scroll")) {
    const isWide = scroll.scrollWidth > scroll.clientWidth;
    scroll.toggleAttribute("data-wide", isWide);
    if (isWide) scroll.tabIndex = 0; else scroll.removeAttribute("tabindex");
  }
};
addEventListener("resize", () => markWide());

// A link to a part behind a fold unfolds it.
const unfold = () => {
  const target = location.hash && document.getElementById(location.hash.slice(1));
  if (target?.tagName === "DETAILS") target.open = true;
};
addEventListener("hashchange", unfold);
unfold();
