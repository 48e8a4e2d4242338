// What needs the browser: stopping the robot by a key, and remembering light or dark, and what a first visit has shown.

// Stop goes two ways: by the websocket, which the caller uses, and by requests that the server answers even while it
// builds pages. These are repeated until one is answered. data-stop on the root shows how far it is.
const STOP_REPEAT_MS = 200, PATIENCE_MS = 4000, SHOWN_MS = 2000, MOST_AT_ONCE = 4;
let press = 0, confirmed = 0, shownUntil = 0, refused = 0;
function pressStop() {
  const number = ++press;
  document.documentElement.dataset.stop = "sent";
  repeatStop(number);
  return number;
}
async function repeatStop(number) {
  let open = 0;
  while (confirmed < number && refused < number && number === press) {
    if (open < MOST_AT_ONCE) {
      open++;
      sendStop(number).finally(() => open--);
    }
    await new Promise((resolve) => setTimeout(resolve, STOP_REPEAT_MS));
  }
}
async function sendStop(number) {
  try {
    const signal = AbortSignal.timeout(PATIENCE_MS);
    const answer = await fetch(`/stop?page=${window.clientId}&press=${number}`, { method: "POST", signal });
    // This browser's session is gone: only the websocket is left; without access, as after a restart, not even that.
    if (answer.status === 401 || answer.status === 403) refused = number;
    if (answer.status === 401) document.documentElement.dataset.stop = "refused";
    if (!answer.ok || confirmed >= number) return;
  } catch {
    return; // repeated
  }
  confirmed = number;
  if (number < press) return;
  document.documentElement.dataset.stop = "confirmed";
  shownUntil = performance.now() + SHOWN_MS;
  setTimeout(() => {
    if (confirmed === press && performance.now() >= shownUntil) delete document.documentElement.dataset.stop;
  }, SHOWN_MS + 50);
}
window.pressStop = pressStop;

// The button counts when it is pressed: a finger that stays or slips, or a second one, gives no click.
let pointed = false;
document.addEventListener("pointerdown", (event) => {
  pointed = event.target.closest?.(".banner .stop") != null;
  if (pointed) emitEvent("space", { press: pressStop() });
}, true);
document.addEventListener("click", (event) => {
  if (!event.target.closest?.(".banner .stop")) return;
  if (event.detail === 0 || !pointed) emitEvent("space", { press: pressStop() }); // Enter, or what assists
  pointed = false;
}, true);

// Anywhere except where a space can be typed; a focused button would otherwise take the space key as a click.
// On-screen keyboards and remote desktops send keys without a code.
function isSpace(event) {
  return event.code === "Space" || event.key === " ";
}
const TAKES_SPACE = "input:not([type=number], [inputmode=decimal], [type=color], [readonly]), textarea:not([readonly]), [contenteditable]";
document.addEventListener("keydown", (event) => {
  if (!isSpace(event) || event.target.closest?.(TAKES_SPACE)) return;
  event.preventDefault();
  if (!event.repeat) emitEvent("space", { press: pressStop() });
}, true);
document.addEventListener("keyup", (event) => {
  if (isSpace(event) && event.target.closest?.("button")) event.preventDefault();
}, true);

// data-lost on the root: the server does not answer, so what is shown may be old; "refused" if this page has no access.
const CONNECTION_LOOK_MS = 500, OWN_ADDRESS = document.currentScript.src;
let wasConnected = false;
setInterval(async () => {
  const data = document.documentElement.dataset, connected = window.socket?.connected ?? false;
  wasConnected ||= connected;
  if (connected) delete data.lost;
  if (connected || !wasConnected || data.lost === "refused") return;
  data.lost = "";
  const answer = await fetch(OWN_ADDRESS, { cache: "no-store", signal: AbortSignal.timeout(PATIENCE_MS) }).catch(() => null);
  if (answer?.status === 401) data.lost = "refused";
}, CONNECTION_LOOK_MS);

document.addEventListener("click", (event) => {
  if (!event.target.closest?.(".theme")) return;
  Quasar.Dark.toggle();
  localStorage.setItem("handsteer-dark", Quasar.Dark.isActive);
});
// data-details on the root shows what is technical; this browser remembers it.
function showDetails(on) {
  document.documentElement.toggleAttribute("data-details", on);
  localStorage.setItem("handsteer-details", on);
  for (const button of document.querySelectorAll(".details button")) button.setAttribute("aria-expanded", on);
}
document.addEventListener("click", (event) => {
  if (event.target.closest?.(".details button")) showDetails(!document.documentElement.hasAttribute("data-details"));
});
if (localStorage.getItem("handsteer-details") === "true") {
  showDetails(true);
  window.addEventListener("load", () => showDetails(true)); // the button is there
}
// data-demo, data-coach and data-better on the root show what is new to this browser.
for (const name of ["demo", "coach", "better"]) {
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
