"use strict";
// The page asks for what is put before the person, shows it, and sends the answer. All texts are shown as text.
const byId = (id) => document.getElementById(id);
const strip = new Strip(byId);
const MOVES = { ArrowUp: "moveahead", ArrowLeft: "rotateleft", ArrowRight: "rotateright", PageUp: "lookup", PageDown: "lookdown" };
const UNKNOWN = "I do not know";
const N_WORDS = 6, AGAIN_MS = 1000;
const PAGE = String(Math.random()).slice(2);
const KEPT = "All answers are kept: start the same command again, and open the address that it prints.";
let coming = null, question = null, chosen = -1;
const clock = { before: 0, since: null }; // milliseconds for which the question is on the screen

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
      say(`The run has stopped. ${KEPT}`, true);
      byId("desk").hidden = byId("stop").hidden = true;
      leave();
      coming = null;
      seen = "";
      await new Promise((resolve) => setTimeout(resolve, AGAIN_MS));
    }
  }
}

function show(state) {
  byId("answered").textContent = `${state.answered} answered in this sitting`;
  // One of several pages cannot stop the run: its questions would go to another.
  if (state.question !== null) byId("stop").hidden = !state.question.position;
  if (state.closed || state.stopped) byId("stop").hidden = true;
  if (state.closed) {
    leave();
    byId("desk").hidden = true;
    byId("unit").textContent = "";
    byId("title").textContent = state.stopped ? "Stopped." : "All is answered. Thank you.";
    say(state.stopped ? KEPT : "The results are where the command says. This page can be closed.");
  } else if (state.stopped) {
    say("Stopping ...");
  } else if (state.question === null) {
    leave();
    coming = null;
    say("The next one comes ...");
  } else if (state.question.number !== (coming || {}).number) {
    leave();
    coming = state.question;
    say("The frames are on their way ...");
    showQuestion(state.question);
  }
}

// A question is on the screen with its frames or not at all: who could read it before would have time that is not counted.
async function showQuestion(asked) {
  const { frames, last } = inOrder(asked);
  const at = isActing(asked) ? frames.length - 1 : 0;
  await strip.fetch(frames, at);
  if (coming !== asked) return;
  byId("desk").classList.add("unseen");
  fill(asked, last);
  await strip.load(frames, at);
  byId("desk").classList.remove("unseen");
  if (coming !== asked) return;
  question = asked;
  byId("desk").hidden = false;
  say("");
  Object.assign(clock, { before: 1000 * asked.seconds, since: null });
  tellScreen();
}

function leave() {
  pauseClock();
  question = null;
}

function pauseClock() {
  if (clock.since !== null) clock.before += performance.now() - clock.since;
  clock.since = null;
}

// Tells the run whether the question is on the screen, once it is painted: the clock of the run goes as long as it is.
async function tellScreen() {
  const asked = question;
  if (asked === null) return;
  if (!document.hidden) await painted();
  if (question !== asked) return;
  pauseClock();
  if (!document.hidden) clock.since = performance.now();
  const body = JSON.stringify({ number: asked.number, page: PAGE, shows: !document.hidden });
  fetch("screen", { method: "POST", body, keepalive: true, headers: { "Content-Type": "application/json" } }).catch(() => {});
}

// A frame that is asked for is drawn before the next one is asked for.
const painted = () => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));

function fill(asked, last) {
  byId("title").textContent = asked.title || "Question";
  byId("unit").textContent = asked.position ? `${asked.unit} ${asked.position[0]} of ${asked.position[1]}` : "";
  byId("news").textContent = asked.news;
  byId("facts").replaceChildren(...asked.facts.flatMap(([name, value]) => [element("dt", name), element("dd", value)]));
  byId("question").textContent = isActing(asked) ? "" : last;
  byId("label").textContent = isActing(asked) ? "Your action" : "Your answer";
  byId("parts").replaceChildren(...asked.parts.map((part) => element("li", "frame" in part ? `[frame ${part.frame + 1}]` : part.text)));
  showReplies(asked.replies);
  byId("text").value = "";
  byId("text").blur(); // so that the keys move through the frames again
  byId("unknown").hidden = asked.only || isActing(asked);
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

const isActing = (asked = question) => asked !== null && asked.replies.some((reply) => plain(reply) === MOVES.ArrowUp);

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
  // What can be pressed, unfolded or selected keeps the keys that it has itself.
  else if (!(at.matches("button, summary") && [" ", "Enter"].includes(event.key)) && !(at instanceof HTMLSelectElement)
    && !(at instanceof HTMLInputElement && !isActing() && /^(Arrow|Page|Home|End)/.test(event.key))) elsewhere(event);
});
byId("text").addEventListener("input", complete);
byId("form").addEventListener("submit", (event) => { event.preventDefault(); send(byId("text").value); });
byId("unknown").addEventListener("click", () => send(UNKNOWN));
byId("stop").addEventListener("click", () => { say("Stopping ..."); fetch("stop", { method: "POST" }); });
byId("help").addEventListener("click", toggleKeys);
document.addEventListener("visibilitychange", tellScreen);
setInterval(() => {
  const seconds = Math.floor((clock.before + (clock.since === null ? 0 : performance.now() - clock.since)) / 1000);
  byId("clock").textContent = question === null ? "" : `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")}`;
}, 250);
follow();
