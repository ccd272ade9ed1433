"use strict";
// The tools of a sensor: recordings with labels, calibration, the doctor. The server does what is asked, and says in
// `jobs` what is in progress and how the last one of each kind has ended.

const LABELS = ["specimen", "speed", "direction"];
const ROW = 5; // taxels

class Tools {
  // `ask` sends an action to the server, and returns whether there is a connection.
  constructor(root, about, title, ask) {
    Object.assign(this, { root, about, ask, jobs: {}, job: null, url: null, glow: null });
    this.tool = (name) => root.querySelector(".tool." + name);
    for (const [name, action] of [
      ["start", () => this.calibrate()], ["use", () => this.use()], ["cancel", () => this.cancel()],
      ["examine", () => this.examine()],
    ]) {
      root.querySelector("." + name).addEventListener("click", action);
    }
    this.form = root.querySelector("form");
    this.form.setAttribute("aria-label", "Labels of a recording of " + title);
    this.form.addEventListener("submit", (event) => { event.preventDefault(); this.record(); });
    this.title = title;
    for (const button of root.querySelectorAll(".tools button")) this.name(button, button.firstChild.textContent.trim());
    this.form.hidden = !about.record_to;
    this.set("record", "where", about.record_to
      ? `Files go to the folder ${about.record_to} on the server, as ${about.name || "wstac"}-1.mcap and so on.`
      : "Recording is off. To turn it on, start wstac serve with --record-to FOLDER.");
    this.show();
  }

  set(tool, part, text) {
    const element = this.tool(tool).querySelector("." + part);
    if (element.textContent !== text) element.textContent = text;
  }

  // Says what a button does now. A screen reader says of which of several sensors, too.
  name(button, text) {
    if (button.firstChild.textContent.trim() !== text) button.firstChild.textContent = text + " ";
    const label = `${text}: ${this.title}`;
    if (this.about.name && button.getAttribute("aria-label") !== label) button.setAttribute("aria-label", label);
  }

  labels() {
    return Object.fromEntries(LABELS.map((name) => [name, this.form.elements[name].value.trim()]));
  }

  keepLabels(labels) {
    for (const name of LABELS) this.form.elements[name].value = labels[name];
  }

  // --- what a person asks for

  order(action) {
    const isSent = this.ask(action);
    this.refuse(isSent ? "" : "There is no connection to the server.");
    return isSent;
  }

  refuse(why) {
    const element = this.root.querySelector(".refused");
    element.hidden = !why;
    element.textContent = why;
  }

  is(kind) {
    return Boolean(this.job) && this.job.kind === kind;
  }

  record() {
    this.tool("record").open = true;
    this.order(this.is("recording") ? { order: "stop" } : { order: "record", labels: this.labels() });
  }

  calibrate() {
    this.tool("calibrate").open = true;
    if (!this.is("calibration")) this.order({ order: "calibrate" });
    else if (this.job.is_ready && !this.job.proposal) this.order({ order: "find" });
  }

  use() {
    if (this.is("calibration") && this.job.proposal) this.order({ order: "use", proposal: this.job.proposal.number });
  }

  cancel() {
    if (this.job && !this.is("recording")) this.order({ order: "stop" });
  }

  examine() {
    this.tool("doctor").open = true;
    if (this.is("examination")) this.cancel();
    else this.order({ order: "examine" });
  }

  // --- what the server says

  take(jobs) {
    const before = this.job && this.job.kind;
    this.jobs = jobs;
    this.job = jobs.job;
    if (jobs.layout) Object.assign(this.about, jobs.layout);
    if (this.job && this.job.kind !== before) {
      this.tool({ recording: "record", calibration: "calibrate", examination: "doctor" }[this.job.kind]).open = true;
    }
    this.show();
  }

  show() {
    this.showRecording();
    this.showCalibration();
    this.showExamination();
    const busy = this.root.querySelector(".busy");
    busy.hidden = !this.job;
    busy.classList.toggle("records", this.is("recording"));
    const words = { recording: "● recording", calibration: "calibrating", examination: "examining" };
    if (this.job) busy.textContent = words[this.job.kind];
  }

  showRecording() {
    const { job, jobs } = this;
    const runs = this.is("recording");
    const button = this.form.querySelector("button");
    button.setAttribute("aria-pressed", String(runs));
    this.name(button, runs ? "End recording" : "Start recording");
    for (const name of LABELS) this.form.elements[name].disabled = runs;
    const last = jobs.recorded;
    const ended = last ? (last.is_error ? "Failed: " : "Recorded: ") + last.text : "";
    this.set("record", "step", runs ? "Recording to " + job.file : ended);
    this.tool("record").querySelector(".step").classList.toggle("bad", !runs && Boolean(last && last.is_error));
    const labels = runs ? Object.entries(job.labels).map((label) => label.join(" ")).join(", ") : "";
    this.set("record", "count", runs
      ? `${plural(job.frames, "frame")}, ${plural(job.events, "event")}, ${job.lost} lost, ` +
        `${job.waiting} waiting for the disk; ` + (labels ? "labels: " + labels : "no labels")
      : "");
  }

  showCalibration() {
    const { job, jobs } = this;
    const runs = this.is("calibration");
    const proposal = runs && job.proposal;
    const last = jobs.calibrated;
    let step = "Finds the 25 whiskers in the picture. It takes 25 frames without a touch, then a press on all whiskers.";
    if (proposal) step = `Look at the picture: is every whisker in its square?\n${proposal.text}`;
    else if (runs && job.is_ready) step = "Press on all whiskers, or slide something over them. Then find the whiskers.";
    else if (runs) step = "Do not touch the sensor.";
    else if (last) step = last.is_error ? "Not calibrated: " + last.text : last.text;
    this.set("calibrate", "step", step);
    this.tool("calibrate").querySelector(".step").classList.toggle("bad", !runs && Boolean(last && last.is_error));
    this.set("calibrate", "count", runs && !proposal
      ? job.is_ready ? plural(job.spots.length, "spot") + " of light so far" : `${job.frames[0]} of ${job.frames[1]} frames`
      : "");
    progressOf(this.tool("calibrate"), runs && !proposal && job.frames);
    const [start, use, cancel] = ["start", "use", "cancel"].map((name) => this.root.querySelector("." + name));
    this.name(start, runs ? "Find the whiskers" : "Calibrate");
    start.disabled = runs && !job.is_ready;
    start.hidden = Boolean(proposal);
    use.hidden = !proposal;
    cancel.hidden = !runs;
    const link = this.root.querySelector(".download");
    const toml = !runs && last && last.toml;
    if (link.hidden === Boolean(toml)) {
      if (this.url) URL.revokeObjectURL(this.url);
      this.url = toml ? URL.createObjectURL(new Blob([toml], { type: "application/toml" })) : null;
      if (toml) link.href = this.url;
      else link.removeAttribute("href");
      link.download = (this.about.name || "wstac") + ".toml";
      link.textContent = "Download " + link.download;
      link.hidden = !toml;
    }
  }

  showExamination() {
    const { job, jobs } = this;
    const runs = this.is("examination");
    const last = jobs.examined;
    let step = "Measures the sensor for 10 s while nothing touches it, and says what to change.";
    if (runs) step = "Measuring: do not touch the sensor.";
    else if (last && last.error) step = "No advice: " + last.error;
    else if (last) {
      // That a camera may have a rolling shutter is no change.
      const changes = last.verdict.filter(({ kind }) => kind !== "readout").length;
      step = changes ? `${plural(changes, "thing")} to change:` : "Nothing to change.";
    }
    this.set("doctor", "step", step);
    this.tool("doctor").querySelector(".step").classList.toggle("bad", !runs && Boolean(last && last.error));
    progressOf(this.tool("doctor"), runs && job.seconds);
    this.name(this.root.querySelector(".examine"), runs ? "Stop" : "Examine");
    const verdict = runs || !last ? [] : last.verdict;
    const list = this.tool("doctor").querySelector(".verdict");
    const text = JSON.stringify(verdict);
    if (list.dataset.shown !== text) {
      list.dataset.shown = text;
      list.replaceChildren(...verdict.map(({ kind, found, advice }) => {
        const item = document.createElement("li");
        item.dataset.kind = kind;
        const strong = Object.assign(document.createElement("strong"), { textContent: advice });
        item.append(strong, document.createElement("br"), found);
        return item;
      }));
    }
    const numbers = this.tool("doctor").querySelector(".numbers");
    numbers.hidden = runs || !last || !last.text;
    this.set("doctor", "report", last ? last.text : "");
  }

  // --- the picture

  // Returns whether a calibration was refused, and a person looks at why.
  looks() {
    const last = this.jobs.calibrated;
    return !this.job && Boolean(last && last.is_error) && this.tool("calibrate").open;
  }

  // Returns the light that a calibration has seen, if it is to be looked at.
  glowToShow() {
    return (this.is("calibration") && this.job.is_ready && this.job.spots.length) || this.looks() ? this.glow : null;
  }

  // Draws what a calibration has seen. Returns whether it shows taxels of its own.
  draw(context, scale) {
    const runs = this.is("calibration");
    const last = this.jobs.calibrated;
    const proposal = runs && this.job.proposal;
    const middle = (at) => (at + 0.5) * scale;
    if (!proposal) {
      const spots = runs ? this.job.spots : this.looks() ? last.spots : [];
      for (const [x, y, radius, isWhisker] of spots) {
        ring(context, middle(x), middle(y), radius * 1.3 * scale, isWhisker || runs ? "#fff" : "#ffa257");
      }
      return false;
    }
    const { taxel, corners, centers, dead } = proposal;
    const size = Math.max(11, (taxel[1] * scale) / 5);
    corners.forEach(([x, y], index) => {
      const color = index === dead ? "#ffa257" : "#fff";
      const [left, top, width, height] = [x, y, ...taxel].map((at) => at * scale);
      context.setLineDash(index === dead ? [6, 6] : []);
      Object.assign(context, { strokeStyle: color, fillStyle: color, lineWidth: Math.max(1.5, scale * 2) });
      context.strokeRect(left, top, width, height);
      context.setLineDash([]);
      const font = `${size}px system-ui, "DejaVu Sans", sans-serif`;
      Object.assign(context, { font, textBaseline: "top", textAlign: "left" });
      context.fillText(`${Math.floor(index / ROW) + 1},${(index % ROW) + 1}`, left + 4, top + 4);
      const [cx, cy, arm] = [middle(centers[index][0]), middle(centers[index][1]), width / 10];
      context.strokeStyle = "#ff5a78";
      stroke(context, [[cx - arm, cy], [cx + arm, cy]]);
      stroke(context, [[cx, cy - arm], [cx, cy + arm]]);
    });
    return true;
  }
}

function ring(context, x, y, radius, color) {
  Object.assign(context, { strokeStyle: color, lineWidth: 2 });
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.stroke();
}

// Shows how far a step is, or nothing.
function progressOf(tool, part) {
  const progress = tool.querySelector("progress");
  progress.hidden = !part;
  if (part) [progress.value, progress.max] = part;
}
