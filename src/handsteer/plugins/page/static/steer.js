// What needs the browser: how long the pad or a key is held, and whether the page is in front.

const REPEAT_MS = 100; // the server stops the robot after 300 ms without a message
const MOST_MOVED_PX = 8; // more than the page's parts move while one drives
const KEY_REPEATS_MS = 500; // systems repeat a key every 30 ms or so, once they have begun to
const KEYS = {
  ArrowUp: [0, 1], KeyW: [0, 1], ArrowDown: [0, -1], KeyS: [0, -1],
  ArrowLeft: [-1, 0], KeyA: [-1, 0], ArrowRight: [1, 0], KeyD: [1, 0],
};
const TYPED_IN = "input, textarea, select, [contenteditable]";

// The pad that is held: {pad, timer, x, y, follow}, x to the right and y up, -1 to 1. What a gamepad or a tilt holds has
// a function to follow it, which is called before each message.
let held = null;
const pressed = new Set();
// The key that the system repeats, and when it did: a menu of the browser takes the keys without a word, also keyup.
let repeating = null;
let repeatedAt = 0;

// A message that cannot be sent now must not be sent later. The clock is the wall clock, which runs on in standby.
function say(name, what = {}) {
  if (window.socket?.connected) emitEvent(name, { ...what, at: Date.now() });
}

function hold(pad, x, y, follow) {
  const length = Math.max(1, Math.hypot(x, y));
  const fresh = held === null;
  held = { pad, timer: held?.timer, x: x / length, y: y / length, follow };
  pad.classList.add("held");
  const reach = (pad.clientWidth - pad.querySelector(".knob").clientWidth) / 2;
  pad.querySelector(".knob").style.transform = `translate(${held.x * reach}px, ${-held.y * reach}px)`;
  if (fresh) {
    say("pad_held", { x: 0, y: 0 }); // it was released until now: nothing follows a pad that may be held since long
    held.timer = setInterval(sayHeld, REPEAT_MS);
    sayHeld();
  }
}

function sayHeld() {
  held.follow?.();
  if (pressed.has(repeating) && performance.now() - repeatedAt > KEY_REPEATS_MS) releasePad();
  if (held) say("pad_held", { x: held.x, y: held.y });
}

function releasePad() {
  pressed.clear();
  if (held === null) return;
  clearInterval(held.timer);
  held.pad.classList.remove("held");
  held.pad.querySelector(".knob").style.transform = "";
  held = null;
  say("let_go");
}

// When the sliders were moved last, by this clock: a movement may reach the server much later, and then counts no more.
let touching = false;
let touchedAt = -Infinity;
const touch = (event) => event.target.closest?.(".sliders") && (touchedAt = Date.now());
document.addEventListener("pointerdown", (event) => (touching = Boolean(touch(event))), true);
for (const type of ["pointerup", "pointercancel"]) {
  document.addEventListener(type, () => {
    if (touching) touchedAt = Date.now();
    touching = false;
  }, true);
}
for (const type of ["touchmove", "keydown", "click"]) document.addEventListener(type, touch, true);

// Sliders hold their velocity only while the page is visible.
const slidersInUse = () => document.querySelector(".sliders.set, .sliders:focus-within") !== null;
setInterval(() => {
  if (!slidersInUse() || document.hidden || !document.hasFocus()) return;
  say("sliders_held", { touched: touching ? 0 : Math.min(Date.now() - touchedAt, 1e9) });
}, REPEAT_MS);

function letGo() {
  releasePad();
  if (document.querySelector(".sliders.set")) say("let_go");
}

function followPointer(event, pad) {
  const box = pad.getBoundingClientRect();
  const reach = (box.width - pad.querySelector(".knob").clientWidth) / 2;
  hold(pad, (event.clientX - box.left - box.width / 2) / reach, -(event.clientY - box.top - box.height / 2) / reach);
  held.box = box;
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
  if (!held || !pad?.hasPointerCapture(event.pointerId)) return;
  if (event.pointerType === "mouse" && !(event.buttons & 1)) releasePad(); // pointerup comes with the last button only
  else followPointer(event, pad);
});
for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) {
  document.addEventListener(type, (event) => event.target.closest?.(".pad") && releasePad());
}

// Arrows scroll the page and move sliders, so they steer on the pad only; letters steer anywhere for the driver.
function padOf(event) {
  if (document.querySelector(".no-keys")) return null; // a study of another input
  const anywhere = event.code.startsWith("Key") && !event.target.closest?.(TYPED_IN);
  return event.target.closest?.(".pad") ?? (anywhere ? document.querySelector(".steer.yours .pad") : null);
}

document.addEventListener("keydown", (event) => {
  repeating = event.repeat && pressed.has(event.code) ? event.code : null;
  repeatedAt = performance.now();
  if (event.ctrlKey || event.altKey || event.metaKey) releasePad(); // with these, some systems send no keyup
  else if (event.code in KEYS) pressKey(event);
});

function pressKey(event) {
  const pad = padOf(event);
  if (!pad) return;
  event.preventDefault();
  if (event.repeat && !pressed.has(event.code)) return; // held since before this page or its seat: press it again
  pressed.add(event.code);
  followKeys(pad);
}
document.addEventListener("keyup", (event) => {
  repeating = null; // the system does not go on to repeat another key
  if (!pressed.delete(event.code)) return;
  event.preventDefault();
  followKeys(held?.pad);
});

function followKeys(pad) {
  const codes = [...pressed];
  const sum = (axis) => Math.sign(codes.reduce((total, code) => total + KEYS[code][axis], 0));
  if (codes.length && pad) hold(pad, sum(0), sum(1));
  else releasePad();
}

document.addEventListener("keydown", (event) => isSpace(event) && letGo(), true);
document.addEventListener("pointerdown", (event) => event.target.closest?.(".banner .stop") && letGo(), true);
// When a phone is turned, the pad moves, and the finger on it would command something else.
window.addEventListener("resize", () => {
  const before = held?.box, now = before && held.pad.getBoundingClientRect();
  if (now && Math.hypot(now.left - before.left, now.top - before.top) > MOST_MOVED_PX) releasePad();
});
document.addEventListener("focusout", (event) => event.target.closest?.(".pad") && releasePad());
document.addEventListener("visibilitychange", () => document.hidden && letGo());
// While a context menu is open or an element is dragged, browsers send no keyup and no pointerup.
document.addEventListener("contextmenu", (event) => (held || pressed.size) && event.preventDefault(), true);
document.addEventListener("dragstart", letGo, true);
window.addEventListener("blur", letGo);
window.addEventListener("pagehide", letGo);
