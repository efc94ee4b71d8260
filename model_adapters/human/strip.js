"use strict";
// The frames of a question: one of them large, those beside it small, played and scrubbed.
class Strip {
  static BESIDE = 4; // small frames on each side
  static LOOKED_MS = 100; // a frame that is shown for so long counts as looked at

  constructor(byId) {
    this.at = 0;
    this.frames = []; // per frame: its address, and the text before it
    this.watched = new Set();
    this.parts = { frame: byId("frame"), caption: byId("caption"), scrub: byId("scrub"), place: byId("place"), strip: byId("strip"), play: byId("play"), speed: byId("speed"), player: byId("player") };
    this.parts.scrub.addEventListener("input", () => this.show(Number(this.parts.scrub.value)));
    this.parts.play.addEventListener("click", () => this.toggle());
    this.parts.speed.addEventListener("change", () => this.timer && (this.stop(), this.start()));
  }

  // Fetches and decodes the frames that are shown first, out of sight; a frame that is none is shown as one that is missing.
  async fetch(frames, at) {
    await Promise.allSettled(this.around(frames, at).map(([frame]) => {
      const image = new Image();
      image.src = frame.address;
      return image.decode();
    }));
  }

  // Takes the frames of a new question. What goes on from the frames before shows the newest, else the first. Waits until
  // the pictures are decoded.
  async load(frames, at) {
    this.stop();
    this.frames = frames;
    this.watched = new Set();
    this.parts.scrub.max = Math.max(frames.length - 1, 0);
    for (const part of ["frame", "player", "strip"]) this.parts[part].hidden = !frames.length;
    if (frames.length) this.show(at); else this.parts.caption.textContent = "No frames are shown with this question.";
    const images = frames.length ? [this.parts.frame, ...this.parts.strip.querySelectorAll("img")] : [];
    await Promise.allSettled(images.map((image) => image.decode()));
  }

  // The frame of a place and those beside it, each with its place.
  around(frames, at) {
    const first = Math.max(0, Math.min(at - Strip.BESIDE, frames.length - 2 * Strip.BESIDE - 1));
    return frames.slice(first, first + 2 * Strip.BESIDE + 1).map((frame, offset) => [frame, first + offset]);
  }

  show(place) {
    this.at = Math.max(0, Math.min(place, this.frames.length - 1));
    const { frame, caption, scrub, place: output } = this.parts, shown = this.frames[this.at];
    if (!shown) return;
    frame.src = shown.address;
    frame.alt = `frame ${this.at + 1} of ${this.frames.length}`;
    caption.textContent = shown.text;
    scrub.value = this.at;
    output.textContent = `${this.at + 1} of ${this.frames.length}`;
    clearTimeout(this.looking);
    this.looking = setTimeout((seen) => this.watched.add(seen), Strip.LOOKED_MS, this.at);
    this.showBeside();
  }

  showBeside() {
    const items = this.around(this.frames, this.at).map(([frame, place]) => {
      const item = document.createElement("li"), button = document.createElement("button"), image = document.createElement("img");
      image.src = frame.address;
      image.alt = `frame ${place + 1}`;
      button.type = "button";
      button.tabIndex = -1; // the scrub bar and the keys reach every frame
      button.setAttribute("aria-current", String(place === this.at));
      button.addEventListener("click", () => this.show(place));
      button.append(image);
      item.append(button);
      return item;
    });
    this.parts.strip.replaceChildren(...items);
  }

  toggle() { if (this.timer) this.stop(); else this.start(); }

  start() {
    if (this.at === this.frames.length - 1) this.show(0);
    this.timer = setInterval(() => {
      // The next only when this one is there, so that a slow machine skips none.
      if (!this.parts.frame.complete) return;
      if (this.at < this.frames.length - 1) this.show(this.at + 1); else this.stop();
    }, 1000 / Number(this.parts.speed.value));
    this.name("Stop", true);
  }

  stop() {
    clearInterval(this.timer);
    this.timer = null;
    this.name("Play", false);
  }

  name(text, pressed) {
    this.parts.play.textContent = text;
    this.parts.play.setAttribute("aria-pressed", String(pressed));
  }
}
