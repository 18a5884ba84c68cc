"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const plan = data.plan, year = data.yearly, trade = data.trade_off, moves = data.movements;

/* Whole units and differences, as `robojoule.page.thinning.in_steps` writes them. */
function summed(steps, unit) {
  let sum = 0;
  return steps.map((step) => (sum += step) * unit);
}
const SECOND = 1e-5, JOULE = 1e-3, WATT = 1, PERCENT = 0.01, SPAN = 2000;
trade.times = summed(trade.cycle_times, SECOND);
trade.joules = summed(trade.energies, JOULE);
trade.ends = summed(trade.lengths, SECOND);
trade.least = trade.least_durations.map((one) => one * SECOND);
trade.takers = trade.ends.slice(1).map((_, k) => parseInt(trade.movements.substr(k * trade.width, trade.width), 36));
for (const cycle of [data.given, data.planned]) {
  const ends = summed(cycle.ends, SECOND), kinds = { m: "move", w: "wait", p: "process" };
  cycle.steps = ends.map((end, k) => ({ kind: kinds[cycle.kinds[k]], name: cycle.names[cycle.of[k]],
    start: k ? ends[k - 1] : 0, end, power: cycle.means[k] }));
  cycle.time = summed(cycle.times, SECOND);
  cycle.power = summed(cycle.powers, WATT);
}
for (const move of moves) {
  [move.limit, move.duration, move.waitBefore, move.waitAfter, move.energy] = move.plan;
  const durations = summed(move.limits[0], SECOND);
  move.speeds = [durations.map((one) => 1 / Math.max(one, 1e-9)), summed(move.limits[1], PERCENT)];
}
/* Speed limits are nearly linear in the inverse of the duration. */
const limitFor = (move, duration) => interpolated(1 / Math.max(duration, 1e-9), ...move.speeds);
const COLORS = { move: "#0072b2", process: "#009e73", wait: "#c9ced6", before: "#6b7280", accent: "#d55e00" };
const byId = (id) => document.getElementById(id);
const rounded = (value, digits) => Number(value.toFixed(digits)) || 0; // no minus before nothing
const fixed = (value, digits) => rounded(value, digits).toFixed(digits).replace("-", "\u2212");
const grouped = (value, digits) => rounded(value, digits).toLocaleString("en-GB", { minimumFractionDigits: digits,
  maximumFractionDigits: digits }).replace("-", "\u2212");
const whole = (value) => grouped(value, 0);
const fixed2 = (value) => Number(value.toFixed(2));
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
  const times = trade.times, joules = trade.joules, ends = trade.ends, durations = trade.least.slice();
  for (let k = 0; k < trade.takers.length && ends[k] < cycleTime; k++) {
    durations[trade.takers[k]] += Math.min(cycleTime, ends[k + 1]) - ends[k];
  }
  let step = 0;
  while (step < times.length - 2 && times[step + 1] <= cycleTime) step++;
  return {
    energy: interpolated(cycleTime, times, joules),
    fastest: joules[0] + (cycleTime - times[0]) * trade.waiting_power_w,
    marginal: (joules[step + 1] - joules[step]) / (times[step + 1] - times[step]),
    durations,
  };
}

function heading() {
  const less = (saved, digits) => (rounded(saved, digits) >= 0 ? "less" : "more");
  const compared = `${fixed(Math.abs(plan.saving_percent), 1)} % ${less(plan.saving_percent, 1)} energy`;
  document.title = `${plan.program}: ${compared}`;
  const carried = data.payloads_kg.map((mass) => String(fixed2(mass))), last = carried.pop();
  const masses = carried.length ? `${carried.join(", ")} and ${last}` : last;
  const byProgram = carried.length || data.payloads_kg[0] !== plan.payload_kg ? " as the program sets it" : "";
  byId("what").textContent = `${plan.program} on ${plan.robot}, payload ${masses} kg${byProgram}, cycle time ` +
    `${fixed(plan.cycle_time_s, 3)} s`;
  byId("headline").textContent = `${compared}: ` +
    `${whole(plan.energy_j)}\u00a0J per cycle, not ${whole(plan.energy_given_j)}\u00a0J`;
  const saved = year.saved_kwh >= 0 ? "saved a year" : "more a year";
  const full = plan.saving_over_unoptimized_percent;
  const tiles = [
    [`${figures(Math.abs(year.saved_kwh))} kWh`, `${saved}, in ${whole(year.hours_per_year)} h of production`],
    [`${figures(Math.abs(year.saved_cost))} ${year.currency}`,
      `${saved}, at ${fixed(year.price_per_kwh, 2)} ${year.currency}/kWh`],
    [`${figures(Math.abs(year.saved_co2_kg))} kg CO\u2082`, `${saved}, at ${whole(year.co2_g_per_kwh)} g/kWh`],
    [`${fixed(Math.abs(full), 1)} %`, `${less(full, 1)} than full speed, then waiting`],
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
  const width = 1000, height = 26, longest = Math.max(...[data.given, data.planned].map((one) => one.steps.at(-1).end));
  for (const [label, cycle] of [["before", data.given], ["after", data.planned]]) {
    const picture = drawn("svg", { viewBox: `0 0 ${width} ${height}`, preserveAspectRatio: "none" });
    for (const step of cycle.steps) {
      const wide = ((step.end - step.start) / longest) * width, gap = Math.min(1, wide / 5);
      const bar = drawn("rect", { x: (step.start / longest) * width, y: step.kind === "wait" ? 7 : 0, fill: COLORS[step.kind],
        height: step.kind === "wait" ? height - 14 : height, width: Math.max(wide - gap, 0.3) });
      bar.append(drawn("title", {}, `${step.kind} ${step.name}: ${fixed(step.end - step.start, 3)} s, ` +
        `${whole(step.power)} W in the mean`));
      picture.append(bar);
    }
    const row = element("div", undefined, { class: "cycle" });
    row.append(element("span", label), picture);
    byId("gantt").append(row);
  }
}

/* Two traces on one common time axis, for uPlot. */
function joined(first, second) {
  const times = [...new Set([...first.time, ...second.time])].sort((a, b) => a - b);
  const on = (trace) => times.map((t) => (t > trace.time.at(-1) ? null : interpolated(t, trace.time, trace.power)));
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
  const times = trade.times, energies = trade.joules, from = times[0], end = times.at(-1);
  const slider = byId("cycle-time");
  slider.min = from; slider.max = end; slider.step = (end - from) / 1000; slider.value = Math.min(Math.max(now, from), end);
  const mark = (u, time, energy, color, square) => {
    const x = u.valToPos(time, "x", true), y = u.valToPos(energy, "y", true), r = 5 * devicePixelRatio;
    u.ctx.beginPath();
    if (square) { u.ctx.moveTo(x, y - r); u.ctx.lineTo(x + r, y); u.ctx.lineTo(x, y + r); u.ctx.lineTo(x - r, y); }
    else u.ctx.arc(x, y, r, 0, 2 * Math.PI);
    u.ctx.closePath(); u.ctx.fillStyle = color; u.ctx.fill();
  };
  const columns = [times, energies, times.map((t) => energies[0] + (t - from) * trade.waiting_power_w)];
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
  for (const move of moves) {
    const row = element("tr"), wait = (seconds) => (seconds > 0 ? `${fixed(seconds, 3)} s` : "\u2013");
    row.append(element("td", move.name), element("td", `${Number(move.given_percent.toFixed(1))} %`),
      element("td", `${Number(move.limit.toFixed(2))} %`), element("td", `${fixed(move.duration, 3)} s`),
      element("td", wait(move.waitBefore)), element("td", wait(move.waitAfter)),
      element("td", `${whole(move.energy)} J`), element("td", "", { class: "limit" }),
      element("td", "", { class: "duration" }));
    body.append(row);
  }
}

const dots = [];
function profiles() {
  const width = 220, height = 104, left = 6, top = 6, right = 6, bottom = 6;
  for (const move of moves) {
    const shown = move.profile;
    if (!shown) continue;
    const xs = summed(shown.x, (width - left - right) / SPAN).map((one) => left + one);
    const ys = summed(shown.y, (height - top - bottom) / SPAN).map((one) => height - bottom - one);
    const picture = drawn("svg", { viewBox: `0 0 ${width} ${height}`, role: "img",
      "aria-label": `Energy over duration of ${move.name}` });
    const at = (time) => {
      const x = left + ((time - shown.from_s) / Math.max(shown.to_s - shown.from_s, 1e-9)) * (width - left - right);
      return { cx: Math.min(Math.max(x, left), width - right), cy: interpolated(x, xs, ys) };
    };
    picture.append(drawn("rect", { x: left, y: top, width: width - left - right, height: height - top - bottom,
      fill: "none", stroke: "#dfe3e8" }));
    picture.append(drawn("polyline", { points: xs.map((x, k) => `${fixed2(x)},${fixed2(ys[k])}`).join(" "), fill: "none",
      stroke: COLORS.move, "stroke-width": 1.5 }));
    picture.append(drawn("circle", { ...at(move.given_s), r: 4.5, fill: "none", stroke: COLORS.before, "stroke-width": 2 }));
    picture.append(drawn("circle", { ...at(move.duration), r: 4, fill: COLORS.move }));
    const dot = drawn("path", { fill: COLORS.accent }), k = moves.indexOf(move);
    picture.append(dot);
    dots.push((durations) => {
      const p = at(durations[k]);
      dot.setAttribute("d", `M${p.cx} ${p.cy - 5}l5 5l-5 5l-5 -5z`);
    });
    const figure = element("figure"), caption = element("figcaption");
    caption.append(element("b", move.name), element("br"), `${whole(shown.least_j)} to ${whole(shown.most_j)} J`,
      element("br"), `${fixed(shown.from_s, 2)} to ${fixed(shown.to_s, 2)} s`);
    figure.append(caption, picture);
    byId("profiles").append(figure);
  }
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
  for (const text of data.shortened) add(`This program is long: ${text}.`);
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
  byId("at-energy").textContent = `${grouped(best.energy, 1)} J`;
  byId("at-saving").textContent = `${fixed(saving, 1)} %`;
  byId("at-marginal").textContent = `${whole(best.marginal)} J`;
  byId("cycle-time").setAttribute("aria-valuetext", `${fixed(now, 3)} s, ${whole(best.energy)} J`);
  document.querySelectorAll("#moves tbody tr").forEach((row, k) => {
    row.querySelector(".limit").textContent = `${fixed(limitFor(moves[k], best.durations[k]), 1)} %`;
    row.querySelector(".duration").textContent = `${fixed(best.durations[k], 3)} s`;
  });
  for (const move of dots) move(best.durations);
  curve.redraw(false);
}

heading(); gantt(); power(); movesTable(); profiles(); tradeOff(); parts(); assumptions(); update();
const fit = () => charts.forEach(([made, size]) => made.setSize(size()));
addEventListener("resize", fit);
addEventListener("beforeprint", () => { // a sheet is narrower than most windows
  charts.forEach(([made, size]) => made.setSize({ ...size(), width: Math.min(size().width, 640) }));
});
addEventListener("afterprint", fit);
