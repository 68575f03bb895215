// The page comes together: what was written for it is read, and its controls are wired.
import { City } from './city.js';
import { json, readUnits } from './data.js';
import { byId, element, say } from './elements.js';
import { Layers } from './layers.js';
import { drawLegend, drawPointLegend } from './legend.js';
import { Link } from './link.js';
import { Panel } from './panel.js';
import { fillSearch } from './search.js';
import { Stage } from './stage.js';
import { Tools } from './tools.js';
import { Vector3 } from 'three';

const CLICK_PIXELS = 5;
const OVERLAYS = ['points', 'dsm', 'cuts', 'failures'];

window.cityflowView = {
  isReady: false, errors: [],
  /** Whether anything is still being fetched or has yet to be drawn. */
  get isBusy() {
    return this.city?.isLoading || this.layers?.loading > 0 || this.stage?.isWaiting || this.stage?.frames < 2;
  },
};
window.addEventListener('error', (event) => window.cityflowView.errors.push(String(event.message)));
window.addEventListener('unhandledrejection', (event) => {
  window.cityflowView.errors.push(String(event.reason));
  say(`Something could not be loaded: ${event.reason?.message ?? event.reason}`);
});

start().catch((error) => {
  window.cityflowView.errors.push(String(error));
  giveUp(`The page could not start: ${error.message}`);
});

async function start() {
  if (location.protocol === 'file:') return giveUp('Browsers do not let a page read files beside it: run `cityflow view RUN` to walk through the city.');
  if (!hasWebGl()) return giveUp('This browser has no WebGL, which drawing a city needs; here are the pictures of the report instead.');
  const [about, index, served] = await Promise.all([json('data/city.json'), readUnits(), servedRun()]);
  if (!about.sets.rectified && !about.sets.raw) {
    return giveUp('This run has no 3D Tiles: either nothing has been exported yet, or it was made by an earlier version. Run the workflow again, and then `cityflow view RUN`.');
  }
  document.title = `${about.title} – city view`;
  byId('title').textContent = about.title;
  byId('subtitle').textContent = about.verdict;
  byId('app').hidden = false;
  const stage = new Stage(byId('canvas'), about.bounds);
  const city = new City(about, index.byId, stage);
  stage.beforeFrame.push(() => city.update());
  const layers = new Layers(about, stage);
  const link = new Link();
  const tools = new Tools(city, layers, stage, about);
  const page = { about, index, stage, city, layers, link, tools };
  page.panel = new Panel(index.byId, { run: served, onclose: () => choose(page, null), onfocus: (unit) => approach(page, unit) });
  Object.assign(window.cityflowView, page, { choose: (id) => choose(page, id) });
  wireLayers(page);
  wireCanvas(page);
  wireControls(page);
  fillSearch(index.units, (unit) => {
    choose(page, unit.id);
    approach(page, unit);
  });
  city.onfailure = (url) => say(`A part of the city could not be loaded: ${url}`);
  await restore(page);
  new ResizeObserver(() => city.resize()).observe(byId('canvas').parentElement);
  notes(about);
  if (!byId('status').textContent) say('Drag to move, right button to turn, wheel to come closer. Click a building to learn about it.');
  window.cityflowView.isReady = true;
  stage.changed();
  return undefined;
}

/** Without a picture of its own the page says why, and shows those of the report. */
function giveUp(why) {
  byId('app').hidden = true;
  byId('fallback').hidden = false;
  byId('why').textContent = why;
}

function hasWebGl() {
  try {
    return Boolean(document.createElement('canvas').getContext('webgl2'));
  } catch {
    return false;
  }
}

/** How the run is named on the command line of whoever serves the page; RUN where nobody says. */
async function servedRun() {
  const said = await json('served.json').catch(() => null);
  return said?.run ?? 'RUN';
}

function wireLayers(page) {
  const { about, city, layers, link } = page;
  for (const radio of document.querySelectorAll('input[name="colour"]')) {
    radio.addEventListener('change', () => colourBy(page, radio.value));
  }
  for (const name of ['terrain', 'buildings']) {
    byId(`layer-${name}`).addEventListener('change', (event) => {
      city.show(name, event.target.checked);
      link.set(name, event.target.checked ? null : 'off');
    });
  }
  for (const name of OVERLAYS) {
    const box = byId(`layer-${name}`);
    const has = about.layers[name];
    box.disabled = !has;
    box.closest('label').title = has ? box.closest('label').title : about.missing[name];
    box.addEventListener('change', () => overlay(page, name, box.checked));
  }
  if (!hasPhotographs(about)) {
    byId('colour-photographs').textContent = 'Plain';
    byId('colour-photographs').closest('label').title = 'This run has no textures';
  }
  const sets = byId('textures');
  for (const option of sets.options) option.disabled = option.value === 'rectified' ? !about.sets.rectified : !about.sets.raw;
  sets.addEventListener('change', () => textures(page, sets.value));
}

const hasPhotographs = (about) => Object.values(about.texture_pixels).some(Boolean);

function colourBy(page, mode) {
  page.city.colourBy(mode);
  document.querySelector(`input[name="colour"][value="${mode}"]`).checked = true;
  page.link.set('colour', mode === 'photographs' ? null : mode);
  byId('textures').closest('label').hidden = mode !== 'photographs' || !hasPhotographs(page.about);
  drawLegend(byId('legend'), mode, page);
}

async function overlay(page, name, isShown) {
  byId(`layer-${name}`).checked = isShown;
  page.link.set(name, isShown ? 'on' : null);
  say(isShown ? 'Loading …' : '');
  if (name === 'points') drawPointLegend(byId('points-legend'), isShown, page);
  await page.layers.show(name, isShown);
  say(isShown ? page.about.said[name] ?? '' : '');
}

function textures(page, choice) {
  page.city.textures(choice === 'rectified' ? 'rectified' : 'raw', choice !== 'bent');
  byId('textures').value = choice;
  page.link.set('textures', choice === 'rectified' ? null : choice);
}

function wireCanvas(page) {
  const { stage, city, tools } = page;
  let down = null;
  stage.canvas.addEventListener('pointerdown', (event) => (down = [event.clientX, event.clientY]));
  stage.canvas.addEventListener('pointerup', (event) => {
    if (!down || event.button !== 0 || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > CLICK_PIXELS) return;
    clicked(page, event);
  });
  stage.canvas.addEventListener('dblclick', (event) => {
    if (tools.active) return tools.finish();
    const hit = city.pick(stage.ndc(event));
    if (hit) stage.approach(hit.place, Math.max(25, 0.4 * stage.camera.position.distanceTo(hit.place)));
    return undefined;
  });
  stage.canvas.addEventListener('keydown', (event) => {
    if (event.key === 'Enter' && tools.active) tools.finish();
    else if (event.key === 'Enter') chooseMiddle(page);
  });
}

/** A tool takes the click, else a failed outline or cut line that is drawn there, else the building. */
function clicked(page, event) {
  const { stage, city, tools, layers } = page;
  const ndc = stage.ndc(event);
  const hit = city.pick(ndc);
  if (tools.active) return tools.click(hit);
  const cut = pickCut(page, event);
  if (cut) return say(cutText(cut));
  city.raycaster.setFromCamera(ndc, stage.camera);
  const [failure] = city.raycaster.intersectObjects(layers.objects('failures').filter((o) => o.userData.unit), false);
  return choose(page, failure ? failure.object.userData.unit : (hit?.unit ?? null), hit?.surface);
}

function chooseMiddle(page) {
  const hit = page.city.pick(page.stage.middle);
  choose(page, hit?.unit ?? null, hit?.surface);
}

/** The cut line that is drawn within some pixels of the pointer. */
function pickCut({ layers, stage }, { clientX, clientY }) {
  let best = 7;
  let found = null;
  for (const { userData } of layers.objects('cuts')) {
    for (const cut of userData.cuts ?? []) {
      const [a, b] = [cut.from, cut.to].map((p) => stage.onPage(new Vector3(...p)));
      if (!a || !b) continue;
      const away = distanceToSegment([clientX, clientY], a, b);
      if (away < best) [best, found] = [away, cut];
    }
  }
  return found;
}

function distanceToSegment(p, a, b) {
  const way = [b[0] - a[0], b[1] - a[1]];
  const t = Math.min(Math.max(((p[0] - a[0]) * way[0] + (p[1] - a[1]) * way[1]) / (way[0] ** 2 + way[1] ** 2 || 1), 0), 1);
  return Math.hypot(p[0] - a[0] - t * way[0], p[1] - a[1] - t * way[1]);
}

function cutText(cut) {
  const said = cut.accepted ? 'Cut line' : 'Candidate of a cut line, not taken';
  return `${said} (${cut.kind}) in ${cut.outline}: confidence ${cut.confidence.toFixed(2)}; upright edges along ${(100 * cut.vertical).toFixed(0)} % of the façade's height, `
    + `edges on the roof along ${(100 * cut.sloped).toFixed(0)} % of the line, roofs differ by ${cut.height_step_m.toFixed(2)} m${cut.gap_m ? `, gap of ${cut.gap_m.toFixed(2)} m` : ''}.`;
}

function choose(page, id, surface = null) {
  page.city.select(id);
  page.link.set('unit', id);
  if (id === null) {
    page.panel.close();
    return undefined;
  }
  return page.panel.open(id, surface);
}

function approach({ stage }, unit) {
  stage.approach(new Vector3(...unit.place), Math.max(30, 2.5 * unit.size));
}

function wireControls(page) {
  const { stage, tools } = page;
  const fly = byId('fly');
  const setFlying = (isFlying) => {
    stage.fly(isFlying);
    fly.setAttribute('aria-pressed', String(isFlying));
    byId('fly-hint').hidden = !isFlying;
    stage.canvas.focus();
  };
  fly.addEventListener('click', () => setFlying(!stage.isFlying));
  byId('home').addEventListener('click', () => {
    setFlying(false);
    stage.overview();
  });
  byId('share').addEventListener('click', () => share(page.link));
  for (const name of ['distance', 'area', 'section', 'residuals']) byId(`tool-${name}`).addEventListener('click', () => tools.start(name));
  const help = byId('help');
  byId('help-open').addEventListener('click', () => help.showModal());
  byId('help-close').addEventListener('click', () => help.close());
  stage.afterMove.push(() => page.link.set('camera', stage.place.join(',')));
  window.addEventListener('keydown', (event) => {
    const isTyping = event.target.matches?.('input, select, textarea');
    if (event.key === 'Escape') escape(page, setFlying);
    else if (isTyping || event.ctrlKey || event.metaKey || event.altKey) return;
    else if (event.key === 'f') setFlying(!stage.isFlying);
    else if (event.key === 'h') stage.overview();
    else if (event.key === '?') help.showModal();
    else if (event.key === '/') {
      event.preventDefault();
      byId('search').focus();
    }
  });
}

/** Esc leaves one thing at a time: the tool in hand, flying, then the panel. */
function escape(page, setFlying) {
  if (byId('help').open) return;
  if (page.tools.active) page.tools.stop();
  else if (page.stage.isFlying) setFlying(false);
  else choose(page, null);
}

async function share(link) {
  try {
    await navigator.clipboard.writeText(link.address);
    say('The link to this view is copied.');
  } catch {
    say(`The address of the page leads back to this view: ${link.address}`);
  }
}

async function restore(page) {
  const { link, stage, city, about } = page;
  if (link.camera) stage.look(link.camera.slice(0, 3), link.camera.slice(3));
  colourBy(page, ['classes', 'nmad', 'rmse', 'status'].includes(link.get('colour')) ? link.get('colour') : 'photographs');
  for (const name of ['terrain', 'buildings']) {
    if (link.get(name) !== 'off') continue;
    byId(`layer-${name}`).checked = false;
    city.show(name, false);
  }
  for (const name of OVERLAYS) if (link.get(name) === 'on' && about.layers[name]) await overlay(page, name, true);
  if (!link.parts.has('failures') && about.layers.failures) await overlay(page, 'failures', true);
  const choice = link.get('textures') ?? (about.sets.rectified ? 'rectified' : 'divided');
  if (choice !== 'rectified' && about.sets.raw) textures(page, choice);
  const unit = link.get('unit');
  if (unit) {
    choose(page, unit);
    if (!link.camera && page.index.byId.has(unit)) approach(page, page.index.byId.get(unit));
  }
}

function notes(about) {
  if (!about.notes.length) return;
  const box = byId('notes');
  box.hidden = false;
  box.append(element('summary', {}, `${about.notes.length} ${about.notes.length === 1 ? 'thing is' : 'things are'} missing`), element('ul', {}, about.notes.map((note) => element('li', {}, note))));
}
