// Plots of the selected box over time, by uPlot: quaternion components and angular speed.

import uPlot from "uplot";

const NAMES = ["w", "x", "y", "z"];
const PLACES = [3, 0, 1, 2]; // the indices of w x y z in x y z w

/** The components w x y z of a box, one array over all samples each. Signs are chosen so that the curves do not jump. */
function components(result, boxes, box, samples) {
  const columns = NAMES.map(() => new Float64Array(samples));
  const before = [0, 0, 0, 0];
  for (let sample = 0; sample < samples; sample++) {
    const at = (sample * boxes + box) * 4;
    const values = PLACES.map((place) => result.rotations[at + place] / result.unit);
    const product = values.reduce((sum, value, i) => sum + value * before[i], 0);
    const sign = product < 0 ? -1 : 1;
    for (let i = 0; i < 4; i++) {
      before[i] = values[i] * sign;
      columns[i][sample] = before[i];
    }
  }
  return columns;
}

/** The keys of a box, one array per component: the key's value at the sample nearest to it, null at other samples. */
function keyDots(set, box, columns) {
  const dots = NAMES.map(() => new Array(set.samples).fill(null));
  const { times, first } = set.keysOf(box);
  times.forEach((time, key) => {
    if (time < set.times[0] || time > set.times[set.samples - 1]) return;
    const sample = set.nearest(time);
    const values = PLACES.map((place) => set.keys[(first + key) * 4 + place] / 32767);
    const product = values.reduce((sum, value, i) => sum + value * columns[i][sample], 0);
    values.forEach((value, i) => (dots[i][sample] = product < 0 ? -value : value));
  });
  return dots;
}

export class Plots {
  constructor(elements, seek) {
    this.elements = elements;
    this.seek = seek;
    this.charts = [];
    new ResizeObserver(() => this.fit()).observe(elements.components);
  }

  width() {
    return Math.max(this.elements.components.clientWidth - 12, 200);
  }

  fit() {
    for (const chart of this.charts) chart.setSize({ width: this.width(), height: chart.height });
    if (this.time !== undefined) this.now(this.time);
  }

  /** Replaces the plots, after the box, the method or the theme has changed. */
  show(set, results, box, theme) {
    for (const chart of this.charts) chart.destroy();
    const { samples, boxes } = set;
    const [shown, other] = results.map((result) => components(result, boxes, box, samples));
    const dots = keyDots(set, box, shown);
    const dashed = { dash: [5, 4], width: 1.5 };
    const line = (label, stroke, extra) => ({ label, stroke, width: 2, points: { show: false }, ...extra });
    const colours = [theme.ink, "#d55e00", "#009e73", theme.accent];
    const series = NAMES.map((name, i) => line(name, colours[i]));
    const data = [set.times, ...shown];
    if (other) {
      NAMES.forEach((name, i) => series.push(line(`${name}, ${results[1].method}`, colours[i], dashed)));
      data.push(...other);
    }
    // If keys are closer than 8 pixels, the outlines of their dots would cover the curve.
    const dense = set.keysOf(box).times.length > this.width() / 8;
    NAMES.forEach((name, i) => {
      const outlined = { size: 7, stroke: theme.panel, width: 1 };
      const points = { show: true, fill: colours[i], ...(dense ? { size: 3, width: 0 } : outlined) };
      series.push({ label: `key ${name}`, class: "key", stroke: colours[i], paths: () => null, points });
      data.push(dots[i]);
    });
    const speeds = results.map((result) => {
      const column = new Float64Array(samples);
      for (let sample = 0; sample < samples; sample++) {
        column[sample] = result.speeds[sample * boxes + box] * result.speedUnit;
      }
      return column;
    });
    const speedSeries = results.map((result, i) =>
      line(`angular speed, ${result.method}, rad/s`, theme.methods[result.method], i ? dashed : {}),
    );
    this.charts = [
      this.chart(this.elements.components, 240, series, data, theme),
      this.chart(this.elements.speeds, 150, speedSeries, [set.times, ...speeds], theme),
    ];
  }

  chart(element, height, series, data, theme) {
    const axis = { stroke: theme.pale, grid: { stroke: theme.line, width: 1 }, ticks: { stroke: theme.line } };
    const seconds = (_, values) => values.map((value) => `${value} s`);
    const options = {
      width: this.width(),
      height,
      scales: { x: { time: false } },
      legend: { live: false },
      cursor: { drag: { x: false, y: false }, points: { show: false }, y: false },
      axes: [{ ...axis, values: seconds }, { ...axis, size: 46 }],
      series: [{ label: "time, s" }, ...series],
    };
    const chart = new uPlot(options, data, element);
    chart.now = document.createElement("div");
    chart.now.className = "now";
    chart.over.append(chart.now);
    const go = (event) => this.seek(chart.posToVal(event.clientX - chart.over.getBoundingClientRect().left, "x"));
    chart.over.addEventListener("pointerdown", (event) => {
      go(event);
      chart.over.setPointerCapture(event.pointerId);
      chart.over.onpointermove = go;
      chart.over.onpointerup = () => (chart.over.onpointermove = null);
    });
    return chart;
  }

  /** Moves the time cursors. */
  now(time) {
    this.time = time;
    for (const chart of this.charts) {
      chart.now.style.transform = `translateX(${chart.valToPos(time, "x")}px)`;
    }
  }
}
