// Sticks that move the pad: of a gamepad while a button of it is held, and the tilt of a phone while one on the page is.

const HOLDS = [0, 4, 5], STOPS = 1; // buttons of the standard mapping: A and the shoulders, B
const STICK = { dead: 0.12, full: 0.95 }, TILT = { dead: 3, full: 25 }; // of the stick's range; in degrees
const EXPO = 0.3;
const SENSOR_MS = 1500;
const SHOW_MS = 200;

// The response of recognition/hand_joystick.py: 1 at full deflection, and finer near the middle.
function respond(moved, { dead, full }) {
  const share = Math.min(1, Math.max(0, Math.abs(moved) - dead) / (full - dead));
  return Math.sign(moved) * ((1 - EXPO) * share + EXPO * share ** 3);
}

const words = { gamepad: "", tilt: "" };
let shown = "";
setInterval(() => {
  const all = Object.values(words).filter(Boolean).join("; ");
  if (all === shown || !window.socket?.connected) return;
  shown = all;
  emitEvent("sticks", { words: all });
}, SHOW_MS);

// The gamepad

let polls = false;
let gamepad = null; // its index
let isReady = false; // its buttons were released since the page came to the front
let stopped = false;

function findGamepad() {
  const all = [...navigator.getGamepads()].filter((each) => each?.connected);
  return all.find((each) => each.mapping === "standard") ?? all[0];
}

function followGamepad() {
  const found = findGamepad();
  const isPressed = (button) => found?.mapping === "standard" && found.buttons[button]?.pressed;
  if (isPressed(STOPS) && !stopped) {
    letGo();
    emitEvent("space", { press: window.pressStop() });
  }
  stopped = isPressed(STOPS);
  const isSame = found?.index === gamepad && document.hasFocus() && !document.hidden;
  gamepad = found?.index;
  words.gamepad = found ? introduce(found) : "";
  if (HOLDS.some(isPressed) && isSame && !document.querySelector(".no-gamepad")) {
    if (held ? held.follow === followGamepad : isReady) {
      const [x, y] = found.axes.map((axis) => respond(axis, STICK));
      hold(document.querySelector(".pad"), x, -y, followGamepad);
    }
    isReady = false;
  } else {
    if (held?.follow === followGamepad) releasePad();
    isReady = isSame && !HOLDS.some(isPressed);
  }
}

function introduce({ id, mapping }) {
  const name = id.replace(/^[0-9a-f]{4}-[0-9a-f]{4}-/, "").replace(/ \(.*/, "");
  const use = mapping === "standard" ? "hold A or a shoulder button, B stops" : "this browser does not know its buttons";
  return `gamepad: ${name}, ${use}`;
}

function pollGamepad() {
  followGamepad();
  polls = findGamepad() !== undefined;
  if (polls) requestAnimationFrame(pollGamepad);
}

window.addEventListener("gamepadconnected", () => polls || pollGamepad());
window.addEventListener("gamepaddisconnected", followGamepad);
document.addEventListener("visibilitychange", () => (isReady = false)); // nothing is polled while the page is hidden

// The tilt

let neutral = null; // how the phone was held when the button was pressed, in degrees
let mayTilt = typeof window.DeviceOrientationEvent?.requestPermission !== "function";

const followTilt = () => {}; // events do
const tiltOf = (event) => event.button === 0 && event.target.closest?.(".tilt");

// From how the device lies to how its screen does, whichever way up that shows the page.
function attitude({ beta, gamma }) {
  const turned = screen.orientation?.angle ?? window.orientation ?? 0; // the latter in older Safari
  const [b, c, a] = [beta, gamma, turned].map((degrees) => (degrees * Math.PI) / 180);
  // Upwards, along the device's axes: to its right, to its top, and out of its screen.
  const [right, top, out] = [-Math.cos(b) * Math.sin(c), Math.sin(b), Math.cos(b) * Math.cos(c)];
  const pitch = Math.atan2(right * Math.sin(a) + top * Math.cos(a), out);
  const roll = Math.asin(Math.max(-1, Math.min(1, top * Math.sin(a) - right * Math.cos(a))));
  return { pitch: (pitch * 180) / Math.PI, roll: (roll * 180) / Math.PI, turned };
}

function takeAttitude(event) {
  if (held?.follow !== followTilt) {
    window.removeEventListener("deviceorientation", takeAttitude);
  } else if (event.beta !== null && event.gamma !== null) {
    const now = attitude(event);
    neutral ??= now;
    words.tilt = "";
    const forward = ((neutral.pitch - now.pitch + 540) % 360) - 180;
    if (now.turned !== neutral.turned) releasePad();
    else hold(held.pad, respond(now.roll - neutral.roll, TILT), respond(forward, TILT), followTilt);
  }
}

document.addEventListener("pointerdown", (event) => {
  const button = tiltOf(event);
  if (!button || !mayTilt || held) return;
  button.setPointerCapture(event.pointerId);
  neutral = null;
  hold(document.querySelector(".pad"), 0, 0, followTilt);
  window.addEventListener("deviceorientation", takeAttitude);
  setTimeout(() => {
    if (held?.follow !== followTilt || neutral) return;
    releasePad();
    words.tilt = "tilt: this device does not tell how it is held";
  }, SENSOR_MS);
});
for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) {
  document.addEventListener(type, (event) => {
    if (event.target.closest?.(".tilt") && held?.follow === followTilt) releasePad();
  });
}
document.addEventListener("contextmenu", (event) => event.target.closest?.(".tilt") && event.preventDefault());

// Safari asks the person, and only after a whole click.
document.addEventListener("click", async (event) => {
  if (mayTilt || !tiltOf(event)) return;
  mayTilt = (await DeviceOrientationEvent.requestPermission().catch(() => "")) === "granted";
  words.tilt = mayTilt ? "tilt: allowed, now hold the button" : "tilt: not allowed; reload the page to be asked again";
});

if (matchMedia("(pointer: coarse)").matches && navigator.maxTouchPoints > 0) {
  if (!isSecureContext) words.tilt = "tilt: browsers tell it only to pages from https; docs/page.md says how";
  else if (window.DeviceOrientationEvent) document.documentElement.classList.add("tilts");
}
