// Sends this browser's webcam to handsteer: the newest picture, whenever the last one has arrived.

const LOOK_MS = 10;

// The camera stays with the person when a page is loaded again, or another: the tab remembers that it was given, and
// which camera ({device, size}), until the person or the server takes another; {asked} until the server has answered.
const GIVEN = "handsteer-camera", RESUME_MS = 200;

let giving = null; // {stream, video, sender, shown} while the camera is in use

// The server has the sentence for each "why"; "words" are its own.
function reportCamera(state, detail = {}) {
  emitEvent("webcam", { state, ...detail });
}

async function giveCamera(viewer) {
  if (giving) return;
  if (!navigator.mediaDevices?.getUserMedia) {
    reportCamera("off", { why: "insecure" });
    return;
  }
  const mine = giving = { video: document.createElement("video") };
  remember({ asked: true });
  try {
    await openCamera();
  } catch (problem) {
    if (giving !== mine) return; // the page is left while the camera opens: the next one asks again
    keepCamera({ why: problem.name });
    forgetCamera();
    return;
  }
  if (giving === mine) sendFrames(viewer);
}

// Opens the chosen camera of this device, and then releases the one before; without it another is taken.
async function openCamera() {
  const before = giving.stream, old = given();
  const select = document.getElementById("browser-camera");
  const device = before || !old.device ? select?.value : old.device;
  const size = (before ? undefined : old.size) ?? document.getElementById("browser-size")?.value ?? "640x480";
  const [width, height] = size.split("x");
  const wanted = { width: { ideal: +width }, height: { ideal: +height }, frameRate: { ideal: 30 } };
  if (device) wanted.deviceId = { ideal: device };
  const mine = giving;
  const stream = await navigator.mediaDevices.getUserMedia({ video: wanted, audio: false });
  if (giving !== mine) {
    for (const track of stream.getTracks()) track.stop();
    return;
  }
  mine.stream = stream;
  remember({ device, size });
  for (const track of before?.getTracks() ?? []) {
    track.onended = null;
    track.stop();
  }
  Object.assign(mine.video, { muted: true, playsInline: true, srcObject: stream });
  await mine.video.play();
  mine.sender?.postMessage({ words: "changed" });
  for (const track of stream.getTracks()) track.onended = () => keepCamera({ why: "ended" });
  listCameras(device, size);
}

function given() {
  return JSON.parse(sessionStorage.getItem(GIVEN) ?? "{}");
}

function remember(detail) {
  sessionStorage.setItem(GIVEN, JSON.stringify({ ...given(), ...detail }));
}

function forgetCamera() {
  sessionStorage.removeItem(GIVEN);
}

// The banner says "camera-off" to the driver whose browser's camera is in use, and gives no pictures.
async function resumeCamera() {
  if (giving || !sessionStorage.getItem(GIVEN)) return;
  if (!given().asked && !document.querySelector(".banner.camera-off")) return;
  const permission = await navigator.permissions?.query({ name: "camera" }).catch(() => null);
  if (permission?.state === "granted") giveCamera(window.clientId);
}
setInterval(resumeCamera, RESUME_MS);

// By whom the pictures are seen; this browser remembers it. Another of its tabs may change it.
const SEEN = "handsteer-camera-seen";
function seenBy() {
  return localStorage.getItem(SEEN) === "alone" ? "alone" : "shared";
}
function followSeen() {
  for (const each of document.querySelectorAll("[data-alone]")) each.setAttribute("aria-pressed", seenBy() === "alone");
  if (!giving?.sender || giving.seen === seenBy()) return;
  giving.seen = seenBy();
  giving.sender.postMessage({ words: giving.seen });
}
setInterval(followSeen, RESUME_MS);
document.addEventListener("click", (event) => {
  if (!event.target.closest?.("[data-alone]")) return;
  localStorage.setItem(SEEN, seenBy() === "alone" ? "shared" : "alone");
  followSeen();
});

// The names are known only once a camera was allowed.
async function listCameras(device, size) {
  const sizes = document.getElementById("browser-size");
  if (sizes) sizes.value = size;
  const select = document.getElementById("browser-camera");
  if (!select || !navigator.mediaDevices?.enumerateDevices) return;
  const chosen = device ?? select.value;
  const found = (await navigator.mediaDevices.enumerateDevices()).filter((each) => each.kind === "videoinput" && each.deviceId && each.label);
  select.replaceChildren(select.options[0], ...found.map((each) => new Option(each.label, each.deviceId)));
  select.value = found.some((each) => each.deviceId === chosen) ? chosen : "";
}

function sendFrames(viewer) {
  const { video } = giving;
  const address = new URL("camera", location.origin);
  address.searchParams.set("viewer", viewer);
  giving.seen = seenBy();
  address.searchParams.set("seen", giving.seen);
  address.protocol = address.protocol.replace("http", "ws");
  // A worker, because a page busy with drawing delays the encoding of pictures by up to a second.
  const sender = giving.sender = new Worker("/assets/webcam-sender.js");
  sender.postMessage({ address: address.href });
  sender.onmessage = ({ data }) => {
    if (given().asked && (data.hasArrived || data.closed !== undefined)) remember({ asked: undefined });
    if (data.closed !== undefined) {
      keepCamera({ words: data.closed });
      if (data.isRefused) forgetCamera();
    }
    else whenNew(video, send);
  };
  const send = async () => {
    const capturedMs = performance.now();
    // While another camera is opened, there may be no picture.
    const picture = await createImageBitmap(video).catch(() => null);
    if (giving?.sender !== sender) return;
    if (picture) sender.postMessage({ picture, capturedMs }, [picture]);
    else whenNew(video, send);
  };
  reportCamera("on");
  noteSeen("demo");
}

// A picture sent twice would only look newer than it is.
function whenNew(video, send) {
  if (video.requestVideoFrameCallback) {
    video.requestVideoFrameCallback(send);
  } else if (giving?.video === video) {
    const shown = picturesOf(video);
    if (shown === giving.shown) return void setTimeout(whenNew, LOOK_MS, video, send);
    giving.shown = shown;
    send();
  }
}

// A number that differs for each picture; older browsers provide one or the other.
function picturesOf(video) {
  return video.mozPaintedFrames || video.getVideoPlaybackQuality?.().totalVideoFrames || video.currentTime;
}

function keepCamera(detail = {}) {
  if (!giving) return;
  const { stream, sender } = giving;
  giving = null;
  for (const track of stream?.getTracks() ?? []) track.stop();
  sender?.terminate();
  reportCamera("off", detail);
}

document.addEventListener("click", (event) => {
  const button = event.target.closest?.("[data-camera]");
  if (!button) return;
  if (button.dataset.camera === "browser") giveCamera(window.clientId);
  else {
    keepCamera();
    forgetCamera();
  }
});
document.addEventListener("change", (event) => {
  if (["browser-camera", "browser-size"].includes(event.target.id) && giving) openCamera().catch((problem) => {
    keepCamera({ why: problem.name });
    forgetCamera();
  });
});
window.addEventListener("pagehide", () => keepCamera());
