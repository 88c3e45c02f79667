// The page: a running system by its WebSocket, or a log with a time slider.

import { Link } from "./link.js";
import { Plots } from "./plots.js";
import { ArmScene } from "./scene.js";
import { showState, words } from "./state.js";

const WINDOW_S = 20;
const PLOT_INTERVAL_MS = 100;
const SILENT_MS = 1000;

const element = (id) => document.getElementById(id);
const path = (rows) => ({
  tip: rows.map((f) => f.tip_m),
  reference: rows.map((f) => f.reference_m).filter((point) => point !== null),
});

function makeScene(info) {
  try {
    return new ArmScene(element("scene"), info);
  } catch (error) {
    console.warn(error);
    element("no-webgl").hidden = false;
    return null;
  }
}

function say(text, refused) {
  element("answer").textContent = text;
  element("answer").classList.toggle("refused", refused);
}

/**
 * A slider whose steps are finer near zero, where 5 N/m and 50 N/m differ most. `send` returns a promise of whether the value was
 * accepted; until it settles, only the last of further values waits.
 */
class Gain {
  constructor(name, unit, limit, send) {
    this.slider = element(name);
    this.output = element(`${name}-wanted`);
    this.unit = unit;
    this.limit = limit;
    this.send = send;
    this.held = false;
    this.next = null;
    this.quietUntil = 0;
    /** Settles when no value waits. */
    this.sent = Promise.resolve();
    this.sending = false;
    this.slider.addEventListener("input", () => {
      this.held = true;
      this.print(this.value());
    });
    this.slider.addEventListener("change", () => {
      this.held = false;
      this.next = this.value();
      if (!this.sending) this.sent = this.sendNext();
    });
    // A drag that ends where it began changes nothing.
    for (const event of ["pointerup", "pointercancel", "keyup", "blur"]) {
      this.slider.addEventListener(event, () => (this.held = false));
    }
  }

  async sendNext() {
    this.sending = true;
    try {
      while (this.next !== null) {
        const value = this.next;
        this.next = null;
        const accepted = await this.send(value);
        this.quietUntil = accepted ? performance.now() + 1500 : 0;
      }
    } finally {
      this.sending = false;
    }
  }

  /** Sends no value that still waits. */
  forget() {
    this.next = null;
  }

  value() {
    const value = this.limit * (this.slider.value / this.slider.max) ** 2;
    return Number(value.toPrecision(value < 10 ? 2 : 3));
  }

  print(value) {
    this.output.textContent = `${value} ${this.unit}`;
  }

  /** Whether the slider shows a requested value, which the controller does not report yet. */
  isAhead() {
    return this.sending || performance.now() < this.quietUntil;
  }

  /** Shows what the controller reports. */
  report(values) {
    if (this.held || this.isAhead()) return;
    this.slider.value = Math.round(this.slider.max * Math.sqrt(values[0] / this.limit));
    this.print(Number(values[0].toPrecision(3)));
  }
}

function live(info, scene, plots) {
  const rows = [];
  let lastFrame = 0;
  let lastPlot = 0;
  let state = "closed";
  const url = `ws://${location.host}${location.pathname}ws`;
  const connection = () => {
    const silent = performance.now() - lastFrame > SILENT_MS;
    const lost = state !== "open" || silent;
    const text = state !== "open" ? "no connection to the viewer" : silent ? "the controller sends nothing" : "live";
    element("connection").textContent = text;
    element("connection").classList.toggle("lost", lost);
  };
  const link = new Link(url, {
    onState: (next) => {
      state = next;
      connection();
    },
    onFrame: (frame) => {
      const last = rows.at(-1);
      if (last && frame.time_s < last.time_s) rows.length = 0;
      rows.push(frame);
      while (rows[0].time_s < frame.time_s - WINDOW_S) rows.shift();
      lastFrame = performance.now();
      showState(frame);
      if (frame.refusal) say(frame.refusal, true);
      stiffness.report(frame.stiffness_n_per_m);
      damping.report(frame.damping_n_s_per_m);
      const { tip, reference } = path(rows);
      scene?.show(frame, tip, reference);
      if (lastFrame - lastPlot > PLOT_INTERVAL_MS) {
        lastPlot = lastFrame;
        plots.show(rows);
      }
    },
  });
  const request = async (command, what) => {
    say(`${what} …`, false);
    try {
      const { mode } = await link.call(command);
      say(mode === "pendant" ? `${what}: pressed` : `${what}: mode ${words(mode)}`, false);
      return true;
    } catch (error) {
      say(error.message, true);
      return false;
    }
  };
  // A request sets both gains, and takes what the controller reports for one that it does not state.
  const ahead = (gain, entry) => (gain.isAhead() ? { [entry]: Array(3).fill(gain.value()) } : {});
  const stiffness = new Gain("stiffness", "N/m", info.max_stiffness_n_per_m, (value) => {
    const gains = { stiffness_n_per_m: Array(3).fill(value), ...ahead(damping, "damping_n_s_per_m") };
    return request({ request: "gains", ...gains }, `Stiffness ${value} N/m`);
  });
  const damping = new Gain("damping", "N s/m", info.max_damping_n_s_per_m, (value) => {
    const gains = { damping_n_s_per_m: Array(3).fill(value), ...ahead(stiffness, "stiffness_n_per_m") };
    return request({ request: "gains", ...gains }, `Damping ${value} N s/m`);
  });
  let clicks = 0;
  for (const button of document.querySelectorAll("[data-request]")) {
    const command = JSON.parse(button.dataset.request);
    button.addEventListener("click", async () => {
      clicks += 1;
      const click = clicks;
      // What ends a motion waits for nothing, and nothing that was requested before follows it. Other modes begin with the gains that
      // the sliders show.
      if (["idle", "gravity_hold", "pendant"].includes(command.request)) {
        stiffness.forget();
        damping.forget();
      } else {
        await Promise.all([stiffness.sent, damping.sent]);
        if (click !== clicks) return;
      }
      request(command, button.textContent);
    });
  }
  element("pendant").hidden = !info.pendant;
  for (const control of document.querySelectorAll("#gains input, #commands button")) control.disabled = !info.commands;
  setInterval(connection, 500);
}

async function replay(info, scene, plots) {
  const rows = await (await fetch("log.json")).json();
  for (const id of ["commands", "gains"]) element(id).hidden = id === "commands";
  for (const slider of document.querySelectorAll("#gains input, #gains label")) slider.hidden = true;
  element("player").hidden = false;
  const label = info.log.incomplete ? "log, cut off" : "log";
  element("connection").textContent = `${label}: ${info.log.experiment}, ${rows.length} frames`;
  const slider = element("time");
  slider.max = String(Math.max(0, rows.length - 1));
  const end = rows.at(-1)?.time_s ?? 0;
  const show = (index) => {
    const frame = rows[index];
    if (!frame) return;
    slider.value = String(index);
    element("clock").textContent = `${frame.time_s.toFixed(2)} of ${end.toFixed(2)} s`;
    showState(frame);
    const from = rows.findIndex((row) => row.time_s >= frame.time_s - WINDOW_S);
    const { tip, reference } = path(rows.slice(from, index + 1));
    scene?.show(frame, tip, reference);
    plots.setCursor(frame.time_s);
  };
  plots.show(rows);
  let playing = false;
  let base = null;
  const play = (on) => {
    playing = on;
    base = null;
    element("play").textContent = on ? "Pause" : "Play";
  };
  element("play").addEventListener("click", () => {
    if (!playing && Number(slider.value) >= rows.length - 1) show(0);
    play(!playing);
  });
  slider.addEventListener("input", () => {
    base = null;
    show(Number(slider.value));
  });
  const step = (now) => {
    if (playing) {
      base ??= { now, time: rows[Number(slider.value)].time_s };
      const time = base.time + (now - base.now) / 1e3;
      let index = Number(slider.value);
      while (index < rows.length - 1 && rows[index + 1].time_s <= time) index += 1;
      show(index);
      if (index >= rows.length - 1) play(false);
    }
    requestAnimationFrame(step);
  };
  show(0);
  requestAnimationFrame(step);
}

async function main() {
  const info = await (await fetch("info.json")).json();
  document.title = `supple ${info.title}`;
  element("title").textContent = `${info.title} · ${info.arm}`;
  element("version").textContent = info.version;
  info.joints.forEach((name, i) => element("joint").add(new Option(name, String(i))));
  const scene = makeScene(info);
  const plots = new Plots(info);
  element("joint").addEventListener("change", ({ target }) => plots.setJoint(Number(target.value)));
  // The first joint of most arms carries no weight: the second shows more.
  const first = Math.min(1, info.joints.length - 1);
  element("joint").value = String(first);
  plots.setJoint(first);
  if (info.log) await replay(info, scene, plots);
  else live(info, scene, plots);
}

main().catch((error) => {
  element("connection").textContent = `the page cannot start: ${error.message}`;
  element("connection").classList.add("lost");
});
