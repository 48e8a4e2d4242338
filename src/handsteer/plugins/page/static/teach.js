// What teaching needs of the browser: buttons that are held, and files that are uploaded.

let held = null;

function hold(button) {
  letGo();
  held = button;
  emitEvent("record", { key: Number(button.dataset.hold), held: true });
}

function letGo() {
  if (!held) return;
  emitEvent("record", { key: Number(held.dataset.hold), held: false });
  held = null;
}

document.addEventListener("pointerdown", (event) => {
  const button = event.target.closest?.("[data-hold]");
  if (!button || event.button !== 0) return;
  button.setPointerCapture?.(event.pointerId);
  hold(button);
});
for (const name of ["pointerup", "pointercancel"]) document.addEventListener(name, letGo);
window.addEventListener("blur", letGo);
// A long touch would otherwise open a menu.
document.addEventListener("contextmenu", (event) => {
  if (event.target.closest?.("[data-hold]")) event.preventDefault();
});

document.addEventListener("keydown", (event) => {
  const button = event.target.closest?.("[data-hold]");
  if (button && event.code === "Enter" && !event.repeat) hold(button);
});
document.addEventListener("keyup", (event) => {
  if (event.code === "Enter") letGo();
});

document.addEventListener("click", (event) => {
  if (event.target.closest?.("[data-choose]")) document.querySelector("input[data-upload]").click();
});
document.addEventListener("change", async (event) => {
  const file = event.target.matches?.("input[data-upload]") && event.target.files[0];
  if (!file) return;
  const address = event.target.dataset.upload;
  event.target.value = "";
  await fetch(address, { method: "POST", body: file }).catch(() => {}); // the page shows what came of it
});
