// The four plots. They show what `rows` holds: one row a frame, oldest first.

import uPlot from "uplot";

const HEIGHT = 190;
const COLOURS = 8;
const LEAST_TERM_NM = 0.005;

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const norm = (v) => Math.hypot(...v);

const series = (labels) =>
  labels.map((label, i) => ({
    label,
    stroke: () => css(`--c${i % COLOURS}`),
    width: 1.6,
    dash: i < COLOURS ? undefined : [6, 4],
    points: { show: false },
  }));

export class Plots {
  constructor(info) {
    this.info = info;
    this.joint = 0;
    this.cursor = null;
    this.columns = {
      error: [(f) => (f.tip_error_m === null ? null : 1e3 * f.tip_error_m)],
      force: [(f) => norm(f.force_n), ...[0, 1, 2].map((axis) => (f) => f.force_n[axis])],
      torque: [
        (f) => f.torque_nm[this.joint],
        ...info.terms.map((_, term) => (f) => f.terms_nm[term][this.joint]),
      ],
      timing: [
        (f) => (f.timing_us ? f.timing_us[0] : null),
        (f) => (f.timing_us ? f.timing_us[2] : null),
        (f) => f.round_trip_us || null,
      ],
    };
    this.labels = {
      error: ["maximum"],
      force: ["size", "x", "y", "z"],
      torque: ["total", ...info.terms],
      timing: ["period", "step", "round trip"],
    };
    this.make();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.make());
    new ResizeObserver(() => this.resize()).observe(document.getElementById("plots"));
  }

  make() {
    const axis = { stroke: () => css("--soft"), grid: { stroke: () => css("--line"), width: 1 }, ticks: { stroke: () => css("--line"), width: 1 } };
    for (const plot of Object.values(this.plots ?? {})) plot.destroy();
    this.plots = {};
    for (const name of Object.keys(this.columns)) {
      const element = document.getElementById(`plot-${name}`);
      const options = {
        width: element.clientWidth || 320,
        height: HEIGHT,
        scales: { x: { time: false } },
        axes: [{ ...axis, values: (_, ticks) => ticks.map((t) => `${t} s`) }, { ...axis, size: 64 }],
        series: [{}, ...series(this.labels[name])],
        legend: { live: false },
        cursor: { drag: { x: true, y: false } },
        hooks: { draw: [(plot) => this.drawCursor(plot)] },
      };
      this.plots[name] = new uPlot(options, [[], ...this.columns[name].map(() => [])], element);
    }
    if (this.rows) this.show(this.rows);
  }

  resize() {
    for (const [name, plot] of Object.entries(this.plots)) {
      const width = document.getElementById(`plot-${name}`).clientWidth;
      if (width && width !== plot.width) plot.setSize({ width, height: HEIGHT });
    }
  }

  drawCursor(plot) {
    if (this.cursor === null) return;
    const x = plot.valToPos(this.cursor, "x", true);
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.strokeStyle = css("--accent");
    ctx.lineWidth = 2;
    ctx.setLineDash([]);
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    ctx.restore();
  }

  setJoint(joint) {
    this.joint = joint;
    if (this.rows) this.show(this.rows);
  }

  setCursor(time) {
    this.cursor = time;
    for (const plot of Object.values(this.plots)) plot.redraw(false, false);
  }

  show(rows) {
    this.rows = rows;
    const time = rows.map((f) => f.time_s);
    for (const [name, plot] of Object.entries(this.plots)) {
      const data = this.columns[name].map((value) => rows.map(value));
      if (name === "torque") this.hideZeroTerms(plot, data);
      plot.setData([time, ...data]);
    }
  }

  /** Terms that stay at zero have neither a line nor a place in the legend. */
  hideZeroTerms(plot, data) {
    data.forEach((values, i) => {
      const used = i === 0 || values.some((v) => Math.abs(v) > LEAST_TERM_NM);
      const entry = plot.root.querySelectorAll(".u-legend .u-series")[i];
      if (entry) entry.style.display = used ? "" : "none";
      if (!used) values.fill(null);
    });
  }
}
