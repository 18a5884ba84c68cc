"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const plan = data.plan, year = data.yearly, trade = data.trade_off, moves = data.movements;
const COLORS = { move: "#0072b2", process: "#009e73", wait: "#c9ced6", before: "#6b7280", accent: "#d55e00" };
const byId = (id) => document.getElementById(id);
const fixed = (value, digits) => value.toFixed(digits).replace("-", "\u2212");
const whole = (value) => Math.round(value).toLocaleString("en-GB").replace("-", "\u2212");
const figures = (value) => (Math.abs(value) >= 100 ? whole(value) : fixed(value, Math.abs(value) >= 10 ? 1 : 2));

function element(name, text, attributes = {}) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

function drawn(name, attributes, text) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

/* Value at x of points that are joined by lines; x beyond the ends takes the end's value. */
function interpolated(x, xs, ys) {
  let low = 0, high = xs.length - 1;
  if (x <= xs[0]) return ys[0];
  if (x >= xs[high]) return ys[high];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (xs[middle] <= x) low = middle; else high = middle;
  }
  return ys[low] + ((ys[high] - ys[low]) * (x - xs[low])) / (xs[high] - xs[low]);
}

/* The best plan for a cycle time: energy, worth of a second, and how long each movement takes. */
function bestPlan(cycleTime) {
  const times = trade.cycle_times_s, last = times.length - 1, durations = trade.least_durations_s.slice();
  for (let k = 0; k < last && times[k] < cycleTime; k++) {
    durations[trade.movements[k]] += Math.min(cycleTime, times[k + 1]) - times[k];
  }
  const waited = Math.max(cycleTime - times[last], 0) * trade.marginal_powers_w[last];
  let step = 0;
  while (step < last && times[step + 1] <= cycleTime) step++;
  return {
    energy: interpolated(cycleTime, times, trade.energies_j) + waited,
    fastest: trade.energies_j[0] + (cycleTime - times[0]) * trade.marginal_powers_w[last],
    marginal: trade.marginal_powers_w[step],
    durations,
  };
}

function heading() {
  document.title = `${plan.program}: ${fixed(plan.saving_percent, 1)} % less energy`;
  byId("what").textContent = `${plan.program} on ${plan.robot}, payload ${plan.payload_kg} kg, cycle time ` +
    `${fixed(plan.cycle_time_s, 3)} s`;
  const less = plan.saving_percent >= 0 ? "less" : "more";
  byId("headline").textContent = `${fixed(Math.abs(plan.saving_percent), 1)} % ${less} energy: ` +
    `${whole(plan.energy_j)} J per cycle, not ${whole(plan.energy_given_j)} J`;
  const tiles = [
    [`${figures(year.saved_kwh)} kWh`, `saved a year, in ${whole(year.hours_per_year)} h of production`],
    [`${figures(year.saved_cost)} ${year.currency}`, `saved a year, at ${fixed(year.price_per_kwh, 2)} ${year.currency}/kWh`],
    [`${figures(year.saved_co2_kg)} kg CO\u2082`, `saved a year, at ${whole(year.co2_g_per_kwh)} g/kWh`],
    [`${fixed(plan.saving_over_unoptimized_percent, 1)} %`, "less than full speed, then waiting"],
    [`${whole(plan.peak_power_w)} W`, "largest mains power"],
    [`${fixed(100 * plan.peak_torque_ratio, 0)} %`, "largest torque, of its peak limit"],
  ];
  for (const [value, text] of tiles) {
    const tile = element("div", undefined, { class: "tile" });
    tile.append(element("b", value), element("span", text));
    byId("tiles").append(tile);
  }
  for (const warning of plan.warnings) byId("warnings").append(element("p", `Note: ${warning}.`, { class: "warning" }));
}

function gantt() {
  const width = 900, row = 34, left = 56, scale = (width - left - 8) / plan.cycle_time_s;
  const ends = [data.given, data.planned].map((one) => one.steps[one.steps.length - 1].end_s);
  const fit = Math.min(1, plan.cycle_time_s / Math.max(...ends));
  const picture = drawn("svg", { viewBox: `0 0 ${width} ${2 * row + 6}` });
  [["before", data.given], ["after", data.planned]].forEach(([label, cycle], k) => {
    picture.append(drawn("text", { x: 0, y: k * row + 20 }, label));
    for (const step of cycle.steps) {
      const bar = drawn("rect", { x: left + step.start_s * scale * fit, y: k * row + 4, height: row - 10,
        width: Math.max((step.end_s - step.start_s) * scale * fit, 0.5), fill: COLORS[step.kind], stroke: "#fff",
        "stroke-width": 0.7 });
      bar.append(drawn("title", {}, `${step.kind} ${step.name}: ${fixed(step.end_s - step.start_s, 3)} s, ` +
        `${whole(step.power_w)} W in the mean`));
      picture.append(bar);
    }
  });
  byId("gantt").append(picture);
}

/* Two traces on one common time axis, for uPlot. */
function joined(first, second) {
  const times = [...new Set([...first.time_s, ...second.time_s])].sort((a, b) => a - b);
  const on = (trace) => times.map((t) => (t > trace.time_s[trace.time_s.length - 1] ? null :
    interpolated(t, trace.time_s, trace.power_w)));
  return [times, on(first), on(second)];
}

const charts = [];
function chart(id, height, options, columns) {
  const place = byId(id), size = () => ({ width: Math.max(place.clientWidth, 280), height });
  const made = new uPlot({ ...options, ...size() }, columns, place);
  charts.push([made, size]);
  return made;
}

const axis = (label) => ({ label, grid: { stroke: "#e3e6ea" }, ticks: { stroke: "#e3e6ea" } });
const number = (digits, unit) => (_, value) => (value == null ? "" : `${fixed(value, digits)} ${unit}`);

function power() {
  chart("power", 240, {
    scales: { x: { time: false } },
    axes: [axis("time in the cycle [s]"), { ...axis("mains power [W]"), size: 64 }],
    series: [{ label: "time", value: number(3, "s") },
      { label: "before", stroke: COLORS.before, width: 1.5, dash: [5, 3], value: number(0, "W") },
      { label: "after", stroke: COLORS.move, width: 2, value: number(0, "W") }],
  }, joined(data.given, data.planned));
}

let now = plan.cycle_time_s, curve;
function tradeOff() {
  const times = trade.cycle_times_s.slice(), energies = trade.energies_j.slice(), last = times.length - 1;
  const end = Math.max(times[trade.best] + 0.15 * (times[trade.best] - times[0]), 1.05 * plan.cycle_time_s, times[0] * 1.05);
  const from = times[0];
  if (end > times[last]) { times.push(end); energies.push(bestPlan(end).energy); }
  const slider = byId("cycle-time");
  slider.min = from; slider.max = end; slider.value = Math.min(Math.max(now, from), end);
  const mark = (u, time, energy, color, square) => {
    const x = u.valToPos(time, "x", true), y = u.valToPos(energy, "y", true), r = 5 * devicePixelRatio;
    u.ctx.beginPath();
    if (square) { u.ctx.moveTo(x, y - r); u.ctx.lineTo(x + r, y); u.ctx.lineTo(x, y + r); u.ctx.lineTo(x - r, y); }
    else u.ctx.arc(x, y, r, 0, 2 * Math.PI);
    u.ctx.closePath(); u.ctx.fillStyle = color; u.ctx.fill();
  };
  const shown = times.filter((t) => t <= end).length;
  const columns = [times.slice(0, shown + 1), energies.slice(0, shown + 1)];
  columns.push(columns[0].map((t) => bestPlan(t).fastest));
  curve = chart("curve", 280, {
    scales: { x: { time: false, range: [from, end] } },
    axes: [axis("cycle time [s]"), { ...axis("energy per cycle [J]"), size: 72 }],
    series: [{ label: "cycle time", value: number(3, "s") },
      { label: "least energy", stroke: COLORS.move, width: 2, value: number(0, "J") },
      { label: "own speeds, then waiting", stroke: COLORS.before, width: 1.5, dash: [5, 3], value: number(0, "J") }],
    hooks: { draw: [(u) => {
      mark(u, plan.cycle_time_s, plan.energy_j, COLORS.move, false);
      mark(u, now, bestPlan(now).energy, COLORS.accent, true);
    }] },
  }, columns);
  slider.addEventListener("input", () => { now = Number(slider.value); update(); });
}

function movesTable() {
  const body = document.querySelector("#moves tbody");
  plan.moves.forEach((move, k) => {
    const row = element("tr");
    row.append(element("td", move.name), element("td", `${fixed(moves[k].given_percent, 0)} %`),
      element("td", `${Number(move.speed_limit_percent.toFixed(2))} %`), element("td", `${fixed(move.duration_s, 3)} s`),
      element("td", `${fixed(move.wait_before_s, 3)} s`), element("td", `${fixed(move.wait_after_s, 3)} s`),
      element("td", `${whole(move.energy_j)} J`), element("td", "", { class: "limit" }),
      element("td", "", { class: "duration" }));
    body.append(row);
  });
}

const dots = [];
function profiles() {
  const width = 220, height = 130, left = 8, top = 8, right = 8, bottom = 20;
  moves.forEach((move, k) => {
    const xs = move.profile_durations_s, ys = move.profile_energies_j, taken = plan.moves[k].duration_s;
    const given = interpolated(move.given_percent, move.limit_percent.slice().reverse(),
      move.limit_durations_s.slice().reverse());
    /* A profile at very low speed goes on for long: what is shown ends soon after its least and all marked points. */
    const best = xs[ys.indexOf(Math.min(...ys))];
    const x1 = Math.min(xs[xs.length - 1], Math.max(2.5 * best, 1.2 * taken, 1.2 * given));
    const inside = ys.filter((_, i) => xs[i] <= x1), y0 = Math.min(...inside), y1 = Math.max(...inside, y0 + 1e-9);
    const x = (v) => left + ((v - xs[0]) / Math.max(x1 - xs[0], 1e-9)) * (width - left - right);
    const y = (v) => top + ((y1 - v) / (y1 - y0)) * (height - top - bottom);
    const picture = drawn("svg", { viewBox: `0 0 ${width} ${height}` });
    const points = xs.map((v, i) => [v, ys[i]]).filter(([v]) => v <= x1).map(([a, b]) => `${x(a)},${y(b)}`);
    picture.append(drawn("rect", { x: left, y: top, width: width - left - right, height: height - top - bottom,
      fill: "none", stroke: "#dfe3e8" }));
    picture.append(drawn("polyline", { points: points.join(" "), fill: "none", stroke: COLORS.move, "stroke-width": 1.5 }));
    const at = (time) => ({ cx: x(time), cy: y(interpolated(time, xs, ys)) });
    picture.append(drawn("circle", { ...at(given), r: 4.5, fill: "none", stroke: COLORS.before, "stroke-width": 2 }));
    picture.append(drawn("circle", { ...at(taken), r: 4, fill: COLORS.move }));
    const dot = drawn("path", { fill: COLORS.accent });
    picture.append(dot);
    dots.push((time) => { const p = at(time); dot.setAttribute("d", `M${p.cx} ${p.cy - 5}l5 5l-5 5l-5 -5z`); });
    picture.append(drawn("text", { x: left, y: height - 5 }, `${fixed(xs[0], 2)} s`));
    picture.append(drawn("text", { x: width - right, y: height - 5, "text-anchor": "end" }, `${fixed(x1, 2)} s`));
    picture.append(drawn("text", { x: width - right - 4, y: top + 12, "text-anchor": "end" },
      `${whole(y0)} to ${whole(y1)} J`));
    const figure = element("figure");
    figure.append(picture, element("figcaption", move.name));
    byId("profiles").append(figure);
  });
}

const PARTS = { base_j: "controller", drive_active_j: "drives being active", inverter_j: "inverter loss",
  copper_j: "motor copper", friction_j: "friction", braking_j: "burnt in braking", potential_j: "change of height",
  motions_j: "motions", standing_j: "standing still", process_j: "process steps" };
function parts() {
  const before = data.given.parts_j, after = data.planned.parts_j, body = document.querySelector("#parts tbody");
  const most = Math.max(...Object.values(before), ...Object.values(after));
  const bar = (value, color) => element("span", undefined,
    { class: "bar", style: `width:${(Math.max(value, 0) / most) * 8}rem;background:${color}` });
  for (const [key, label] of Object.entries(PARTS)) {
    if (!(Math.abs(before[key] || 0) >= 0.05 || Math.abs(after[key] || 0) >= 0.05)) continue;
    const row = element("tr"), cell = element("td", undefined, { style: "text-align:left" });
    cell.append(bar(before[key], COLORS.before), element("br"), bar(after[key], COLORS.move));
    row.append(element("td", label), element("td", `${whole(before[key])} J`), element("td", `${whole(after[key])} J`), cell);
    body.append(row);
  }
}

function assumptions() {
  const list = byId("assumptions"), add = (text) => list.append(element("li", text));
  add(`Energies are ${plan.profiles}; the plan was run again as it is written, with its whole speed steps.`);
  if (plan.profiles === "simulated") {
    add(`The plan takes at most ${plan.gap_to_optimum_percent.toPrecision(2)} % more than the best plan that is possible ` +
      "by this model of the robot and its controller.");
    add(`The trade-off is within ${trade.largest_gap_percent.toPrecision(2)} % of the least energy by this model.`);
  }
  if (plan.reserve_s) add(`The plan keeps ${fixed(plan.reserve_s, 3)} s in reserve.`);
  const outlook = plan.outlook;
  if (outlook && outlook.saving_low_percent !== null) {
    add(`The saving lies between ${fixed(outlook.saving_low_percent, 1)} and ${fixed(outlook.saving_high_percent, 1)} % ` +
      "(90 % interval).");
  }
  if (outlook && outlook.late_probability !== null) {
    add(`Timing was learnt from the machine (${outlook.rule}): the cycle time is known to ` +
      `${fixed(1000 * outlook.cycle_deviation_s, 1)} ms.`);
  } else add("The controller's timing is that of the robot's file: try the plan on the machine and adjust it.");
  add(`A year has ${whole(year.hours_per_year)} h of production. ${year.sources.join("; ")}.`);
  for (const note of data.notes) document.querySelector("#notes ul").append(element("li", note));
  byId("notes").hidden = data.notes.length === 0;
  for (const [name, text] of Object.entries(data.figures)) {
    byId("figures").append(element("dt", name), element("dd", text));
  }
}

function update() {
  const best = bestPlan(now), saving = best.fastest > 0 ? 100 * (1 - best.energy / best.fastest) : 0;
  byId("at-time").textContent = `${fixed(now, 3)} s`;
  byId("at-energy").textContent = `${fixed(best.energy, 1)} J`;
  byId("at-saving").textContent = `${fixed(saving, 1)} %`;
  byId("at-marginal").textContent = `${fixed(best.marginal, 0)} J`;
  document.querySelectorAll("#moves tbody tr").forEach((row, k) => {
    const limit = interpolated(best.durations[k], moves[k].limit_durations_s, moves[k].limit_percent);
    row.querySelector(".limit").textContent = `${fixed(limit, 1)} %`;
    row.querySelector(".duration").textContent = `${fixed(best.durations[k], 3)} s`;
    dots[k](best.durations[k]);
  });
  curve.redraw(false);
}

heading(); gantt(); power(); movesTable(); profiles(); tradeOff(); parts(); assumptions(); update();
const fit = () => charts.forEach(([made, size]) => made.setSize(size()));
addEventListener("resize", fit);
