(() => {
"use strict";
const $ = (selector, root = document) => root.querySelector(selector);
const all = (selector, root = document) => [...root.querySelectorAll(selector)];
const data = JSON.parse($("#data").textContent);
const column = Object.fromEntries(data.fields.map((name, i) => [name, i]));
const value = (row, name) => data.rows[row][column[name]];
const statusNames = {done: "Done", degraded: "Simplified", failed: "Failed", refused: "Refused"};
const verdictNames = {good: "Good", look: "To look at", poor: "Poor"};
const dash = v => v === null || v === undefined || v === "";
const cm = v => dash(v) ? "–" : (100 * v).toFixed(1) + " cm";
const percent = v => dash(v) ? "–" : (100 * v).toFixed(1) + " %";
const time = v => dash(v) ? "–" : v < 1 ? Math.round(1000 * v) + " ms" : v < 60 ? v.toFixed(1) + " s" : Math.floor(v / 60) + " min " + Math.floor(v % 60) + " s";
const plain = v => dash(v) ? "–" : String(v);
const make = (tag, text, className) => { const e = document.createElement(tag); if (text !== undefined) e.textContent = text; if (className) e.className = className; return e; };
const chip = status => { const e = make("span", undefined, "chip " + status); e.append(make("i"), statusNames[status] || verdictNames[status]); return e; };

// Theme: the system's unless chosen here.
const theme = $("#theme"), dark = matchMedia("(prefers-color-scheme: dark)");
const isDark = () => (document.documentElement.dataset.theme || (dark.matches ? "dark" : "light")) === "dark";
const nameTheme = () => { theme.textContent = isDark() ? "Light" : "Dark"; };
theme.hidden = false; nameTheme(); dark.addEventListener("change", nameTheme);
theme.addEventListener("click", () => { document.documentElement.dataset.theme = isDark() ? "light" : "dark"; nameTheme(); });

for (const button of all(".copy")) {
  button.hidden = !navigator.clipboard;
  button.addEventListener("click", async () => {
    try { await navigator.clipboard.writeText(button.previousElementSibling.textContent); button.textContent = "Copied"; }
    catch { getSelection().selectAllChildren(button.previousElementSibling); }
  });
}

for (const image of all(".picture:not(.across) img")) image.addEventListener("click", () => { image.parentNode.classList.toggle("opened"); });

// Map
const city = $("#city"), area = $(".maparea"), details = $("#details");
let chosen = null, choose = () => {};
if (city) {
  const whole = city.getAttribute("viewBox").split(" ").map(Number);
  const shapes = all(".u", city), shapeOf = new Map(shapes.map(s => [Number(s.dataset.row), s]));
  const centres = new Map();
  let view = [...whole];
  const bar = $(".scalebar"), tip = $("#tip");
  const perPixel = () => { const r = city.getBoundingClientRect(); return Math.max(view[2] / r.width, view[3] / r.height); };
  const draw = () => {
    city.setAttribute("viewBox", view.map(v => v.toFixed(1)).join(" "));
    const metres = perPixel() / 10 * 120, power = 10 ** Math.floor(Math.log10(metres));
    const length = [5, 2, 1].find(f => f * power <= metres) * power;
    $("i", bar).style.width = (length * 10 / perPixel()).toFixed(1) + "px";
    $("span", bar).textContent = length >= 1000 ? length / 1000 + " km" : length + " m";
    area.classList.toggle("near", perPixel() < 4);
  };
  const zoom = (factor, at) => {
    const width = Math.min(Math.max(view[2] * factor, 150), whole[2] * 1.5), f = width / view[2];
    at = at || [view[0] + view[2] / 2, view[1] + view[3] / 2];
    view = [at[0] - (at[0] - view[0]) * f, at[1] - (at[1] - view[1]) * f, view[2] * f, view[3] * f];
    draw();
  };
  const place = event => { const p = new DOMPoint(event.clientX, event.clientY).matrixTransform(city.getScreenCTM().inverse()); return [p.x, p.y]; };
  const centre = row => {
    if (!centres.has(row)) { const b = shapeOf.get(row).getBBox(); centres.set(row, [b.x + b.width / 2, b.y + b.height / 2]); }
    return centres.get(row);
  };
  choose = (row, move) => {
    if (chosen !== null && shapeOf.has(chosen)) shapeOf.get(chosen).classList.remove("sel");
    chosen = row; describe(row);
    const shape = shapeOf.get(row);
    if (!shape) return;
    shape.classList.add("sel"); shape.parentNode.append(shape);
    if (!move) return;
    const [x, y] = centre(row), r = city.getBoundingClientRect(), size = Math.min(whole[2], 1500), height = size * r.height / r.width;
    view = [x - size / 2, y - height / 2, size, height]; draw();
  };
  const describe = row => {
    details.textContent = "";
    const verdict = value(row, "verdict"), reasons = new Set([value(row, "verdict_reason"), value(row, "reason")].filter(Boolean));
    details.append(make("h3", value(row, "id")));
    if (verdict) details.append(chip(verdict), " ");
    details.append(chip(value(row, "status")));
    for (const reason of reasons) details.append(make("p", reason));
    const page = data.pages[value(row, "id")];
    if (page) { const link = make("a", "All about it: pictures, planes, candidates"), p = make("p"); link.href = page; p.append(link); details.append(p); }
    const list = make("dl");
    const line = (name, text) => { list.append(make("dt", name), make("dd", text)); };
    if (!dash(value(row, "good_probability"))) line("Probably good", percent(value(row, "good_probability")));
    line("Tile", plain(value(row, "tile"))); line("Level of detail", plain(value(row, "lod"))); line("Method", plain(value(row, "method")));
    line("Roof planes", plain(value(row, "planes") || null)); line("NMAD", cm(value(row, "nmad"))); line("RMSE", cm(value(row, "rmse")));
    line("Bias", cm(value(row, "bias"))); line("LE95", cm(value(row, "le95"))); line("Points on planes", percent(value(row, "share_explained")));
    line("Time", time(value(row, "seconds"))); line("Memory", dash(value(row, "peak_mb")) ? "–" : Math.round(value(row, "peak_mb")) + " MB");
    details.append(list);
    const more = make("dl");
    data.keys.forEach((key, i) => { const v = data.extra[row][i]; if (!dash(v)) more.append(make("dt", key), make("dd", String(v))); });
    if (more.children.length) { const box = make("details"); box.append(make("summary", "Attributes"), more); details.append(box); }
    const own = data.overrides[value(row, "id")];
    if (own) details.append(make("p", "Parameters of its own: " + JSON.stringify(own)));
  };
  const hover = event => {
    const shape = event.target.closest(".u");
    tip.hidden = !shape;
    if (!shape) return;
    const row = Number(shape.dataset.row), box = $(".mapbox").getBoundingClientRect();
    tip.textContent = "";
    tip.append(make("b", value(row, "id")), make("br"), value(row, "status") === "refused" ? "Refused · " + plain(value(row, "reason")) : (verdictNames[value(row, "verdict")] || statusNames[value(row, "status")]) + " · NMAD " + cm(value(row, "nmad")) + " · " + plain(value(row, "planes") || null) + " planes · " + time(value(row, "seconds")));
    const x = event.clientX - box.left, y = event.clientY - box.top;
    tip.style.left = Math.max(0, Math.min(x + 14, box.width - tip.offsetWidth - 6)) + "px"; tip.style.top = (y + 24 + tip.offsetHeight > box.height ? y - tip.offsetHeight - 8 : y + 18) + "px";
  };
  const pointers = new Map();
  let moved = 0;
  city.addEventListener("pointerdown", event => { pointers.set(event.pointerId, [event.clientX, event.clientY]); moved = 0; });
  city.addEventListener("pointermove", event => {
    if (!pointers.has(event.pointerId)) return hover(event);
    const before = pointers.get(event.pointerId), now = [event.clientX, event.clientY], scale = perPixel();
    const other = [...pointers].find(([id]) => id !== event.pointerId);
    moved += Math.abs(now[0] - before[0]) + Math.abs(now[1] - before[1]);
    if (moved > 4 && !city.hasPointerCapture(event.pointerId)) city.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, now); tip.hidden = true;
    if (other) {
      const gap = p => Math.hypot(p[0] - other[1][0], p[1] - other[1][1]);
      zoom(gap(before) / Math.max(gap(now), 1), place(event));
    } else { view[0] -= (now[0] - before[0]) * scale; view[1] -= (now[1] - before[1]) * scale; draw(); }
  });
  const release = event => pointers.delete(event.pointerId);
  city.addEventListener("pointerup", release); city.addEventListener("pointercancel", release);
  city.addEventListener("pointerleave", () => { tip.hidden = true; });
  city.addEventListener("click", event => { const shape = event.target.closest(".u"); if (shape && moved < 5) choose(Number(shape.dataset.row)); });
  city.addEventListener("wheel", event => { event.preventDefault(); zoom(1.0015 ** event.deltaY, place(event)); }, {passive: false});
  city.tabIndex = 0;
  const directions = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
  city.addEventListener("keydown", event => {
    const d = directions[event.key];
    if (event.key === "+" || event.key === "=") zoom(0.6); else if (event.key === "-") zoom(1.6667); else if (!d) return;
    event.preventDefault();
    if (!d) return;
    const from = chosen !== null && shapeOf.has(chosen) ? centre(chosen) : [view[0] + view[2] / 2, view[1] + view[3] / 2];
    let best = null, least = Infinity;
    for (const row of shapeOf.keys()) {
      if (row === chosen) continue;
      const c = centre(row), ahead = (c[0] - from[0]) * d[0] + (c[1] - from[1]) * d[1], aside = Math.abs((c[0] - from[0]) * d[1] - (c[1] - from[1]) * d[0]);
      const cost = ahead > 0 ? ahead + 2 * aside : Infinity;
      if (cost < least) { least = cost; best = row; }
    }
    if (best === null) return;
    choose(best);
    const c = centre(best);
    if (c[0] < view[0] || c[1] < view[1] || c[0] > view[0] + view[2] || c[1] > view[1] + view[3]) { view[0] = c[0] - view[2] / 2; view[1] = c[1] - view[3] / 2; draw(); }
  });
  for (const radio of all("input[name=mode]")) { radio.addEventListener("change", () => { area.dataset.mode = radio.value; }); if (radio.checked) area.dataset.mode = radio.value; }
  for (const button of all(".mapbuttons button")) button.addEventListener("click", () => { const f = Number(button.dataset.zoom); if (f) zoom(f); else { view = [...whole]; draw(); } });
  const find = $("#find"), finder = $("#finder"), ids = $("#ids");
  find.hidden = false;
  finder.addEventListener("input", () => {
    const text = finder.value.trim().toLowerCase();
    ids.textContent = "";
    if (!text) return;
    let shown = 0, exact = -1;
    for (let row = 0; row < data.rows.length && shown < 20; row++) {
      const id = value(row, "id");
      if (id.toLowerCase() === text) exact = row;
      if (id.toLowerCase().includes(text)) { const o = make("option"); o.value = id; ids.append(o); shown++; }
    }
    if (exact >= 0) choose(exact, true);
  });
  find.addEventListener("submit", event => {
    event.preventDefault();
    const text = finder.value.trim().toLowerCase(), row = data.rows.findIndex(r => r[column.id].toLowerCase().includes(text));
    if (text && row >= 0) choose(row, true);
  });
  $(".mapbuttons").hidden = bar.hidden = false;
  addEventListener("resize", draw);
  addEventListener("beforeprint", () => { city.setAttribute("viewBox", whole.join(" ")); }); addEventListener("afterprint", draw);
  draw();
}
let opened = [];
addEventListener("beforeprint", () => { opened = all("#method details:not([open])"); opened.forEach(d => { d.open = true; }); });
addEventListener("afterprint", () => { opened.forEach(d => { d.open = false; }); });
document.addEventListener("click", event => {
  const button = event.target.closest(".show");
  if (!button || !city) return;
  choose(Number(button.dataset.row), true);
  $("#map").scrollIntoView(); city.focus({preventScroll: true});
});

// Table of all units
const columns = [["id", "Building", plain], ["verdict", "Verdict", null], ["status", "Status", null], ["tile", "Tile", plain], ["lod", "LoD", plain], ["method", "Method", plain], ["planes", "Planes", v => plain(v || null), 1], ["nmad", "NMAD", cm, 1], ["rmse", "RMSE", cm, 1], ["share_explained", "On planes", percent, 1], ["seconds", "Time", time, 1]];
const head = $("#all thead tr"), body = $("#all tbody"), perPage = 50;
let sort = "id", down = false, page = 0, rows = [];
const render = () => {
  const status = $("#by-status").value, verdict = $("#by-verdict").value, text = $("#by-text").value.trim().toLowerCase();
  rows = [...data.rows.keys()].filter(r => (!status || value(r, "status") === status) && (!verdict || value(r, "verdict") === verdict) && (!text || (value(r, "id") + " " + value(r, "reason") + " " + value(r, "verdict_reason")).toLowerCase().includes(text)));
  rows.sort((a, b) => {
    const x = value(a, sort), y = value(b, sort);
    if (dash(x) || dash(y)) return dash(x) - dash(y) || a - b;
    return (x < y ? -1 : x > y ? 1 : 0) * (down ? -1 : 1) || a - b;
  });
  const pages = Math.max(Math.ceil(rows.length / perPage), 1);
  page = Math.min(page, pages - 1);
  body.textContent = "";
  for (const r of rows.slice(page * perPage, (page + 1) * perPage)) {
    const tr = make("tr");
    for (const [name, , format, numeric] of columns) {
      const td = make(name === "id" ? "th" : "td", undefined, numeric ? "n" : undefined);
      if (name === "id") { td.scope = "row"; td.className = "id"; const b = make("button", value(r, "id"), "link show"); b.type = "button"; b.dataset.row = r; td.append(b); }
      else if (name === "status" || name === "verdict") td.append(value(r, name) ? chip(value(r, name)) : "–");
      else td.textContent = format(value(r, name));
      tr.append(td);
    }
    body.append(tr);
    const why = [value(r, "reason"), value(r, "verdict_reason")].filter(Boolean).join("; ");
    if (why) { const below = make("tr", undefined, "why"), td = make("td", why); td.colSpan = columns.length; below.append(td); body.append(below); }
  }
  $("#count").textContent = rows.length.toLocaleString("en") + (rows.length === 1 ? " building" : " buildings");
  $("#page").textContent = "Page " + (page + 1) + " of " + pages;
  $("#before").disabled = page === 0; $("#after").disabled = page >= pages - 1;
};
for (const [name, title, , numeric] of columns) {
  const th = make("th", undefined, numeric ? "n" : undefined), button = make("button", title);
  th.scope = "col"; button.type = "button";
  button.addEventListener("click", () => {
    down = sort === name ? !down : Boolean(numeric); sort = name; page = 0;
    for (const b of all("button", head)) { b.removeAttribute("aria-sort"); b.parentNode.removeAttribute("aria-sort"); }
    button.setAttribute("aria-sort", down ? "descending" : "ascending"); th.setAttribute("aria-sort", down ? "descending" : "ascending");
    render();
  });
  th.append(button); head.append(th);
}
$("#before").addEventListener("click", () => { page--; render(); }); $("#after").addEventListener("click", () => { page++; render(); });
for (const name of ["#by-status", "#by-verdict"]) $(name).addEventListener("change", () => { page = 0; render(); }); $("#by-text").addEventListener("input", () => { page = 0; render(); });
$(".filters").addEventListener("submit", event => event.preventDefault());
$("#table").hidden = data.rows.length === 0;
render();
})();
