// Figures to zoom into: the panels of each plot (reports/svg/alive.py), drawn by uPlot in place of its picture.
// What cannot be drawn so, a map, a forest, stays its picture: there the view is narrowed to what was chosen.
"use strict";
(() => {
  const page = JSON.parse(document.getElementById("live").textContent);
  const arrays = page.arrays.map((text) => {
    const bytes = Uint8Array.from(atob(text), (mark) => mark.charCodeAt(0));
    return Array.from(new Float32Array(bytes.buffer), (value) => (Number.isNaN(value) ? null : value));
  });
  const PX_PER_MM = 3.78, NARROW_PX = 560, TITLED_PX = 16, CHARACTER_PX = 6.6, NEAR = 40;
  const LEFT_PX = 66, BESIDE_PX = 46, GAP_PX = 12, RIGHT_PX = 26; // room for the vertical axis: of a row's first panel, of the others
  const FONT = "12px system-ui, sans-serif", DIGITS = 4; // of a value, within the range of its axis
  const HINT = matchMedia("(pointer: fine)").matches ? "drag to zoom, double-click to go back" : "";
  const timed = []; // plots over flight time: their axes move together
  const colourOf = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const INKS = { "#1c2530": "--ink", "#6b7683": "--faint" };
  const ground = (colour) => { // a pale shade keeps its hue on dark paper
    if (colour.length > 7 || !matchMedia("(prefers-color-scheme: dark)").matches) return shown(colour);
    const parts = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16)), low = Math.min(...parts), high = Math.max(...parts);
    return `rgb(${parts.map((part) => Math.round(18 + 0.7 * (255 - high) + 48 / Math.max(high - low, 40) * (part - low))).join(" ")})`;
  };
  const shown = (colour) => {
    const name = INKS[colour.slice(0, 7)];
    return name ? colourOf(name) + colour.slice(7) : colour; // as opaque as it was
  };

  const clock = (seconds) => {
    const whole = Math.round(Math.abs(seconds)), two = (number) => String(number).padStart(2, "0");
    const [hours, minutes, rest] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
    const text = hours ? `${hours}:${two(minutes)}:${two(rest)}` : `${minutes}:${two(rest)}`;
    return (seconds < -0.5 ? "\u2212" : "") + text;
  };
  const plain = (value) => String(Number(value.toPrecision(5))).replace("-", "\u2212");
  const decimalsOf = (step) => Math.min(Math.max(0, -Math.floor(Math.log10(Math.abs(step)) + 1e-9)), 12);
  const within = (range, isLog) => {
    // Values of an axis: those of a narrow range far from zero keep the digits that tell them apart.
    const span = Math.abs(range[1] - range[0]), decimals = decimalsOf(span / 10 ** DIGITS || 1);
    const isFar = !isLog && span > 0 && Math.max(...range.map(Math.abs)) > 10 * span;
    return (value) => (isFar ? String(Number(value.toFixed(decimals))).replace("-", "\u2212") : plain(value));
  };
  const measure = document.createElement("canvas").getContext("2d");
  const widthOf = (text) => {
    measure.font = FONT;
    return Math.ceil(measure.measureText(text).width);
  };
  const told = (panel, value) => {
    if (value == null) return "";
    if (!panel.time) return within(panel.x, panel.log[0])(value);
    const tenths = Math.floor((((value % 1) + 1) % 1) * 10);
    return clock(Math.floor(value)) + (panel.x[1] - panel.x[0] < 600 ? `.${tenths}` : "");
  };
  const STEPS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 28800, 86400];

  const clocks = (splits) => {
    // Minutes and seconds beside ticks; with the fractions of a second by which they go on.
    const decimals = splits.length > 1 ? decimalsOf(splits[1] - splits[0]) : 0;
    return splits.map((value) => {
      if (!decimals) return clock(value);
      const text = Math.abs(value).toFixed(decimals), [seconds, rest] = text.split(".");
      return `${value < 0 && Number(text) ? "\u2212" : ""}${clock(Number(seconds))}.${rest}`;
    });
  };

  const nameOf = (panel, curve) => {
    const isAlone = panel.curves.filter((one) => one.kind === "line" && arrays[one.x].length).length === 1;
    return curve.name || (curve.kind === "line" && isAlone ? panel.titles[2] : "");
  };

  function straight(plot, at, first, last) {
    // Every sample joined to the next, a gap at null: uPlot's own line joins what lies in one column of pixels.
    const stroke = new Path2D(), [x, y] = [plot.data[0], plot.data[at]];
    let isOpen = false;
    for (let row = first; row <= last; row += 1) {
      if (y[row] === undefined) continue;
      if (y[row] === null) { isOpen = false; continue; }
      const place = [plot.valToPos(x[row], "x", true), plot.valToPos(y[row], "y", true)];
      if (isOpen) stroke.lineTo(...place);
      else stroke.moveTo(...place);
      isOpen = true;
    }
    return { stroke, fill: null, clip: null, band: null, gaps: null, flags: 1 };
  }

  function tables(panel) {
    // Every curve on one horizontal axis; bands become two series.
    const joined = [], series = [], bands = [];
    const add = (curve, y, options) => {
      joined.push([arrays[curve.x], arrays[y]]);
      series.push(options);
    };
    for (const curve of panel.curves) {
      const colour = shown(curve.colour);
      if (curve.kind === "lanes" || !arrays[curve.x].length) continue;
      if (curve.kind === "dots") {
        const size = Math.max(2, 1.6 * curve.width);
        add(curve, curve.y, { label: curve.name, stroke: colour, paths: () => null, points: { show: true, size, fill: colour, width: 0 } });
      } else if (curve.kind === "band") {
        const quiet = { stroke: "transparent", width: 0, points: { show: false } };
        add(curve, curve.upper, { ...quiet, label: curve.name });
        add(curve, curve.y, { ...quiet, label: curve.name });
        bands.push({ series: [series.length - 1, series.length], fill: colour });
      } else {
        const dash = curve.dashed ? [6, 4] : undefined;
        add(curve, curve.y, { label: nameOf(panel, curve), stroke: colour, width: Math.max(1, 1.3 * curve.width), dash, paths: straight, points: { show: false } });
      }
    }
    const data = joined.length ? uPlot.join(joined) : [panel.x.slice().sort((a, b) => a - b)];
    if (!joined.length) {
      data.push([null, null]);
      series.push({ label: "", points: { show: false } });
    }
    return { data, series, bands };
  }

  function paintGrounds(plot, panel) {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const [low, high, colour] of panel.grounds) {
      const [left, right] = [low, high].map((value) => plot.valToPos(value, "x", true));
      ctx.fillStyle = ground(colour);
      ctx.fillRect(Math.min(left, right), bbox.top, Math.abs(right - left), bbox.height);
    }
    ctx.restore();
  }

  function paintMarks(plot, panel) {
    const { ctx, bbox } = plot, ratio = devicePixelRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const [value, colour] of panel.marks) {
      const x = plot.valToPos(value, "x", true);
      ctx.strokeStyle = shown(colour);
      ctx.lineWidth = ratio;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
    }
    for (const curve of panel.curves.filter((one) => one.kind === "lanes")) {
      const [start, y, end] = [arrays[curve.x], arrays[curve.y], arrays[curve.upper]];
      ctx.fillStyle = shown(curve.colour);
      start.forEach((low, row) => {
        const [left, right] = [low, end[row]].map((value) => plot.valToPos(value, "x", true));
        ctx.fillRect(left, plot.valToPos(y[row], "y", true) - 4 * ratio, Math.max(right - left, 1), 8 * ratio);
      });
    }
    ctx.restore();
  }

  function nearest(values, at) {
    // The value at a place, or the next one beside it: curves of unlike samples share one axis.
    for (let step = 0; step < NEAR; step += 1) {
      for (const place of [at - step, at + step]) if (values[place] != null) return values[place];
      if (values[at - step] === null || values[at + step] === null) return null; // a break of the line
    }
    return null;
  }

  function readout(row, panels, isFirst) {
    // One line above the panels of a row: names, and under the cursor their values; the first names the grounds, too.
    const line = row.appendChild(document.createElement("div")), entries = new Map();
    line.className = "readout";
    const add = (name, colour, kind) => {
      if (!name || entries.has(name)) return;
      const entry = line.appendChild(document.createElement("span"));
      entry.className = kind;
      entry.append(Object.assign(document.createElement("i"), { style: `color:${kind === "ground" ? ground(colour) : shown(colour)}` }), name);
      entries.set(name, { entry, value: entry.appendChild(document.createElement("b")) });
    };
    for (const panel of panels) {
      for (const curve of panel.curves) add(nameOf(panel, curve), curve.colour, curve.dashed ? "line dashed" : curve.kind);
      if (isFirst) for (const [, , colour, name] of panel.grounds) add(name, colour, "ground");
    }
    const place = line.appendChild(document.createElement("b"));
    const hint = isFirst ? HINT : "", showHint = (isShown) => place.classList.toggle("hint", isShown);
    place.textContent = hint;
    showHint(true);
    return (plot, panel, labels) => {
      const { idx, left } = plot.cursor, isOver = left >= 0 && left <= plot.over.clientWidth && idx != null;
      const x = isOver ? plot.posToVal(left, "x") : null;
      place.textContent = isOver ? told(panel, x) : hint;
      showHint(!isOver);
      const values = new Map();
      if (isOver) labels.forEach((name, at) => {
        const value = name && nearest(plot.data[at + 1], idx);
        if (name && value != null) values.set(name, [...(values.get(name) || []), within(panel.y, panel.log[1])(value)]);
      });
      for (const [, , , name] of panel.grounds) entries.get(name)?.entry.classList.remove("here");
      for (const [low, high, , name] of panel.grounds) if (isOver && x >= low && x <= high) entries.get(name)?.entry.classList.add("here");
      for (const name of labels) if (name) entries.get(name).value.textContent = (values.get(name) || []).reverse().join(" \u2026 ");
    };
  }

  function follow(source, min, max) {
    for (const { plot, panel } of timed) {
      const [low, high] = [Math.max(min, panel.x[0]), Math.min(max, panel.x[1])];
      if (plot !== source && low < high) plot.setScale("x", { min: low, max: high });
    }
  }

  function zoom(plot, panel) {
    const { left, top, width, height } = plot.select;
    if (width < 3 && height < 3) return;
    const ends = [left, left + width].map((place) => plot.posToVal(place, "x")).sort((one, two) => one - two);
    if (width >= 3) plot.setScale("x", { min: ends[0], max: ends[1] });
    if (height < plot.over.clientHeight) plot.setScale("y", { min: plot.posToVal(top + height, "y"), max: plot.posToVal(top, "y") });
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    if (panel.time && width >= 3) follow(plot, ...ends);
  }

  function whole() {
    for (const { plot, panel } of plots) {
      plot.setScale("x", { min: Math.min(...panel.x), max: Math.max(...panel.x) });
      plot.setScale("y", { min: Math.min(...panel.y), max: Math.max(...panel.y) });
    }
  }

  const decades = (low, high) => {
    // Ticks of a logarithmic axis: 1, 2 and 5 of each decade, or the decades alone, or some of them.
    const [first, last] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))], found = [];
    const factors = high / low <= 1000 ? [1, 2, 5] : [1], step = Math.ceil((last - first) / 8);
    for (let power = first; power <= last; power += 1) {
      if (factors.length === 1 && (power - first) % step) continue;
      for (const factor of factors) found.push(factor * 10 ** power);
    }
    const shownOnes = found.filter((value) => value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9));
    return shownOnes.length > 1 ? shownOnes : [low, high];
  };
  // Steps of ticks whose decimals are those of their decade: beside steps of 2.5 rounded numbers would repeat.
  const ROUND_STEPS = Array.from({ length: 60 }, (_, at) => [1, 2, 5].map((part) => Number(`${part}e${at - 30}`))).flat();
  const splitsOf = (isLog) => (isLog ? { splits: (_, __, low, high) => decades(low, high), filter: (_, splits) => splits } : { incrs: ROUND_STEPS });
  const numbers = (splits, isLog) => {
    // Beside ticks: with the decimals of the step between them.
    const known = splits.filter((value) => value != null), decimals = known.length > 1 && !isLog ? decimalsOf(known[1] - known[0]) : null;
    return splits.map((value) => (value == null ? "" : decimals === null ? plain(value) : value.toFixed(decimals).replace(/^-(?=.*[1-9])/, "\u2212").replace(/^-/, "")));
  };
  const roomBeside = (panel) => {
    // For what stands beside an upright axis: names in full, or the longest number and the title.
    if (panel.names.length) return Math.max(...panel.names.map(([, name]) => widthOf(name))) + GAP_PX;
    const tell = within(panel.y, panel.log[1]), steps = [0, 0.2, 0.4, 0.6, 0.8, 1];
    const longest = Math.max(...steps.map((share) => widthOf(tell(valueOf(panel.y, share, panel.log[1])))));
    return Math.min(longest, 2 * LEFT_PX) + GAP_PX + (panel.titles[2] ? TITLED_PX + 4 : 0);
  };

  // The title of an upright axis; of one longer than the axis its unit alone: the line above has the whole of it.
  const fitting = (title, px) => (title && title.length * CHARACTER_PX > px && title.includes(", ") ? title.split(", ").pop() : title);

  const plots = [];
  function draw(box, panel, width, height, left, hasTimes, tell) {
    const { data, series, bands } = tables(panel);
    const labels = series.map((one) => one.label);
    const line = { stroke: colourOf("--rule"), width: 1 };
    const axis = { stroke: colourOf("--ink"), grid: line, ticks: { ...line, size: 5 }, font: FONT, labelFont: FONT, labelSize: TITLED_PX + 4, labelGap: 0, gap: 3 };
    const scale = (range, log) => ({
      time: false, distr: log ? 3 : 1, dir: range[0] > range[1] ? -1 : 1,
      range: (_, min, max) => [min ?? Math.min(...range), max ?? Math.max(...range)],
    });
    const names = new Map(panel.names);
    const upright = names.size
      ? { ...axis, grid: { show: false }, size: left, splits: () => [...names.keys()], values: (_, splits) => splits.map((place) => (left > BESIDE_PX ? names.get(place) : "")) }
      : { ...axis, label: fitting(panel.titles[2], panel.place[3] * PX_PER_MM) || null, size: left - (panel.titles[2] ? axis.labelSize : 0), space: 26, ...splitsOf(panel.log[1]), values: (_, splits) => numbers(splits, panel.log[1]) };
    const along = panel.time
      ? { incrs: STEPS, space: 70, values: (_, splits) => (hasTimes ? clocks(splits) : splits.map(() => "")) }
      : { space: 60, ...splitsOf(panel.log[0]), values: (_, splits) => numbers(splits, panel.log[0]) };
    const plot = new uPlot({
      width, height, bands,
      padding: [6, RIGHT_PX, 0, 0],
      scales: { x: scale(panel.x, panel.log[0]), y: scale(panel.y, panel.log[1]) },
      series: [{}, ...series],
      axes: [{ ...axis, label: panel.titles[1] || null, size: hasTimes ? 24 : 4, ...along }, upright],
      cursor: {
        y: false,
        dataIdx: (self, _, at, x) => (x < Math.min(...panel.x) || x > Math.max(...panel.x) ? null : at),
        drag: { x: true, y: !names.size, uni: 24, setScale: false },
        points: { size: 6 },
        ...(panel.time ? { sync: { key: "time", scales: ["x", null], setSeries: false } } : {}),
        bind: { dblclick: () => () => { whole(); return null; } },
      },
      legend: { show: false },
      hooks: {
        drawClear: [(self) => paintGrounds(self, panel)],
        draw: [(self) => paintMarks(self, panel)],
        setSelect: [(self) => zoom(self, panel)],
        setCursor: [(self) => tell(self, panel, labels)],
      },
    }, data, box);
    plot.setScale("x", { min: Math.min(...panel.x), max: Math.max(...panel.x) });
    plot.setScale("y", { min: Math.min(...panel.y), max: Math.max(...panel.y) });
    plots.push({ plot, panel });
    if (panel.time) timed.push({ plot, panel });
  }

  function build(host, panels) {
    const room = host.clientWidth, isNarrow = room < NARROW_PX;
    const rows = new Map();
    for (const panel of panels) {
      const key = Math.round(panel.place[1]);
      rows.set(key, [...(rows.get(key) || []), panel]);
    }
    const box = document.createElement("div");
    box.className = "live";
    host.append(box);
    host.classList.add("is-live");
    const isFirstOfRow = (panel) => panel === rows.get(Math.round(panel.place[1]))[0];
    const first = Math.min(Math.max(LEFT_PX, ...panels.filter(isFirstOfRow).map(roomBeside)), 0.4 * room);
    for (const row of rows.values()) {
      const isFirst = box.childElementCount === 0, isLast = row.includes(panels[panels.length - 1]);
      const hasTimes = isLast || row.some((panel) => !panel.time || panel.titles[1]);
      const tell = readout(box, row, isFirst);
      const line = box.appendChild(document.createElement("div"));
      line.className = "live-row";
      const lefts = row.map((panel, at) => (at && !isNarrow ? (panel.titles[2] ? Math.max(LEFT_PX, roomBeside(panel)) : BESIDE_PX) : first));
      const sum = row.reduce((total, panel) => total + panel.place[2], 0);
      const spare = room - lefts.reduce((total, left) => total + left, 0);
      row.forEach((panel, at) => {
        const cell = line.appendChild(document.createElement("div"));
        if (panel.titles[0]) cell.append(Object.assign(document.createElement("div"), { className: "panel-title", textContent: panel.titles[0] }));
        const left = lefts[at];
        const width = isNarrow ? room : left + (spare * panel.place[2]) / sum;
        const height = Math.round(panel.place[3] * PX_PER_MM) + (hasTimes ? 34 : 14) + (panel.titles[1] ? TITLED_PX : 0);
        draw(cell, panel, Math.floor(width), height, left, hasTimes, tell);
      });
    }
  }

  const PT_PER_MM = 72 / 25.4, SVG = "http://www.w3.org/2000/svg", NEAR_SHARE = 0.04, LEAST_PT = 4;
  const valueOf = (range, share, isLog) => (isLog ? range[0] * (range[1] / range[0]) ** share : range[0] + share * (range[1] - range[0]));
  const shareOf = (range, value, isLog) => (isLog ? Math.log(value / range[0]) / Math.log(range[1] / range[0]) : (value - range[0]) / (range[1] - range[0]));

  function nearestSample(frame, x, y) {
    // The value of the sample nearest to a place, given in shares of the axes; nothing far from all of them.
    const [xs, ys, values] = frame.samples.map((place) => arrays[place]);
    let [best, least] = [null, NEAR_SHARE ** 2];
    xs.forEach((value, row) => {
      if (value == null || ys[row] == null) return;
      const far = (shareOf(frame.x, value, frame.log[0]) - x) ** 2 + (shareOf(frame.y, ys[row], frame.log[1]) - y) ** 2;
      if (far < least) [best, least] = [values[row], far];
    });
    return best;
  }

  function found(frame, x, y) {
    // Name and value of what stands at a place of the axes, given in shares of them.
    const [across, up] = [valueOf(frame.x, x, frame.log[0]), valueOf(frame.y, y, frame.log[1])];
    const name = frame.names.slice().sort((one, two) => Math.abs(one[0] - up) - Math.abs(two[0] - up))[0];
    const sample = frame.samples ? nearestSample(frame, x, y) : null;
    const seen = [[frame.titles[1], told(frame, across)], name ? ["", name[1]] : [frame.titles[2], within(frame.y, frame.log[1])(up)]];
    if (sample != null) seen.unshift([frame.of, frame.of === "flight time" ? clock(sample) : plain(sample)]);
    return seen;
  }

  function extent(frame, [left, low], [right, high]) {
    // What a narrowed view shows of the axes, whose own scales may lie outside it.
    const ends = (range, one, two, isLog) => [one, two].map((share) => valueOf(range, Math.min(Math.max(share, 0), 1), isLog));
    const x = ends(frame.x, left, right, frame.log[0]).map((value) => told(frame, value));
    const y = ends(frame.y, low, high, frame.log[1]).map(within(frame.y, frame.log[1]));
    const seen = [[frame.titles[1], x.join(" \u2026 ")]];
    return frame.names.length ? seen : [...seen, [frame.titles[2], y.join(" \u2026 ")]];
  }

  function picture(host, frames) {
    const svg = host.querySelector("svg"), [width, height] = [svg.viewBox.baseVal.width, svg.viewBox.baseVal.height];
    const line = host.insertBefore(document.createElement("div"), svg), chosen = document.createElementNS(SVG, "rect");
    line.className = "readout";
    chosen.setAttribute("class", "chosen");
    let view = [0, 0, width, height], start = null;
    const say = (seen) => line.replaceChildren(...seen.map(([name, value]) => {
      const entry = document.createElement("span");
      entry.append(name, Object.assign(document.createElement("b"), { textContent: value }));
      return entry;
    }));
    const sharesIn = (frame, [x, y]) => {
      const [left, bottom, wide, high] = frame.place.map((value) => value * PT_PER_MM);
      return [(x - left) / wide, (height - y - bottom) / high];
    };
    const frameAt = (place) => frames.find((frame) => sharesIn(frame, place).every((share) => share >= 0 && share <= 1));
    const rest = () => {
      const frame = frameAt([view[0] + view[2] / 2, view[1] + view[3] / 2]);
      const corners = [[view[0], view[1] + view[3]], [view[0] + view[2], view[1]]];
      say(frame && view[2] < width ? extent(frame, ...corners.map((place) => sharesIn(frame, place))) : []);
      if (view[2] === width) line.append(Object.assign(document.createElement("b"), { className: "hint", textContent: HINT }));
    };
    const tell = (place) => {
      const frame = frameAt(place);
      if (frame) say(found(frame, ...sharesIn(frame, place)));
      else rest();
    };
    const show = (next) => {
      view = next;
      svg.setAttribute("viewBox", view.join(" "));
      host.classList.toggle("is-zoomed", view[2] < width);
      rest();
    };
    const placeOf = (event) => {
      const box = svg.getBoundingClientRect();
      return [view[0] + ((event.clientX - box.left) / box.width) * view[2], view[1] + ((event.clientY - box.top) / box.height) * view[3]];
    };
    const between = (one, two) => [Math.min(one[0], two[0]), Math.min(one[1], two[1]), Math.abs(one[0] - two[0]), Math.abs(one[1] - two[1])];
    svg.addEventListener("pointerdown", (event) => {
      if (event.pointerType !== "mouse" || event.button) return;
      event.preventDefault();
      svg.setPointerCapture(event.pointerId);
      start = placeOf(event);
    });
    svg.addEventListener("pointermove", (event) => {
      const here = placeOf(event);
      tell(here);
      if (!start) return;
      const box = between(start, here);
      ["x", "y", "width", "height"].forEach((name, at) => chosen.setAttribute(name, box[at]));
      svg.append(chosen);
    });
    svg.addEventListener("pointerup", (event) => {
      if (!start) return;
      const [x, y, wide, high] = between(start, placeOf(event));
      start = null;
      chosen.remove();
      if (Math.max(wide, high) < (LEAST_PT * view[2]) / width) return;
      const across = Math.max(wide, (high * width) / height), up = (across * height) / width; // of the picture's shape
      show([x + (wide - across) / 2, y + (high - up) / 2, across, up]);
    });
    svg.addEventListener("pointerleave", rest);
    svg.addEventListener("dblclick", () => show([0, 0, width, height]));
    rest();
  }
  for (const host of document.querySelectorAll(".plot[data-framed]")) picture(host, page.pictures[Number(host.dataset.framed)]);

  const hosts = [...document.querySelectorAll(".plot[data-live]")];
  const seen = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (!entry.isIntersecting || entry.target.classList.contains("is-live")) continue;
      build(entry.target, page.figures[Number(entry.target.dataset.live)]);
    }
  }, { rootMargin: "600px" });
  hosts.forEach((host) => seen.observe(host));

  function again() {
    plots.splice(0).forEach(({ plot }) => plot.destroy());
    timed.length = 0;
    for (const host of hosts) {
      host.querySelector(".live")?.remove();
      host.classList.remove("is-live");
      seen.unobserve(host);
      seen.observe(host);
    }
  }
  let width = innerWidth, waiting;
  addEventListener("resize", () => {
    if (innerWidth === width) return;
    width = innerWidth;
    clearTimeout(waiting);
    waiting = setTimeout(again, 200);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
})();
