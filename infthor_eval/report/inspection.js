"use strict";
const articles = [...document.querySelectorAll("article")];
const chosen = a => a.querySelector("input:checked")?.value ?? "";
const count = () => { left.textContent = articles.filter(a => !chosen(a)).length + " undecided"; };
document.addEventListener("change", count); count();
save.addEventListener("click", () => {
  const quote = text => '"' + text.replaceAll('"', '""') + '"';
  const rows = articles.map(a => quote(a.dataset.id) + "," + chosen(a));
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob(["question_id,decision\n" + rows.join("\n") + "\n"], {type: "text/csv"}));
  link.download = "decisions.csv"; link.click();
});
