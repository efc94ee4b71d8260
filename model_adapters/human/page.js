"use strict";
// The page asks for what is put before the person, shows it, and sends the answer. All texts are shown as text.
const byId = (id) => document.getElementById(id);
const strip = new Strip(byId);
const MOVES = { ArrowUp: "moveahead", ArrowLeft: "rotateleft", ArrowRight: "rotateright", PageUp: "lookup", PageDown: "lookdown" };
const UNKNOWN = "I do not know";
const N_WORDS = 6, AGAIN_MS = 1000;
let question = null, shownAt = 0, chosen = -1;

// A model's marks in a history ("<|act|>"), which are in the whole prompt, too.
const unmarked = (text) => text.replace(/<\|\w+\|>/g, " ").replace(/\s*\n\s*|  +/g, "  ").trim();
const plain = (text) => text.toLowerCase().replace(/[^a-z0-9]/g, "");
const element = (name, text) => { const made = document.createElement(name); made.textContent = text; return made; };

function say(text, isProblem = false) {
  byId("state").textContent = text;
  byId("state").className = isProblem ? "problem" : "";
}

// --- what is asked ---------------------------------------------------------------------------------------------

async function follow() {
  let seen = "";
  for (;;) {
    try {
      const answer = await fetch(`state.json?seen=${seen}`);
      if (!answer.ok) throw new Error(await answer.text());
      const state = await answer.json();
      seen = state.version;
      show(state);
      if (state.closed) return;
    } catch (error) {
      say("The run has stopped. All answers are kept: start the same command again, and open the address that it prints.", true);
      byId("desk").hidden = true;
      question = null;
      seen = "";
      await new Promise((resolve) => setTimeout(resolve, AGAIN_MS));
    }
  }
}

function show(state) {
  byId("answered").textContent = `${state.answered} answered`;
  if (state.closed) {
    question = null;
    byId("desk").hidden = true;
    byId("title").textContent = state.stopped ? "Stopped." : "All is answered. Thank you.";
    say(state.stopped ? "All answers are kept: start the same command again, and open the address that it prints."
      : "The results are where the command says. This page can be closed.");
  } else if (state.question === null) {
    if (question !== null) say("The next one comes ...");
    question = null;
  } else if (question === null || question.number !== state.question.number) {
    showQuestion(state.question);
  }
}

function showQuestion(asked) {
  question = asked;
  shownAt = performance.now() - 1000 * asked.seconds;
  say("");
  byId("desk").hidden = false;
  byId("title").textContent = asked.title || "Question";
  byId("news").textContent = asked.news;
  byId("facts").replaceChildren(...asked.facts.flatMap(([name, value]) => [element("dt", name), element("dd", value)]));
  const { frames, last } = inOrder(asked);
  byId("question").textContent = isActing() ? "" : last;
  byId("label").textContent = isActing() ? "Your action" : "Your answer";
  byId("parts").replaceChildren(...asked.parts.map((part) => element("li", "frame" in part ? `[frame ${part.frame + 1}]` : part.text)));
  strip.load(frames, isActing() ? frames.length - 1 : 0);
  showReplies(asked.replies);
  byId("text").value = "";
  byId("text").blur(); // so that the keys move through the frames again
  byId("unknown").hidden = asked.only || isActing();
  complete();
}

// The frames with the texts before them, and the text behind the last frame.
function inOrder(asked) {
  const frames = [];
  let text = "";
  for (const part of asked.parts) {
    if ("frame" in part) {
      frames.push({ address: `frames/${asked.number}/${part.frame}`, text: unmarked(text) });
      text = "";
    } else text += part.text;
  }
  return { frames, last: text.trim() };
}

const isActing = () => question !== null && question.replies.some((reply) => plain(reply) === MOVES.ArrowUp);

function showReplies(replies) {
  const keys = Object.fromEntries(Object.entries(MOVES).map(([key, move]) => [move, key.replace("Arrow", "")]));
  let number = 0;
  byId("replies").replaceChildren(...replies.map((reply) => {
    const button = element("button", ""), key = keys[plain(reply)] || (++number <= 9 ? String(number) : "");
    button.type = "button";
    button.dataset.key = key;
    if (key) button.append(element("kbd", key));
    button.append(reply);
    button.addEventListener("click", () => send(reply));
    return button;
  }));
}

// --- the answer ------------------------------------------------------------------------------------------------

async function send(text) {
  if (question === null) return;
  const body = JSON.stringify({ number: question.number, text, watched: strip.watched.size });
  try {
    const answer = await fetch("answer", { method: "POST", body, headers: { "Content-Type": "application/json" } });
    if (!answer.ok) say((await answer.json()).problem, true);
  } catch (error) {
    say("The answer was not taken: the run has stopped.", true);
  }
}

function candidates() {
  const typed = byId("text").value, start = question === null ? "" : typed.slice(typed.lastIndexOf(",") + 1).trim().toLowerCase();
  if (!start) return [];
  if (question.replies.length) return question.replies.filter((reply) => reply.toLowerCase().includes(start)).slice(0, N_WORDS);
  return question.words.filter((word) => word.toLowerCase().startsWith(start) && word.toLowerCase() !== start).slice(0, N_WORDS);
}

function complete() {
  const found = candidates();
  chosen = -1;
  byId("words").replaceChildren(...found.map((word) => {
    const item = element("li", word);
    item.setAttribute("role", "option");
    item.addEventListener("mousedown", (event) => { event.preventDefault(); take(word); });
    return item;
  }));
  byId("words").hidden = !found.length;
  byId("text").setAttribute("aria-expanded", String(found.length > 0));
}

function choose(step) {
  const items = [...byId("words").children];
  if (!items.length) return;
  chosen = (chosen + step + items.length) % items.length;
  items.forEach((item, place) => item.setAttribute("aria-selected", String(place === chosen)));
}

function take(word) {
  const field = byId("text"), comma = question.replies.length ? -1 : field.value.lastIndexOf(",");
  field.value = comma < 0 ? word : `${field.value.slice(0, comma + 1)} ${word}`;
  byId("words").hidden = true;
  chosen = -1;
}

// --- keys ------------------------------------------------------------------------------------------------------

function inField(event) {
  const items = byId("words").hidden ? [] : [...byId("words").children];
  if (event.key === "Escape") byId("text").blur();
  else if (event.key === "ArrowDown") choose(1);
  else if (event.key === "ArrowUp") choose(-1);
  else if (event.key === "Tab" && !event.shiftKey && items.length) take(items[Math.max(chosen, 0)].textContent);
  else if (event.key === "Enter" && chosen >= 0 && items.length) take(items[chosen].textContent);
  else return;
  event.preventDefault();
}

function elsewhere(event) {
  const far = event.shiftKey ? 10 : 1, reply = [...byId("replies").children].find((button) => button.dataset.key === event.key.replace("Arrow", ""));
  const steps = { ",": -1, "<": -10, ".": 1, ">": 10, ArrowLeft: -far, ArrowRight: far, Home: -Infinity, End: Infinity };
  if (event.key === "?") toggleKeys();
  else if (question === null) return;
  else if (reply) reply.click();
  else if (event.key in steps) strip.show(strip.at + steps[event.key]);
  else if (event.key === " ") strip.toggle();
  else if (event.key === "Enter") byId("text").focus();
  else if (event.key === "n" && !byId("unknown").hidden) send(UNKNOWN);
  else return;
  event.preventDefault();
}

function toggleKeys() {
  byId("keys").hidden = !byId("keys").hidden;
  byId("help").setAttribute("aria-expanded", String(!byId("keys").hidden));
}

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  const at = document.activeElement;
  if (at === byId("text")) inField(event);
  // Buttons and selections keep the keys that they have themselves.
  else if (!(at instanceof HTMLButtonElement && [" ", "Enter"].includes(event.key)) && !(at instanceof HTMLSelectElement)
    && !(at instanceof HTMLInputElement && !isActing() && /^(Arrow|Page|Home|End)/.test(event.key))) elsewhere(event);
});
byId("text").addEventListener("input", complete);
byId("form").addEventListener("submit", (event) => { event.preventDefault(); send(byId("text").value); });
byId("unknown").addEventListener("click", () => send(UNKNOWN));
byId("stop").addEventListener("click", () => fetch("stop", { method: "POST" }));
byId("help").addEventListener("click", toggleKeys);
setInterval(() => {
  const seconds = Math.floor((performance.now() - shownAt) / 1000);
  byId("clock").textContent = question === null ? "" : `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}`;
}, 250);
follow();
