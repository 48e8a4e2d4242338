// What needs the browser: stopping the robot by a key, and remembering light or dark, and what a first visit has shown.

// Anywhere except in text inputs; a focused button would otherwise take the space key as a click.
document.addEventListener("keydown", (event) => {
  if (event.code !== "Space" || event.target.closest?.("input:not([type=number]), textarea, select, [contenteditable]")) return;
  event.preventDefault();
  if (!event.repeat) emitEvent("space");
}, true);
document.addEventListener("keyup", (event) => {
  if (event.code === "Space" && event.target.closest?.("button")) event.preventDefault();
}, true);

document.addEventListener("click", (event) => {
  if (!event.target.closest?.(".theme")) return;
  Quasar.Dark.toggle();
  localStorage.setItem("handsteer-dark", Quasar.Dark.isActive);
});
// data-demo and data-coach on the root show what is new to this browser.
for (const name of ["demo", "coach"]) {
  if (!localStorage.getItem(`handsteer-${name}`)) document.documentElement.dataset[name] = "new";
}
function noteSeen(name, shownMs = 0) {
  localStorage.setItem(`handsteer-${name}`, "seen");
  setTimeout(() => delete document.documentElement.dataset[name], shownMs);
}
document.addEventListener("click", (event) => {
  const seen = event.target.closest?.("[data-seen]")?.dataset.seen;
  if (seen) noteSeen(seen);
});
window.addEventListener("load", () => {
  const dark = localStorage.getItem("handsteer-dark");
  if (dark !== null) Quasar.Dark.set(dark === "true");
});
