// What a page from Python cannot do: stop the robot by a key, and remember light or dark.

// Wherever the focus is, but not where a space is typed; a button would take it as a click.
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
