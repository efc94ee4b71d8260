// The address of a sample (#sample=ID, with task and variant where there are several), and its copying.
const KEY = "sample";

const addressOf = sample => {
  const parts = new URLSearchParams({ [KEY]: sample.id, task: sample.task });
  if (sample.variant) parts.set("variant", sample.variant);
  return `#${parts}`;
};
const hasAddress = () => new URLSearchParams(location.hash.slice(1)).has(KEY);

// The place of the sample of the page's address; -1 if there is none such. Parts that are left out fit any sample.
const findAddressed = () => {
  const asked = new URLSearchParams(location.hash.slice(1));
  const fits = (name, value) => !asked.has(name) || asked.get(name) === (value ?? "");
  const isAsked = ({ id, task, variant }) => id === asked.get(KEY) && fits("task", task) && fits("variant", variant);
  return samples.findIndex(sample => isAsked(sample) || membersOf(sample).some(isAsked));
};

const linkTo = sample => {
  const url = new URL(addressOf(sample), location.href).href;
  const button = make("button", { type: "button", class: "link", title: "Copy the address of this sample" }, "copy link");
  button.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(url);
      button.textContent = "copied";
    } catch { // no clipboard for this page: the address is there to be copied by hand
      const field = make("input", { class: "link", readonly: "", value: url, "aria-label": "Address of this sample" });
      button.replaceWith(field);
      field.select();
    }
  });
  return button;
};
