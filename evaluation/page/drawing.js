const COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7A3DB8", "#8A5A00"]; // Okabe and Ito: told apart by the colour-blind; and two more
const DASHES = ["", "6 3", "2 2", "8 2 2 2", "10 4", "4 1", "8 2 2 2 2 2", "2 5"];
const SVG = "http://www.w3.org/2000/svg";
const colour = i => COLOURS[i % COLOURS.length], dash = i => DASHES[i % DASHES.length];

function draw(parent, tag, attributes = {}, text) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (text !== undefined) made.textContent = text;
  parent.append(made);
  return made;
}
function make(parent, tag, text, attributes = {}) {
  const made = document.createElement(tag);
  if (text !== undefined) made.textContent = text;
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  parent.append(made);
  return made;
}
const NORM = DATA.norm || "people"; // whose curves are grey
const known = values => values.filter(value => value !== null && value !== undefined);
function ticks(low, high, about) {
  const rough = (high - low) / about, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].map(k => k * power).find(k => k >= rough);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(+(k * step).toPrecision(12));
  return found;
}
function path(xs, ys, X, Y) {
  let text = "", pen = "M";
  xs.forEach((x, k) => {
    if (x === null || ys[k] === null) { pen = "M"; return; }
    text += `${pen}${X(x).toFixed(1)},${Y(ys[k]).toFixed(1)}`; pen = "L";
  });
  return text;
}
function band(xs, mean, sd, X, Y) {
  const at = xs.map((x, k) => k).filter(k => known([mean[k], sd[k]]).length === 2);
  if (!at.length) return "";
  const upper = at.map(k => `${X(xs[k]).toFixed(1)},${Y(mean[k] + sd[k]).toFixed(1)}`);
  return `M${upper.concat(at.reverse().map(k => `${X(xs[k]).toFixed(1)},${Y(mean[k] - sd[k]).toFixed(1)}`)).join("L")}Z`;
}

const LEAST_SPAN = 1e-4; // of an axis: less is nothing in all our units
const WIDTH = 340, HEIGHT = 215, LEFT = 58, RIGHT = 10, TOP = 26, BOTTOM = 36;
function frame(parent, title, xUnit, yUnit, xs, ys) {
  const figure = make(parent, "figure");
  const svg = draw(figure, "svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": `${title} (${yUnit})` });
  let [low, high] = [Math.min(...ys), Math.max(...ys)];
  if (!(high - low > LEAST_SPAN)) [low, high] = [(ys.length ? low : 0) - 1, (ys.length ? high : 0) + 1];
  const margin = .05 * (high - low);
  [low, high] = [low - margin, high + margin];
  const X = x => LEFT + (x - xs[0]) / (xs[1] - xs[0]) * (WIDTH - LEFT - RIGHT);
  const Y = y => HEIGHT - BOTTOM - (y - low) / (high - low) * (HEIGHT - TOP - BOTTOM);
  draw(svg, "text", { x: 4, y: 14, class: "title" }, title);
  draw(svg, "text", { x: WIDTH - RIGHT, y: HEIGHT - 4, "text-anchor": "end", class: "unit" }, xUnit);
  draw(svg, "text", { x: -(HEIGHT - BOTTOM + TOP) / 2, y: 11, transform: "rotate(-90)", "text-anchor": "middle", class: "unit" }, yUnit);
  for (const tick of ticks(low, high, 4)) {
    draw(svg, "line", { x1: LEFT, x2: WIDTH - RIGHT, y1: Y(tick), y2: Y(tick), stroke: "var(--line)", "stroke-width": tick === 0 ? 1.4 : .6 });
    draw(svg, "text", { x: LEFT - 5, y: Y(tick) + 4, "text-anchor": "end" }, tick && Math.abs(tick) < 1e-3 ? tick.toExponential() : String(tick));
  }
  for (const tick of ticks(xs[0], xs[1], 5)) draw(svg, "text", { x: X(tick), y: HEIGHT - BOTTOM + 15, "text-anchor": "middle" }, String(tick));
  return { svg, X, Y };
}

const PERCENT = Array.from({ length: 101 }, (_, k) => k);
const followers = []; // each is told where in the stride and the step we are, and draws its cursor there
// What is drawn of the policies in one panel: a line each, or where its feet differ one for the left leg and a finer, paler one for the right.
const lines = which => which.flatMap((p, i) => (p.legs || [p]).map((own, leg) => ({ ...own, of: i, leg, side: p.legs ? ["left ", "right "][leg] : "", name: [policies[i].name, ...(p.legs ? [["left", "right"][leg]] : [])].join(" "), shade: colour(i), dash: dash(i), width: leg ? 1.2 : 1.9, opacity: leg ? .6 : 1 })));
// Which policy alone is shown, by its number; null for all. Whatever belongs to one has data-of.
let only = null;
const isShown = p => only === null || p.of === only;
// A function that tells the numbers of a panel in one precision: three digits of the largest of `all`.
const teller = all => {
  const largest = Math.max(...all.map(Math.abs)), digits = largest > LEAST_SPAN ? Math.max(0, 2 - Math.floor(Math.log10(largest))) : 0;
  return value => value === null || value === undefined ? "–" : value.toFixed(digits);
};
function panel(parent, which) {
  const drawn = lines(which);
  const all = [...drawn, ...which].flatMap(p => [p.mean, p.people || [], p.plan || []].flatMap((mean, k) => {
    const sd = [p.sd, p.people_sd || [], []][k];
    return known(mean.flatMap((m, j) => m === null ? [] : [m - (sd[j] || 0), m + (sd[j] || 0)]));
  })).concat(which[0].zero ? [0] : []);
  const short = teller(all), unit = which[0].unit.split(", ").pop();
  const axis = which[0].axis || "stride"; // or the step, or each leg's own phase
  const { svg, X, Y } = frame(parent, which[0].title, { stride: "% of the stride", step: "% of the step", leg: "% of the leg's phase" }[axis], which[0].unit, [0, 100], all);
  if (axis === "stride") policies.flatMap((p, i) => [[p.toe_off[0], colour(i), { "data-of": i }], ...(i ? [] : [[p.toe_off[1], "var(--people)", {}]])]).forEach(([at, shade, of]) => {
    if (at !== null) draw(svg, "line", { x1: X(at), x2: X(at), y1: TOP, y2: HEIGHT - BOTTOM, stroke: shade, "stroke-dasharray": "2 2", class: "toe-off", ...of });
  });
  const first = which.find(p => p.people) || which[0];
  if (first.people) {
    draw(svg, "path", { d: band(PERCENT, first.people, first.people_sd, X, Y), fill: "var(--people)", opacity: .25, class: "people-sd" });
    draw(svg, "path", { d: path(PERCENT, first.people, X, Y), fill: "none", stroke: "var(--people)", "stroke-width": 1.4, class: "people" });
  }
  which.forEach((p, i) => { if (p.plan) draw(svg, "path", { d: path(PERCENT, p.plan, X, Y), fill: "none", stroke: "var(--ink)", "stroke-width": 1.2, "stroke-dasharray": "2 3", class: "plan", "data-of": i }); });
  for (const p of drawn) {
    draw(svg, "path", { d: band(PERCENT, p.mean, p.sd, X, Y), fill: p.shade, opacity: .18 * p.opacity, class: "sd", "data-of": p.of });
    draw(svg, "path", { d: path(PERCENT, p.mean, X, Y), fill: "none", stroke: p.shade, "stroke-width": p.width, "stroke-opacity": p.opacity, "stroke-dasharray": p.dash, class: "mean", "data-of": p.of });
  }
  const upright = name => draw(svg, "line", { y1: TOP, y2: HEIGHT - BOTTOM, stroke: "var(--ink)", "stroke-width": 1, class: name, visibility: "hidden" });
  const line = upright("cursor"), pointer = upright("pointer");
  const dots = drawn.map(p => draw(svg, "circle", { r: 3.5, fill: p.shade, "fill-opacity": p.opacity, stroke: "var(--paper)", class: "dot", "data-of": p.of }));
  // Values stand below the drawing, where they have lines enough, each with its line's colour.
  const note = make(svg.parentElement, "div", undefined, { class: "value" });
  const tell = (begin, texts, end) => {
    note.replaceChildren();
    if (begin) make(note, "span", begin);
    drawn.forEach((p, i) => { if (isShown(p)) make(note, "span", p.side + texts[i], { class: "own", style: `border-color:${p.shade}${Math.round(255 * p.opacity).toString(16)}` }); });
    if (end) make(note, "span", end);
    make(note, "span", unit);
  };
  let following = () => {};
  followers.push(where => {
    const at = drawn.map(p => axis !== "leg" ? where[axis] : p.leg ? where.right : where.left), k = at.map(x => Math.min(100, Math.round(x)));
    line.setAttribute("x1", X(at[0])); line.setAttribute("x2", X(at[0])); line.setAttribute("data-percent", at[0].toFixed(1)); line.setAttribute("visibility", "visible");
    dots.forEach((dot, i) => {
      const y = drawn[i].mean[k[i]];
      dot.setAttribute("visibility", y === null ? "hidden" : "visible");
      if (y !== null) { dot.setAttribute("cx", X(k[i])); dot.setAttribute("cy", Y(y)); }
    });
    following = () => tell("", drawn.map((p, i) => short(p.mean[k[i]])), "");
    following();
  });
  // Where the pointer is: the values there, people's too.
  svg.addEventListener("pointermove", event => {
    const box = svg.getBoundingClientRect(), k = Math.round(((event.clientX - box.left) * WIDTH / box.width - LEFT) / (WIDTH - LEFT - RIGHT) * 100);
    if (k < 0 || k > 100) return;
    pointer.setAttribute("x1", X(k)); pointer.setAttribute("x2", X(k)); pointer.setAttribute("visibility", "visible");
    const spread = (mean, sd) => drawn.filter(isShown).length < 3 && sd !== null && sd !== undefined ? `${short(mean)} ± ${short(sd)}` : short(mean);
    tell(`${k} %: `, drawn.map(p => spread(p.mean[k], p.sd[k])), first.people ? `${NORM} ${short(first.people[k])}` : "");
  });
  svg.addEventListener("pointerleave", () => { pointer.setAttribute("visibility", "hidden"); following(); });
  const heads = ["percent", ...drawn.flatMap(p => [`${p.name} mean`, `${p.name} sd`]), ...(first.people ? [`${NORM} mean`, `${NORM} sd`] : [])];
  savers(svg, which[0].title, [heads, ...PERCENT.map(k => [k, ...drawn.flatMap(p => [p.mean[k], p.sd[k]]), ...(first.people ? [first.people[k], first.people_sd[k]] : [])])]);
}
// Buttons below a drawing that save it as a picture, and its numbers as a table.
function savers(svg, title, rows) {
  const save = (suffix, url) => { const link = document.createElement("a"); link.href = url; link.download = `${title.replace(/[^\w]+/g, "_")}.${suffix}`; link.click(); };
  const quoted = cell => /[",\n]/.test(cell) ? `"${String(cell).replaceAll('"', '""')}"` : cell ?? "";
  const buttons = make(svg.parentElement, "div", undefined, { class: "save" });
  make(buttons, "button", "PNG", { type: "button", "aria-label": `PNG of ${title}` }).addEventListener("click", () => picture(svg, url => save("png", url)));
  make(buttons, "button", "CSV", { type: "button", "aria-label": `CSV of ${title}` }).addEventListener("click", () =>
    save("csv", `data:text/csv;charset=utf-8,${encodeURIComponent(rows.map(row => row.map(quoted).join(",")).join("\r\n"))}`));
}
// A picture of a drawing, twice its size, as a data URL: with the page's colours and font in it, which a picture does not inherit.
function picture(svg, done) {
  const copy = svg.cloneNode(true), [, , wide, tall] = svg.getAttribute("viewBox").split(" ").map(Number), style = getComputedStyle(document.documentElement);
  copy.setAttribute("width", 2 * wide); copy.setAttribute("height", 2 * tall);
  const texts = svg.querySelectorAll("text");
  copy.querySelectorAll("text").forEach((text, i) => { const own = getComputedStyle(texts[i]); text.setAttribute("style", `fill:${own.fill};font:${own.fontWeight} ${own.fontSize} ${own.fontFamily}`); });
  const paper = document.createElementNS(SVG, "rect");
  for (const [name, value] of Object.entries({ width: wide, height: tall, fill: "var(--paper)" })) paper.setAttribute(name, value);
  copy.prepend(paper);
  const text = new XMLSerializer().serializeToString(copy).replace(/var\((--\w+)\)/g, (_, name) => style.getPropertyValue(name).trim());
  const image = new Image();
  image.onload = () => {
    const canvas = document.createElement("canvas");
    canvas.width = 2 * wide; canvas.height = 2 * tall;
    canvas.getContext("2d").drawImage(image, 0, 0);
    done(canvas.toDataURL("image/png"));
  };
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`;
}
function loop(parent, which) {
  const drawn = lines(which), each = [...drawn, ...which];
  const xs = each.flatMap(p => known([...p.x, ...(p.people_x || [])])), ys = each.flatMap(p => known([...p.y, ...(p.people_y || [])]));
  const ends = xs.length ? [Math.min(...xs) - 1, Math.max(...xs) + 1] : [0, 1];
  const { svg, X, Y } = frame(parent, which[0].title, "angle, deg", "moment, N·m/kg", ends, ys);
  const first = which[0];
  if (first.people_x) draw(svg, "path", { d: path(first.people_x, first.people_y, X, Y), fill: "none", stroke: "var(--people)", "stroke-width": 1.4, class: "people" });
  for (const line of first.thesis || []) draw(svg, "path", { d: path(line.map(p => p[0]), line.map(p => p[1]), X, Y), fill: "none", stroke: "var(--ink)", "stroke-width": 1.6, "stroke-dasharray": "2 3", class: "thesis" });
  for (const p of drawn) draw(svg, "path", { d: path(p.x, p.y, X, Y), fill: "none", stroke: p.shade, "stroke-width": p.width, "stroke-opacity": p.opacity, "stroke-dasharray": p.dash, class: "mean", "data-of": p.of });
  const dots = drawn.map(p => draw(svg, "circle", { r: 4, fill: p.shade, "fill-opacity": p.opacity, stroke: "var(--paper)", class: "dot", "data-of": p.of }));
  followers.push(where => dots.forEach((dot, i) => {
    const k = Math.min(100, Math.round(where.stride)), p = drawn[i];
    dot.setAttribute("visibility", p.x[k] === null ? "hidden" : "visible");
    if (p.x[k] !== null) { dot.setAttribute("cx", X(p.x[k])); dot.setAttribute("cy", Y(p.y[k])); }
  }));
  savers(svg, which[0].title, [["percent", ...drawn.flatMap(p => [`${p.name} angle`, `${p.name} moment`])], ...PERCENT.map(k => [k, ...drawn.flatMap(p => [p.x[k], p.y[k]])])]);
}
function bars(parent, policies) {
  const names = Object.keys(policies[0].metrics.energy_J_kg), values = policies.map(p => names.map(name => p.metrics.energy_J_kg[name]));
  const high = Math.max(.1, ...known(values.flat()).map(Math.abs)), row = 8 + 12 * policies.length, tall = 34 + row * names.length;
  const figure = make(parent, "figure"), svg = draw(figure, "svg", { viewBox: `0 0 ${WIDTH} ${tall}`, role: "img", "aria-label": "Energy ledger of a stride (J/kg)" });
  draw(svg, "text", { x: 4, y: 14, class: "title" }, "Energy ledger of a stride, into the body +");
  const X = value => 235 + value / high * 55;
  names.forEach((name, k) => {
    draw(svg, "text", { x: 4, y: 28 + row * k + 6 * policies.length }, name.replaceAll("_", " "));
    values.forEach((own, i) => {
      if (own[k] === null) return;
      draw(svg, "rect", { x: Math.min(X(0), X(own[k])), y: 25 + row * k + 12 * i, width: Math.abs(X(own[k]) - X(0)), height: 10, fill: colour(i), class: "energy", "data-of": i });
      draw(svg, "text", { x: WIDTH - 2, y: 34 + row * k + 12 * i, "text-anchor": "end", "data-of": i }, own[k].toFixed(3));
    });
  });
  draw(svg, "text", { x: WIDTH - 2, y: tall - 2, "text-anchor": "end", class: "unit" }, "J/kg");
}

// The body: segments as lines from the joint angles, forces as arrows, ankles and toes coloured by their stiffness.
const STIFF = [[0, 34, 78], [124, 123, 120], [253, 231, 55]]; // soft to stiff, of cividis: even for the colour-blind
function stiffColour(value, low, high) {
  const share = 2 * Math.max(0, Math.min(1, Math.log(value / low) / Math.log(high / low))), k = Math.min(1, Math.floor(share));
  return `rgb(${STIFF[k].map((c, j) => Math.round(c + (share - k) * (STIFF[k + 1][j] - c))).join(",")})`;
}
const turned = ([f, u], a) => [f * Math.cos(a) - u * Math.sin(a), f * Math.sin(a) + u * Math.cos(a)];
const plus = (a, b) => [a[0] + b[0], a[1] + b[1]];
function walker(parent, policy, i) {
  const f = policy.figure, frames = f.base.length, size = f.height / 1.7, L = f.lengths;
  const figure = make(parent, "figure", undefined, { "data-of": i }), svg = draw(figure, "svg", { viewBox: "0 0 400 360", role: "img", "aria-label": `${policy.name}, animated` });
  const scale = 155 / size, floor = 325;
  const [left_foot, right_foot] = f.feet.map(each => each.words);
  const feet = left_foot === right_foot ? `both feet ${left_foot}` : `left foot ${left_foot}, right foot ${right_foot}`;
  make(figure, "figcaption", left_foot.startsWith(`${policy.name} `) ? feet : `${policy.name}: ${feet}`);
  const ground = draw(svg, "line", { stroke: "var(--faint)", x1: 0, x2: 400 }), marks = draw(svg, "g", {});
  const layer = draw(svg, "g", { "stroke-linecap": "round", "stroke-linejoin": "round" });
  const line = (width, shade) => draw(layer, "polyline", { fill: "none", stroke: shade, "stroke-width": width * size * scale });
  const disc = (r, style) => draw(layer, "circle", { r: r * size * scale, ...style });
  const square = (r, style) => draw(layer, "path", { "data-r": r * size * scale, ...style });
  const leg = (side, shade) => ({ side, own: f.feet[side], orthosis: f.feet[side].orthosis ? line(.11, "#8a8f94") : null, bones: line(.075, shade), foot: line(.035, shade), toe: line(.022, shade),
    joints: f.feet[side].joints.map((at, j) => (at === "muscles" ? disc : square)([.03, .022][j], { stroke: at === "lock" ? "var(--ink)" : "var(--paper)", class: `joint ${at}`, visibility: j && f.feet[side].one_piece ? "hidden" : "visible" })), arrow: draw(layer, "path", { fill: "none", stroke: "var(--ink)", "stroke-opacity": side ? .45 : 1, "stroke-width": 2.5, class: "force" }) });
  const right = leg(1, "#9EC4D1"), trunk = line(.11, "#7d8b99"), head = disc(.095, { fill: "#7d8b99" }), left = leg(0, colour(i));
  const plan = disc(.034, { fill: "none", stroke: "#CC79A7", "stroke-width": 2 }), com = disc(.02, { fill: "var(--ink)", stroke: "var(--paper)", class: "com" });
  const zmp = draw(layer, "path", { fill: "none", stroke: "var(--ink)", class: "zmp" }), cop = draw(layer, "path", { fill: "var(--ink)", class: "cop" });
  const words = draw(svg, "text", { x: 8, y: 16 });
  const ends = frames > 1 ? [f.base[0][0], f.base[frames - 1][0]] : [f.base[0]?.[0] ?? 0, f.base[0]?.[0] ?? 0];
  const show = u => {
    if (!frames) return;
    const k = Math.min(frames - 1, Math.round(u * (frames - 1))), [x, z, pitch] = f.base[k], middle = ends[0] + u * (ends[1] - ends[0]);
    const P = ([px, pz]) => [200 + (px - middle) * scale, floor - (pz + f.slope * (px - middle)) * scale];
    const text = points => points.map(p => P(p).map(c => c.toFixed(1)).join(",")).join(" ");
    const place = (dot, p) => {
      const [cx, cy] = P(p), r = dot.dataset.r;
      if (r) dot.setAttribute("d", `M${(cx - r).toFixed(2)},${(cy - r).toFixed(2)}h${2 * r}v${2 * r}h${-2 * r}Z`);
      else { dot.setAttribute("cx", cx.toFixed(2)); dot.setAttribute("cy", cy.toFixed(2)); }
    };
    const hip = [x, z], along = [Math.sin(pitch), Math.cos(pitch)], shoulder = plus(hip, along.map(c => c * L.trunk));
    ground.setAttribute("y1", floor + f.slope * 200); ground.setAttribute("y2", floor - f.slope * 200);
    marks.replaceChildren();
    for (let m = Math.ceil((middle - 200 / scale) * 2); m <= (middle + 200 / scale) * 2; m++) {
      const [mx, my] = P([m / 2, 0]);
      draw(marks, "line", { x1: mx, x2: mx, y1: my, y2: my + (m % 2 ? 4 : 8), stroke: "var(--faint)" });
      if (m % 2 === 0 && mx > 16 && mx < 384) draw(marks, "text", { x: mx, y: my + 20, "text-anchor": "middle" }, `${m / 2} m`);
    }
    trunk.setAttribute("points", text([hip, shoulder]));
    place(head, plus(shoulder, along.map(c => c * .165 * size)));
    for (const each of [right, left]) {
      const s = each.side, [h, kn, a, t] = f.angle[k].slice(4 * s, 4 * s + 4), thigh = h - pitch, shank = thigh - kn, pitchFoot = shank + a;
      const knee = plus(hip, [L.thigh * Math.sin(thigh), -L.thigh * Math.cos(thigh)]);
      const ankle = plus(knee, [L.shank * Math.sin(shank), -L.shank * Math.cos(shank)]);
      const joint = plus(ankle, turned(L.toe_joint, pitchFoot)), heel = plus(ankle, turned(L.heel, pitchFoot)), tip = plus(joint, turned(L.toe, pitchFoot + t));
      each.bones.setAttribute("points", text([hip, knee, ankle]));
      each.foot.setAttribute("points", text(each.own.one_piece ? [heel, ankle, tip, heel] : [heel, ankle, joint, heel]));
      if (each.orthosis) each.orthosis.setAttribute("points", text([plus(knee, [.6 * (ankle[0] - knee[0]), .6 * (ankle[1] - knee[1])]), ankle, joint]));
      each.toe.setAttribute("points", text([joint, tip]));
      [ankle, joint].forEach((centre, j) => { place(each.joints[j], centre); each.joints[j].setAttribute("fill", each.own.joints[j] === "lock" ? "var(--paper)" : stiffColour(f.stiffness[k][2 * s + j], ...f.ranges[j])); });
      const [cx, fx, fz] = f.force[s][k], [bx, by] = P([cx, 0]), long = .55 * size * scale;
      if (fz > .05) {
        const [tx, ty] = [bx + fx * long, by - fz * long], turn = Math.atan2(ty - by, tx - bx), barb = w => `${(tx + 9 * Math.cos(turn + w)).toFixed(1)},${(ty + 9 * Math.sin(turn + w)).toFixed(1)}`;
        each.arrow.setAttribute("d", `M${bx.toFixed(1)},${by.toFixed(1)}L${tx.toFixed(1)},${ty.toFixed(1)}M${barb(2.6)}L${tx.toFixed(1)},${ty.toFixed(1)}L${barb(-2.6)}`);
      } else each.arrow.setAttribute("d", "");
    }
    place(plan, f.plan[k]); place(com, f.com[k]);
    const [l, r] = [f.force[0][k], f.force[1][k]], total = l[2] + r[2], mark = (sx, filled) => { const [mx, my] = P([sx, 0]); filled.setAttribute("d", `M${mx.toFixed(1)},${my + 1}l-5,9l10,0Z`); };
    mark(f.zmp[k], zmp);
    if (total > .05) mark((l[0] * l[2] + r[0] * r[2]) / total, cop); else cop.setAttribute("d", "");
    svg.dataset.frame = k;
    const K = f.stiffness[k].map((v, at) => f.feet[at >> 1].joints[at % 2] === "lock" ? "locked" : v.toFixed(0));
    words.textContent = `K ankle ${K[0]} / ${K[2]}, toe ${K[1]} / ${K[3]} N·m/rad (left / right)`;
  };
  return { show, frames, f };
}

// One clock for all that moves: from 0 to 1 in `seconds()`; `show(u)` draws and returns words for where it is, `step()` is what an arrow key goes.
// It works the controls that every page has: play, scrub, where, speed, theme.
function clock({ show, seconds, step }) {
  const [scrub, play, where, speed, theme] = ["scrub", "play", "where", "speed", "theme"].map(id => document.getElementById(id));
  let u = 0, playing = false, then = 0;
  function go(to) {
    u = Math.max(0, Math.min(1, to));
    where.textContent = show(u);
    scrub.value = Math.round(1000 * u);
    scrub.setAttribute("aria-valuetext", where.textContent);
  }
  function advance(now) {
    if (!playing) return;
    go((u + (now - then) / 1000 * speed.value / seconds()) % 1);
    then = now;
    requestAnimationFrame(advance);
  }
  function toggle() {
    playing = !playing;
    play.textContent = playing ? "Pause" : "Play";
    if (playing) { then = performance.now(); requestAnimationFrame(advance); }
  }
  play.addEventListener("click", toggle);
  scrub.addEventListener("input", () => go(scrub.value / 1000));
  theme.addEventListener("click", () => {
    const dark = (document.documentElement.dataset.theme || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light")) === "dark";
    document.documentElement.dataset.theme = dark ? "light" : "dark";
  });
  document.addEventListener("keydown", event => {
    const at = event.target, table = at.closest(".wide");
    const elsewhere = at.closest("select") || at.closest("button") && event.key === " " || table && table.scrollWidth > table.clientWidth || at.closest("input") && at !== scrub && event.key !== " ";
    if (elsewhere || event.ctrlKey || event.metaKey || event.altKey) return;
    const act = { " ": toggle, ArrowLeft: () => go(u - step()), ArrowRight: () => go(u + step()), Home: () => go(0), End: () => go(1) }[event.key];
    if (act) { event.preventDefault(); act(); }
  });
  go(0);
  return { again: () => go(u) };
}
