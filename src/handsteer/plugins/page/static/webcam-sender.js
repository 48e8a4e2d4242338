// Sends pictures in the server's format: 8 bytes with the capture time in milliseconds, then a JPEG file.

const MOST_PIXELS = 640 * 480, QUALITY = 0.8, HEADER_BYTES = 8;

let socket = null;
let canvas = null;
let sent = Promise.resolve(); // once the last picture is sent

onmessage = ({ data }) => {
  if (data.address) connect(data.address);
  else if (data.words) sent = sent.finally(() => post(data.words));
  else sent = send(data.picture, data.capturedMs);
};

function post(message) {
  if (socket.readyState === WebSocket.OPEN) socket.send(message);
}

function connect(address) {
  socket = new WebSocket(address);
  socket.onopen = () => postMessage({});
  socket.onmessage = () => postMessage({ hasArrived: true });
  socket.onclose = ({ code, reason }) => postMessage({
    closed: code === 1000 ? "" : reason || "the connection was lost",
    isRefused: code === 1000 || code >= 4400,
  });
}

async function send(picture, capturedMs) {
  const scale = Math.min(1, Math.sqrt(MOST_PIXELS / (picture.width * picture.height)));
  const width = Math.round(picture.width * scale), height = Math.round(picture.height * scale);
  if (canvas?.width !== width || canvas?.height !== height) canvas = new OffscreenCanvas(width, height);
  canvas.getContext("2d").drawImage(picture, 0, 0, width, height);
  picture.close();
  const jpeg = await canvas.convertToBlob({ type: "image/jpeg", quality: QUALITY });
  const frame = new Uint8Array(HEADER_BYTES + jpeg.size);
  new DataView(frame.buffer).setFloat64(0, capturedMs, true);
  frame.set(new Uint8Array(await jpeg.arrayBuffer()), HEADER_BYTES);
  post(frame);
}
