// What needs the browser: stopping the robot by a key, and remembering light or dark.

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
window.addEventListener("load", () => {
  const dark = localStorage.getItem("handsteer-dark");
  if (dark !== null) Quasar.Dark.set(dark === "true");
});
