// Sends this browser's webcam to handsteer: the newest picture, whenever the last one has arrived.

const LOOK_MS = 10;

let giving = null; // {stream, video, sender, shown} while the camera is in use

// The server has the sentence for each "why"; "words" are its own.
function sayCamera(state, told = {}) {
  emitEvent("webcam", { state, ...told });
}

async function giveCamera(viewer) {
  if (giving) return;
  if (!navigator.mediaDevices?.getUserMedia) {
    sayCamera("off", { why: "insecure" });
    return;
  }
  giving = { video: document.createElement("video") };
  try {
    const wanted = { width: { ideal: 640 }, height: { ideal: 480 }, frameRate: { ideal: 30 } };
    giving.stream = await navigator.mediaDevices.getUserMedia({ video: wanted, audio: false });
    Object.assign(giving.video, { muted: true, playsInline: true, srcObject: giving.stream });
    await giving.video.play();
  } catch (problem) {
    keepCamera({ why: problem.name });
    return;
  }
  for (const track of giving.stream.getTracks()) track.onended = () => keepCamera({ why: "ended" });
  sendFrames(viewer);
}

function sendFrames(viewer) {
  const { video } = giving;
  const address = new URL("camera", location.origin);
  address.searchParams.set("viewer", viewer);
  address.protocol = address.protocol.replace("http", "ws");
  // A worker, because a page busy with drawing delays the encoding of pictures by up to a second.
  const sender = giving.sender = new Worker("/assets/webcam-sender.js");
  sender.postMessage({ address: address.href });
  sender.onmessage = ({ data }) => {
    if (data.closed !== undefined) keepCamera({ words: data.closed });
    else whenNew(video, send);
  };
  const send = async () => {
    const capturedMs = performance.now();
    const picture = await createImageBitmap(video);
    sender.postMessage({ picture, capturedMs }, [picture]);
  };
  sayCamera("on");
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

function keepCamera(told = {}) {
  if (!giving) return;
  const { stream, sender } = giving;
  giving = null;
  for (const track of stream?.getTracks() ?? []) track.stop();
  sender?.terminate();
  sayCamera("off", told);
}

document.addEventListener("click", (event) => {
  const button = event.target.closest?.("[data-camera]");
  if (!button) return;
  if (button.dataset.camera === "browser") giveCamera(button.dataset.viewer);
  else keepCamera();
});
window.addEventListener("pagehide", () => keepCamera());
