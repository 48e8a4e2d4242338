// What a page from Python cannot do: feel how long the drive pad is held, and remember light or dark.

const REPEAT_MS = 100; // the server stops the robot when it hears nothing for 400 ms
const KEYS = {
  ArrowUp: [0, 1], KeyW: [0, 1], ArrowDown: [0, -1], KeyS: [0, -1],
  ArrowLeft: [-1, 0], KeyA: [-1, 0], ArrowRight: [1, 0], KeyD: [1, 0],
};

let held = null; // the pad that is held: {pad, timer, x, y}, x to the right and y up, -1 to 1
const pressed = new Set();

function hold(pad, x, y) {
  const length = Math.max(1, Math.hypot(x, y));
  const fresh = held === null;
  held = { pad, timer: held?.timer, x: x / length, y: y / length };
  pad.classList.add("held");
  const reach = (pad.clientWidth - pad.querySelector(".knob").clientWidth) / 2;
  pad.querySelector(".knob").style.transform = `translate(${held.x * reach}px, ${-held.y * reach}px)`;
  if (fresh) {
    send();
    held.timer = setInterval(send, REPEAT_MS);
  }
}

function send() {
  emitEvent("pad_held", { x: held.x, y: held.y });
}

function release() {
  pressed.clear();
  if (held === null) return;
  clearInterval(held.timer);
  held.pad.classList.remove("held");
  held.pad.querySelector(".knob").style.transform = "";
  held = null;
  emitEvent("pad_released");
}

function followPointer(event, pad) {
  const box = pad.getBoundingClientRect();
  const reach = (box.width - pad.querySelector(".knob").clientWidth) / 2;
  hold(pad, (event.clientX - box.left - box.width / 2) / reach, -(event.clientY - box.top - box.height / 2) / reach);
}

document.addEventListener("pointerdown", (event) => {
  const pad = event.target.closest?.(".pad");
  if (!pad || event.button !== 0) return;
  pad.setPointerCapture(event.pointerId);
  pad.focus({ preventScroll: true });
  followPointer(event, pad);
});
document.addEventListener("pointermove", (event) => {
  const pad = event.target.closest?.(".pad");
  if (held && pad && pad.hasPointerCapture(event.pointerId)) followPointer(event, pad);
});
for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) {
  document.addEventListener(type, (event) => event.target.closest?.(".pad") && release());
}

function followKeys(event) {
  const pad = event.target.closest?.(".pad");
  if (!pad || !(event.code in KEYS) || event.ctrlKey || event.altKey || event.metaKey) return;
  event.preventDefault();
  if (event.type === "keydown") pressed.add(event.code);
  else pressed.delete(event.code);
  const codes = [...pressed];
  const sum = (axis) => Math.sign(codes.reduce((total, code) => total + KEYS[code][axis], 0));
  if (codes.length) hold(pad, sum(0), sum(1));
  else release();
}
document.addEventListener("keydown", followKeys);
document.addEventListener("keyup", followKeys);

// Wherever the focus is, but not where a space is typed; a button would take it as a click.
document.addEventListener("keydown", (event) => {
  if (event.code !== "Space" || event.target.closest?.("input, textarea, select, [contenteditable]")) return;
  event.preventDefault();
  release();
  if (!event.repeat) emitEvent("space");
}, true);
document.addEventListener("keyup", (event) => {
  if (event.code === "Space" && event.target.closest?.("button")) event.preventDefault();
}, true);

document.addEventListener("focusout", (event) => event.target.closest?.(".pad") && release());
document.addEventListener("visibilitychange", () => document.hidden && release());
window.addEventListener("blur", release);
window.addEventListener("pagehide", release);

document.addEventListener("click", (event) => {
  if (!event.target.closest?.(".theme")) return;
  Quasar.Dark.toggle();
  localStorage.setItem("handsteer-dark", Quasar.Dark.isActive);
});
window.addEventListener("load", () => {
  const dark = localStorage.getItem("handsteer-dark");
  if (dark !== null) Quasar.Dark.set(dark === "true");
});
