// Tones and spoken words for what the driver must notice while looking at the robot. Off until it is switched on;
// this browser remembers it. The page calls cue().

const SOUND = "handsteer-sound", TONE_S = 0.12, LOUD = 0.25;
// Frequencies in Hz: up for ready, one for a sign, down for Stop.
const TONES = { ready: [523, 784], sign: [659], stopped: [392, 196] };
let audio = null;

function soundIsOn() {
  return localStorage.getItem(SOUND) === "true";
}

// Browsers permit sound only after a person has pressed something.
function wakeAudio() {
  if (!soundIsOn()) return;
  audio ??= new AudioContext();
  if (audio.state === "suspended") audio.resume();
}

function showSound() {
  document.querySelector(".sound")?.setAttribute("aria-pressed", soundIsOn());
}

function cue(kind, words) {
  if (!soundIsOn()) return;
  document.querySelector(".cue").textContent = words;
  wakeAudio();
  TONES[kind].forEach((frequency, number) => play(frequency, audio.currentTime + number * TONE_S));
}
window.cue = cue;

function play(frequency, startS) {
  const tone = new OscillatorNode(audio, { frequency }), volume = new GainNode(audio, { gain: 0 });
  volume.gain.setValueAtTime(LOUD, startS);
  volume.gain.exponentialRampToValueAtTime(0.001, startS + TONE_S); // without a click at its end
  tone.connect(volume).connect(audio.destination);
  tone.start(startS);
  tone.stop(startS + TONE_S);
}

document.addEventListener("click", (event) => {
  if (!event.target.closest?.(".sound")) return;
  localStorage.setItem(SOUND, !soundIsOn());
  showSound();
});
for (const name of ["click", "keydown"]) document.addEventListener(name, wakeAudio);
window.addEventListener("load", showSound); // the button is there
