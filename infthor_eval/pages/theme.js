// Light or dark: a button, and a key where nothing is being typed.
(() => {
  const toggle = () => {
    const root = document.documentElement;
    const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    root.dataset.theme = dark ? "light" : "dark";
  };
  document.getElementById("theme").addEventListener("click", toggle);
  addEventListener("keydown", event => {
    const isTyping = ["INPUT", "SELECT"].includes(event.target.tagName);
    if (event.key === "t" && !isTyping && !event.ctrlKey && !event.metaKey && !event.altKey) toggle();
  });
})();
