// The page comes together: what was written for it is read, and its controls are wired.
import { Vector3 } from 'three';
import { markMiddle } from './aim.js';
import { showBearings } from './bearings.js';
import { City } from './city.js';
import { wireControls } from './controls.js';
import { evidenceOf, pickCut } from './cuts.js';
import { json } from './data.js';
import { openDesk, watchOnly, wireDesk } from './desk/desk.js';
import { byId, element, say } from './elements.js';
import { keepClear } from './free.js';
import { drawLayerLegend, drawLegend } from './legend.js';
import { Layers } from './layers.js';
import { Link } from './link.js';
import { Panel } from './panel.js';
import { fillSearch } from './search.js';
import { Stage } from './stage.js';
import { Tools } from './tools.js';
import { Units } from './units.js';

const CLICK_PIXELS = 5;
const OVERLAYS = ['points', 'dsm', 'cuts', 'failures'];
const NEARER = { '+': 0.8, '=': 0.8, '-': 1.25 };

performance.mark('program');
window.cityflowView = {
  isReady: false, errors: [],
  /** Whether anything is still being fetched, moves, or has yet to be drawn. */
  get isBusy() {
    return this.city?.isLoading || this.compare?.isLoading || this.layers?.loading > 0 || this.index?.reading > 0 || this.stage?.isGliding || this.stage?.isWaiting || !this.stage?.frames;
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
  const reading = Promise.all([json('data/city.json'), json('data/index.json').then((root) => new Units(root)), servedRun()]);
  const stage = stageOrNull();
  if (!stage) {
    await reading.catch(() => null);
    return giveUp('This browser has no WebGL, which drawing a city needs; here are the pictures of the report instead.');
  }
  const [about, index, served] = await reading;
  const desk = served.desk ? openDesk() : null;
  if (desk) stage.resize(); // the column is beside it from now on
  if (!about.sets.rectified && !about.sets.raw) {
    if (desk) return watchOnly(desk);
    return giveUp('This run has no 3D Tiles: either nothing has been exported yet, or it was made by an earlier version. Run the workflow again, and then `cityflow view RUN`.');
  }
  head(about, served);
  const city = new City(about, index, stage);
  stage.beforeFrame.push(() => city.update());
  const layers = new Layers(about, index, stage);
  const link = new Link();
  const tools = new Tools(city, layers, stage, about);
  const page = { about, index, stage, city, layers, link, tools };
  page.panel = new Panel(index, { run: served.run, onclose: () => choose(page, null), onfocus: (unit) => approach(page, unit) });
  // before moving writes itself into the link, which may lead elsewhere
  page.clear = keepClear(stage);
  stage.show(about.bounds, index.ends);
  Object.assign(window.cityflowView, page, { choose: (id) => choose(page, id) });
  wireLayers(page);
  wireCanvas(page);
  markMiddle(stage, tools);
  showBearings(stage);
  wireControls(page, { choose: (id) => choose(page, id) });
  fillSearch(index, (id) => go(page, id));
  city.onfailure = (url) => say(`A part of the city could not be loaded: ${url}`);
  await restore(page);
  new ResizeObserver(() => city.resize()).observe(byId('canvas').parentElement);
  notes(about);
  if (!byId('status').textContent) say('');
  page.go = (id) => go(page, id);
  if (desk) Object.assign(window.cityflowView, await wireDesk(desk, page));
  window.cityflowView.isReady = true;
  stage.changed();
  return undefined;
}

/** Without a picture of its own the page says why, and shows those of the report. */
function giveUp(why) {
  byId('app').hidden = true;
  byId('fallback').hidden = false;
  byId('why').replaceChildren(...why.split('`').map((text, k) => (k % 2 ? element('code', {}, text) : text)));
}

function stageOrNull() {
  byId('app').hidden = false;
  try {
    return new Stage(byId('canvas'));
  } catch {
    return null;
  }
}

/** How the run is named on the command line of whoever serves the page, RUN where nobody says; and where other cities are. */
async function servedRun() {
  const served = await json('served.json').catch(() => null);
  return { run: served?.run ?? 'RUN', cities: served?.cities ?? null, desk: served?.desk ?? false };
}

function head(about, { cities }) {
  document.title = `${about.title} – city view`;
  byId('title').textContent = about.title;
  byId('subtitle').textContent = about.verdict;
  byId('cities').hidden = !cities;
  if (cities) byId('cities').href = cities;
}

function wireLayers(page) {
  const { about, city, link } = page;
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
  drawLayerLegend(name, isShown, page);
  await page.layers.show(name, isShown);
  say(isShown ? page.about.layer_notes[name] ?? '' : '');
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
  stage.canvas.addEventListener('keydown', (event) => keyed(page, event));
}

/** Enter does what a click in the middle does; plus and minus come nearer to what stands there, and go back from it. */
function keyed(page, { key, shiftKey, ctrlKey, metaKey, repeat }) {
  const { stage, city, tools } = page;
  if (key === 'Enter' && !repeat) {
    if (tools.active && shiftKey) tools.finish();
    else clicked(page, stage.middle);
  } else if (key in NEARER && !ctrlKey && !metaKey) {
    stage.nearer(NEARER[key], city.pick(stage.ndc(stage.middle))?.place);
  }
}

/** A tool takes the click, else a failed outline or cut line that is drawn there, else the building. */
function clicked(page, event) {
  const { stage, city, tools, layers, drawing } = page;
  if (page.taking) return page.taking(event);
  const ndc = stage.ndc(event);
  const hit = city.pick(ndc);
  if (drawing?.isActive) return drawing.click(hit);
  if (tools.active) return tools.click(hit);
  const cut = pickCut(page, event);
  if (cut) return tools.tell(...evidenceOf(cut));
  city.raycaster.setFromCamera(ndc, stage.camera);
  const [failure] = city.raycaster.intersectObjects(layers.objects('failures').filter((o) => o.userData.unit), false);
  return choose(page, failure ? failure.object.userData.unit : (hit?.unit ?? null), hit?.surface);
}

function choose(page, id, surface = null) {
  page.city.select(id);
  page.link.set('unit', id);
  const opened = id === null ? page.panel.close() : page.panel.open(id, surface);
  if (id === null && window.cityflowView.isReady) say('');
  page.clear(!window.cityflowView.isReady);
  if (id !== null && window.cityflowView.isReady) uncover(page, id);
  return opened;
}

async function go(page, id) {
  choose(page, id);
  const unit = await page.index.find(id);
  if (unit) approach(page, unit);
}

async function uncover({ index, city, stage }, id) {
  const unit = await index.find(id);
  if (unit && city.selected === id) stage.uncover(new Vector3(...unit.place));
}

function approach({ stage }, unit) {
  stage.approach(new Vector3(...unit.place), Math.max(30, 2.5 * unit.size));
}

async function restore(page) {
  const { link, stage, city, about } = page;
  if (link.camera) stage.look(link.camera.slice(0, 3), link.camera.slice(3));
  colourBy(page, ['classes', 'nmad', 'rmse', 'status', 'verdict'].includes(link.get('colour')) ? link.get('colour') : 'photographs');
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
    const known = link.camera ? null : await page.index.find(unit);
    if (known) approach(page, known);
  }
}

function notes(about) {
  if (!about.notes.length) return;
  const box = byId('notes');
  box.hidden = false;
  box.append(element('summary', {}, `${about.notes.length} ${about.notes.length === 1 ? 'thing is' : 'things are'} missing`), element('ul', {}, about.notes.map((note) => element('li', {}, note))));
}
