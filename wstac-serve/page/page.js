"use strict";
// Shows what the server sends. An update has records as `wstac run --json` prints them.

const FRAMES = 300; // of the traces
const ROWS = 200; // of the table
const SILENT = 6000; // ms without a message after which the connection is dead
const AGAIN = 1000; // ms between two attempts to connect
// What keys and buttons do in a file or a scene: seconds or frames to go.
const WAYS = {
  0: { seconds: -1e9 }, ArrowLeft: { seconds: -1 }, ArrowRight: { seconds: 1 }, ",": { frames: -1 }, ".": { frames: 1 }, " ": {}, l: {},
};
const main = document.getElementById("sensors");
const connection = document.getElementById("connection");
const pauseButton = document.getElementById("pause");
let socket = null;
let sensors = [];
let paused = false;
let heard = 0;
let drawing = false;
let chosen = 0; // the sensor of the keys r, c, u, d and Escape

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
let colors = {};
function readColors() {
  for (const name of ["row", "column", "lit", "text", "faint", "line", "card"]) colors[name] = css("--" + name);
}
readColors();
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readColors(); draw(); });

// --- numbers as text

const short = (sd) => (sd < 9.95 ? Math.max(sd, 0.1).toFixed(1) : sd.toFixed(0));
// Both with the same decimals: a rounded value must not seem to be several deviations off.
const withDeviation = (value, sd) => value.toFixed(sd < 9.95 ? 1 : 0) + " ± " + short(sd);
const angle = ({ deg, sd }) => withDeviation(sd < 9.95 ? deg : Math.round(deg) % 360, sd) + "°";
const plural = (count, noun) => count + " " + noun + (count === 1 ? "" : "s");

function speedText(event) {
  if (event.speed) return (event.speed.sd === undefined ? event.speed.mm_s : withDeviation(event.speed.mm_s, event.speed.sd)) + (event.speed.extrapolated ? " extrapolated" : "");
  if (event.speed_at_most) return "≤ " + event.speed_at_most.mm_s;
  return "–";
}

function directionText(event) {
  const direction = event.direction;
  if (!direction || direction.deg === null) return "–";
  if (direction.sd === undefined) return direction.deg + "°, " + confidenceText(direction.confidence);
  return angle(direction);
}

function textureText(texture) {
  if (!texture) return "–";
  if (texture.known === false) return "unknown";
  if (texture.specimen) return texture.specimen;
  const depth = texture.depth_mm === null || texture.depth_mm === undefined ? [] : [texture.depth_mm + " mm"];
  return [texture.class, texture.pattern].filter(Boolean).concat(depth).join(" ") || "–";
}

// What else an event tells, in the words of the command.
function moreText(event) {
  const length = ({ value, sd }) => Math.abs(value).toFixed(1) + " ± " + short(sd) + " mm";
  const { basis, width_mm: width, place_mm: place, contacts, period_mm: period, duration_frames: lit, why } = event;
  return [
    why && why.reliable,
    basis && "by the " + basis, width && length(width) + " wide",
    place && length(place) + " to the " + (place.value < 0 ? "right" : "left"), contacts > 1 && contacts + " contacts",
    period && "period " + length(period), Number.isInteger(lit) && "lit " + plural(lit + 1, "frame"),
  ].filter(Boolean).join(", ") || "–";
}

// As the command writes it. Rounded down: nothing is certain.
const confidenceText = (confidence) => "confidence " + (Math.floor(100 * confidence + 1e-9) / 100).toFixed(2);

function certaintyText({ texture, reliable }) {
  const confidence = texture?.confidence ?? null;
  const known = confidence === null ? "" : "texture " + confidenceText(confidence) + ", ";
  return known + (reliable ? "reliable" : "not reliable");
}

// --- one sensor

class Sensor {
  constructor(number, about) {
    Object.assign(this, { number, about, features: [], status: null, motion: null, picture: null, skipped: 0 });
    Object.assign(this, { angle: null, strength: 0, times: [], peak: 0.05, described: 0, frozen: null });
    this.root = document.getElementById("sensor").content.firstElementChild.cloneNode(true);
    this.title = about.name || "Sensor";
    const part = (name) => this.root.querySelector("." + name);
    this.part = part;
    this.root.setAttribute("aria-label", this.title);
    this.root.dataset.sensor = about.name || "";
    this.root.querySelector("h2").textContent = this.title;
    part("about").textContent = about.source;
    part("table").setAttribute("aria-label", "Events of " + this.title);
    const button = part("rezero");
    button.setAttribute("aria-label", "Gather a new baseline for " + this.title);
    if (number < 9) {
      button.setAttribute("aria-keyshortcuts", number + 1);
      button.append(" ", Object.assign(document.createElement("kbd"), { textContent: number + 1 }));
    }
    button.addEventListener("click", () => this.rezero());
    part("film").hidden = !about.seeks;
    part("film").setAttribute("aria-label", "Play " + this.title);
    for (const button of part("film").children) button.addEventListener("click", () => this.go(button.dataset.key));
    this.tools = new Tools(this.root, about, this.title, (action) => this.ask(action));
    for (const event of ["pointerdown", "focusin"]) this.root.addEventListener(event, () => choose(number));
    this.body = this.root.querySelector("tbody");
    this.clear();
  }

  // Shows that there is no event yet.
  clear() {
    this.body.replaceChildren();
    for (const text of [...this.about.notes, "no event yet"]) this.words("", text, "note");
    this.empty = this.body.firstElementChild;
    this.part("newest").textContent = "";
  }

  rezero() {
    this.tools.order({ order: "rezero" });
  }

  // Goes back or forth in a file or a scene, or pauses or plays it.
  go(key, factor = 1) {
    if (!this.status) return;
    const { seconds, frames } = WAYS[key];
    if (frames) this.tools.order({ order: "seek", frames, pause: true });
    else if (seconds) this.tools.order({ order: "seek", frames: Math.round(seconds * factor * this.about.rate), pause: false });
    else if (key === "l") this.tools.order({ order: "loop", on: !this.status.loops });
    else this.tools.order({ order: "play", on: this.status.paused || this.isOver() });
  }

  isOver() {
    return ["ended", "failed"].includes(this.status.phase);
  }

  // Asks the server for something. Returns whether there is a connection.
  ask(action) {
    if (!socket || socket.readyState !== WebSocket.OPEN) return false;
    socket.send(`order ${this.number} ${JSON.stringify(action)}`);
    return true;
  }

  take(update) {
    const now = performance.now();
    if (this.status && this.status.starts !== update.status.starts) this.features = [];
    // The server sends again what stays after a way back.
    if (this.status && this.status.backs !== update.status.backs) this.clear();
    this.times.push(now);
    while (now - this.times[0] > 2000) this.times.shift();
    Object.assign(this, { status: update.status, motion: update.motion, skipped: update.skipped });
    if (update.jobs) this.tools.take(update.jobs);
    this.features.push(...update.features);
    this.features.splice(0, this.features.length - FRAMES);
    for (const record of update.records) this.record(record);
  }

  // Adds a row for a record.
  record(record) {
    if (record.kind === "event") {
      const cells = [
        ["Frame", record.frame], ["Contact", record.contact || "–"], ["Speed, mm/s", speedText(record)],
        ["Direction", directionText(record)], ["Texture", textureText(record.texture)],
        ["Certainty", certaintyText(record)], ["More", moreText(record)],
      ];
      const row = this.row(cells, "event");
      row.title = Object.entries(record.why || {}).map(([name, text]) => name + ": " + text).join("; ");
      row.classList.toggle("doubtful", !record.reliable);
      this.part("newest").textContent = cells.map(([name, text]) => name + " " + text).join(", ");
    } else if (record.kind === "slip") {
      this.words(record.frame, `slip since frame ${record.onset_frame}, held since frame ${record.held_since_frame}, strength ${record.strength.toFixed(2)}`, "slip");
    } else if (record.kind === "fault") {
      this.words(record.frame, record.fault + ": " + record.message, "fault");
    } else if (record.kind === "incomplete") {
      this.words(record.frame, "incomplete event, " + plural(record.frames, "frame") + " of 70", "incomplete");
    } else if (record.kind === "end") {
      const lost = Object.entries(record.dropped_by || {});
      const reasons = lost.map(([reason, frames]) => `; ${frames}: ${reason}`).join("");
      this.words(record.frames, "end of the source, " + plural(record.dropped, "frame") + " lost" + reasons, "end");
    }
  }

  row(cells, kind) {
    if (this.empty) { this.empty.remove(); this.empty = null; }
    const row = document.createElement("tr");
    row.dataset.kind = kind;
    for (const [name, text] of cells) {
      const cell = document.createElement("td");
      cell.dataset.name = name;
      cell.append(Object.assign(document.createElement("span"), { textContent: text }));
      row.append(cell);
    }
    this.body.prepend(row);
    while (this.body.rows.length > ROWS) this.body.lastElementChild.remove();
    return row;
  }

  words(frame, text, kind) {
    const row = this.row([["Frame", frame], ["", text]], kind);
    row.lastElementChild.colSpan = 6;
    row.lastElementChild.className = "words";
  }

  draw() {
    const { status } = this;
    if (!status) return;
    this.drawPicture(this.part("picture"));
    this.drawTraces(this.part("plot"));
    const set = (name, text) => {
      const element = this.part(name);
      if (element.textContent !== String(text)) element.textContent = text;
    };
    const phases = {
      baseline: "gathering the baseline: keep everything off the sensor", watching: "watching for a touch",
      capturing: "capturing an event", ended: "the source has ended", failed: "the source has failed",
    };
    const ran = !this.isOver();
    set("phase", status.paused && ran ? "paused" : phases[status.phase] || status.phase);
    this.part("phase").className = "phase " + status.phase;
    set("play", ran && !status.paused ? "Pause" : "Play");
    this.part("loop").setAttribute("aria-pressed", String(status.loops));
    const progress = this.root.querySelector(".state progress");
    progress.hidden = !status.progress;
    if (status.progress) [progress.value, progress.max] = status.progress;
    const disturbed = "The baseline was not quiet: events are not reliable. Gather a new one with nothing touching.";
    const trouble = status.error || (status.disturbed ? disturbed : "");
    this.part("trouble").hidden = !trouble;
    set("trouble", trouble);
    const { motion } = this;
    set("motion", motion
      ? `${withDeviation(motion.speed.mm_s, motion.speed.sd)} mm/s at ${angle(motion.direction)}`
      : "nothing slides");
    this.part("motion").classList.toggle("slides", Boolean(motion));
    set("frame", status.frame);
    set("dropped", plural(status.dropped, "frame"));
    set("skipped", plural(this.skipped, "frame"));
    const span = this.times.length > 1 ? (this.times.at(-1) - this.times[0]) / 1000 : 0;
    set("rate", span > 0 && ran ? ((this.times.length - 1) / span).toFixed(0) : "–");
    this.part("delay").hidden = status.latency_ms === null;
    set("latency", `${status.latency_ms} ms, ${plural(status.camera_skipped, "frame")} skipped`);
    // Screen readers read a label again when it changes.
    if (performance.now() - this.described > 1000) this.describe();
  }

  describe() {
    this.described = performance.now();
    const { taxels } = this.status;
    const rows = taxels ? [0, 5, 10, 15, 20].map((at) => taxels.slice(at, at + 5).map((t) => (100 * t).toFixed(0)).join(" ")) : [];
    const light = rows.length ? "light of the taxels by row, in percent: " + rows.join("; ") : "no frame yet";
    this.part("picture").setAttribute("aria-label", `Picture of ${this.title}, ${light}`);
    const newest = this.features.at(-1);
    const values = newest ? newest.f.map((value) => value.toFixed(2)) : [];
    const text = newest ? `rows ${values.slice(0, 5).join(" ")}; columns ${values.slice(5).join(" ")}` : "no frame yet";
    this.part("plot").setAttribute("aria-label", `Traces of ten features of ${this.title}: ${text}`);
  }

  drawPicture(canvas) {
    const [frameWidth, frameHeight] = this.about.size;
    const context = sized(canvas, (width) => (width * frameHeight) / frameWidth);
    const scale = canvas.width / frameWidth;
    const taxels = this.status.taxels;
    // The brightest taxel, followed slowly, so that noise stays dark.
    const bright = Math.max(0.02, ...(taxels || []));
    this.peak = Math.max(bright, this.peak * 0.995);
    context.fillStyle = "#000";
    context.fillRect(0, 0, canvas.width, canvas.height);
    const glow = this.tools.glowToShow();
    const which = glow ? "the light that the calibration has seen" : "";
    if (this.part("which").textContent !== which) this.part("which").textContent = which;
    if (glow || this.picture) {
      // Of a calibration, 1 is the brightest light.
      const image = glow ? pictureImage(glow, 1 / 1.3) : pictureImage(this.picture, this.peak);
      context.imageSmoothingEnabled = true;
      context.drawImage(image, 0, 0, canvas.width, canvas.height);
    }
    const [width, height] = this.about.taxel.map((side) => side * scale);
    const calibrates = this.tools.draw(context, scale);
    context.lineWidth = Math.max(1, canvas.width / 500);
    this.about.corners.forEach(([x, y], index) => {
      if (!this.picture && taxels) {
        context.fillStyle = green(Math.sqrt(Math.min(1, taxels[index] / this.peak)));
        context.fillRect(x * scale, y * scale, width, height);
      }
      context.strokeStyle = "rgba(255, 255, 255, .55)";
      // A layout that is to be confirmed stands alone.
      if (!calibrates) context.strokeRect(x * scale, y * scale, width, height);
    });
    if (!glow) this.drawArrow(context, canvas);
  }

  // An arrow that turns towards the newest direction, and fades when nothing slides.
  drawArrow(context, canvas) {
    const { motion } = this;
    if (motion) {
      const target = (motion.direction.deg * Math.PI) / 180;
      const turn = this.angle === null ? 0 : Math.atan2(Math.sin(target - this.angle), Math.cos(target - this.angle));
      this.angle = this.angle === null ? target : this.angle + turn * 0.4;
      this.strength = Math.min(1, this.strength + 0.35);
      this.speed = motion.speed.mm_s;
    } else {
      this.strength = Math.max(0, this.strength - 0.04);
      if (this.strength === 0) this.angle = null;
    }
    if (this.angle === null) return;
    const most = Math.min(canvas.width, canvas.height);
    const length = most * (0.18 + 0.6 * Math.min(1, this.speed / 300));
    const head = most * 0.09;
    context.save();
    context.globalAlpha = this.strength;
    context.translate(canvas.width / 2, canvas.height / 2);
    // Counterclockwise: the canvas turns the other way.
    context.rotate(-this.angle);
    const path = new Path2D();
    path.moveTo(-length / 2, 0);
    path.lineTo(length / 2 - head / 2, 0);
    const tip = new Path2D();
    tip.moveTo(length / 2, 0);
    tip.lineTo(length / 2 - head, head * 0.6);
    tip.lineTo(length / 2 - head, -head * 0.6);
    tip.closePath();
    for (const [color, more] of [["#000", most / 90], ["#ffb454", 0]]) {
      Object.assign(context, { strokeStyle: color, fillStyle: color, lineJoin: "round", lineCap: "round" });
      context.lineWidth = most / 45 + 2 * more;
      context.stroke(path);
      context.fill(tip);
      context.lineWidth = 2 * more;
      if (more) context.stroke(tip);
    }
    context.restore();
  }

  drawTraces(canvas) {
    const context = sized(canvas);
    const ratio = canvas.width / canvas.clientWidth;
    const thresholds = this.status.thresholds || [];
    const values = this.features.flatMap((record) => record.f).concat(thresholds);
    let [low, high] = values.reduce(([a, b], value) => [Math.min(a, value), Math.max(b, value)], [Infinity, -Infinity]);
    if (!values.length) [low, high] = [0, 1.5];
    high = Math.max(high, low + 1.5);
    context.fillStyle = colors.card;
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.font = `${12 * ratio}px system-ui, "DejaVu Sans", sans-serif`;
    context.textBaseline = "middle";
    const [label, value] = [26 * ratio, 46 * ratio];
    const [half, height] = [canvas.width / 2, canvas.height / 5];
    const next = this.status.frame;
    for (let feature = 0; feature < 10; feature++) {
      const [left, top] = [feature < 5 ? 0 : half, (feature % 5) * height];
      const width = half - label - value;
      const x = (frame) => left + label + width * (1 - (next - 1 - frame) / FRAMES);
      const y = (number) => top + height * (0.92 - (0.84 * (number - low)) / (high - low));
      const color = feature < 5 ? colors.row : colors.column;
      context.strokeStyle = colors.line;
      context.lineWidth = ratio;
      if (feature % 5) stroke(context, [[left, top], [left + half, top]]);
      const threshold = thresholds[feature];
      if (threshold !== undefined) {
        context.strokeStyle = colors.lit;
        context.setLineDash([4 * ratio, 4 * ratio]);
        stroke(context, [[left + label, y(threshold)], [left + label + width, y(threshold)]]);
        context.setLineDash([]);
      }
      context.strokeStyle = color;
      context.lineWidth = 1.5 * ratio;
      context.lineJoin = "round";
      let line = [];
      let before = null;
      for (const record of this.features) {
        // Lost frames have no features: the line has a gap.
        if (before !== null && record.frame !== before + 1) { stroke(context, line); line = []; }
        before = record.frame;
        if (next - record.frame <= FRAMES) line.push([x(record.frame), y(record.f[feature])]);
      }
      stroke(context, line);
      context.fillStyle = color;
      context.fillText((feature < 5 ? "r" : "c") + ((feature % 5) + 1), left + 6 * ratio, top + height / 2);
      const newest = this.features.at(-1);
      if (newest) {
        const above = threshold !== undefined && newest.f[feature] > threshold;
        context.fillStyle = above ? colors.lit : colors.faint;
        context.textAlign = "right";
        context.fillText(newest.f[feature].toFixed(2), left + half - 6 * ratio, top + height / 2);
        context.textAlign = "left";
      }
    }
    context.strokeStyle = colors.line;
    context.lineWidth = ratio;
    stroke(context, [[half, 0], [half, canvas.height]]);
    const seconds = (FRAMES / this.about.rate).toFixed(0);
    const text = `rows and columns over ${seconds} s, logarithms of light from ${low.toFixed(1)} to ${high.toFixed(1)}; dashes: thresholds`;
    if (this.part("range").textContent !== text) this.part("range").textContent = text;
  }
}

function stroke(context, points) {
  if (points.length < 2) return;
  context.beginPath();
  points.forEach(([x, y], index) => (index ? context.lineTo(x, y) : context.moveTo(x, y)));
  context.stroke();
}

// Gives a canvas as many pixels as the screen has where it is, and returns its context.
function sized(canvas, heightOf) {
  const ratio = Math.min(2, devicePixelRatio || 1);
  const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
  const height = Math.max(1, Math.round(heightOf ? heightOf(width) : canvas.clientHeight * ratio));
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  return canvas.getContext("2d");
}

const green = (shade) => `rgb(${Math.round(150 * shade ** 3)}, ${Math.round(255 * shade)}, ${Math.round(190 * shade ** 2)})`;
const PALETTE = Array.from({ length: 256 }, (_, index) => green(index / 255).match(/\d+/g).map(Number));

// Returns a picture as an image, scaled so that the brightest taxel is bright.
function pictureImage({ bytes, width, height, canvas }, peak) {
  const context = canvas.getContext("2d");
  const image = context.createImageData(width, height);
  const factor = 1 / Math.sqrt(peak * 1.3);
  for (let at = 0; at < width * height; at++) {
    const [red, lit, blue] = PALETTE[Math.min(255, Math.round(bytes[at] * factor))];
    image.data.set([red, lit, blue, 255], 4 * at);
  }
  context.putImageData(image, 0, 0);
  return canvas;
}

function takePicture(buffer) {
  const view = new DataView(buffer);
  // The highest bit is of the light that a calibration has seen.
  const [number, isGlow] = [view.getUint8(0) & 0x7f, view.getUint8(0) > 0x7f];
  const sensor = sensors[number];
  if (!sensor) return;
  const [holder, name] = isGlow ? [sensor.tools, "glow"] : [sensor, "picture"];
  const [width, height] = [view.getUint16(1, true), view.getUint16(3, true)];
  let canvas = holder[name] && holder[name].canvas;
  if (!canvas || canvas.width !== width || canvas.height !== height) {
    canvas = Object.assign(document.createElement("canvas"), { width, height });
  }
  holder[name] = { bytes: new Uint8Array(buffer, 5), width, height, canvas };
}

// --- the connection

function draw() {
  drawing = false;
  if (!paused) sensors.forEach((sensor) => sensor.draw());
}

function drawSoon() {
  if (!drawing) {
    drawing = true;
    requestAnimationFrame(draw);
  }
}

function start(about) {
  const before = sensors;
  sensors = about.map((sensor, number) => new Sensor(number, sensor));
  main.replaceChildren(...sensors.map((sensor) => sensor.root));
  main.classList.toggle("several", sensors.length > 1);
  // What a person has typed survives a lost connection.
  sensors.forEach((sensor, number) => {
    const old = before[number];
    if (old && old.about.name === sensor.about.name) sensor.tools.keepLabels(old.tools.labels());
  });
  choose(Math.min(chosen, sensors.length - 1));
  const names = about.map((sensor) => sensor.name).filter(Boolean).join(", ");
  document.title = names ? `WSTac: ${names}` : "WSTac";
}

function choose(number) {
  chosen = number;
  if (sensors.length < 2) return;
  sensors.forEach((sensor, own) => sensor.root.setAttribute("aria-current", String(own === number)));
}

function say(text, lost) {
  connection.textContent = text;
  connection.classList.toggle("lost", Boolean(lost));
}

// Names and messages from files, cameras and models are shown without characters that control a line or turn the
// direction of writing, as the command shows them.
const CONTROLS = /[\u0000-\u0008\u000b-\u001f\u007f-\u009f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]/g;
const escaped = (c) => "\\u" + c.charCodeAt(0).toString(16).padStart(4, "0");
const visible = (_, value) => (typeof value === "string" ? value.replace(CONTROLS, escaped) : value);

function connect() {
  const own = new WebSocket(location.href.replace(/^http/, "ws").replace(/\/(\?|#|$).*/, "/socket") + location.search);
  socket = own;
  heard = performance.now();
  own.binaryType = "arraybuffer";
  own.onmessage = ({ data }) => {
    heard = performance.now();
    if (typeof data !== "string") {
      takePicture(data);
    } else {
      const message = JSON.parse(data, visible);
      if (message.sensors) {
        start(message.sensors);
        say("connected");
      } else if (message.refused !== undefined) {
        const sensor = sensors[message.refused];
        if (sensor) sensor.tools.refuse("Refused: " + message.why);
      } else {
        if (sensors[message.update]) sensors[message.update].take(message);
        own.send("ok");
      }
    }
    drawSoon();
  };
  own.onclose = () => {
    if (socket !== own) return;
    say("no connection: trying again", true);
    socket = null;
    sayIfRefused().finally(() => setTimeout(connect, AGAIN));
  };
}

// A server that is there and does not know this page's token refuses the page itself, too.
async function sayIfRefused() {
  const answer = await fetch(location.href, { cache: "no-store", signal: AbortSignal.timeout(SILENT) }).catch(() => null);
  if (answer && answer.status === 403) {
    say("refused: the address has a new token; open the address that wstac serve has printed", true);
  }
}

setInterval(() => {
  if (socket && performance.now() - heard > SILENT) socket.close();
}, 1000);

function pause() {
  paused = !paused;
  pauseButton.setAttribute("aria-pressed", String(paused));
  drawSoon();
}

pauseButton.addEventListener("click", pause);
document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
  // Keys that a person types into a field are text.
  if (event.target.closest && event.target.closest("input") && event.key !== "Escape") return;
  if (event.key === "p") pause();
  // Where a key has a use of its own, such as on a button or in a list that scrolls, it keeps that.
  const users = event.key === " " ? "button, summary, a, [tabindex]" : "[tabindex]";
  if (Object.hasOwn(WAYS, event.key) && !event.target.closest?.(users)) {
    const films = sensors.filter((sensor) => sensor.about.seeks);
    films.forEach((sensor) => sensor.go(event.key, event.shiftKey ? 10 : 1));
    if (films.length) event.preventDefault();
  }
  const tools = sensors[chosen] && sensors[chosen].tools;
  const actions = { r: "record", c: "calibrate", u: "use", d: "examine", Escape: "cancel" };
  if (tools && Object.hasOwn(actions, event.key)) tools[actions[event.key]]();
  const sensor = sensors[event.key - 1];
  if (sensor) sensor.rezero();
});
addEventListener("resize", drawSoon);
connect();
