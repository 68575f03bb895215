// The desk comes together beside the view: review list, corrections, reruns and what a driver does.
import { forget, json } from '../data.js';
import { byId, element, say } from '../elements.js';
import { Before } from './before.js';
import { Compare } from './compare.js';
import { Corrections } from './correct.js';
import { Drawing } from './draw.js';
import { Interface } from './interface.js';
import { Photograph } from './photograph.js';
import { Reruns } from './reruns.js';
import { Review } from './review.js';
import { Watch } from './watch.js';

const TABS = [['review', 'Review'], ['reruns', 'Edits'], ['compare', 'Compare'], ['watch', 'Watch']];

/** The column of the desk, and what it can show without a city: what a driver does. */
export function openDesk() {
  const desk = new Interface(new URLSearchParams(location.search).get('token') ?? '');
  const tabs = TABS.map(([name, title]) => element('button', { type: 'button', role: 'tab', id: `desk-tab-${name}`, 'aria-controls': `desk-${name}`, onclick: () => show(name) }, title));
  const parts = TABS.map(([name]) => element('section', { id: `desk-${name}`, role: 'tabpanel', 'aria-labelledby': `desk-tab-${name}`, hidden: true }));
  document.body.classList.add('has-desk');
  document.querySelector('main').before(element('aside', { id: 'desk', 'aria-label': 'Desk' }, element('div', { class: 'row', role: 'tablist' }, tabs), parts));
  desk.watch = new Watch(desk, byId('desk-watch'));
  show('watch');
  return desk;
}

function show(name) {
  for (const [other] of TABS) {
    byId(`desk-${other}`).hidden = other !== name;
    byId(`desk-tab-${other}`).setAttribute('aria-selected', String(other === name));
  }
}

/** All of it, over a page that shows a city; returns that with its parts of the desk. */
export async function wireDesk(desk, page) {
  let renewal = Promise.resolve();
  Object.assign(page, { desk, before: new Before(page), drawing: new Drawing(page) });
  desk.review = new Review(page, byId('desk-review'));
  desk.reruns = new Reruns(page, byId('desk-reruns'));
  desk.corrections = new Corrections(page);
  page.photograph = new Photograph(page);
  page.compare = new Compare(page, byId('desk-compare'));
  page.panel.wired.onopened = (id, unit, known, body) => {
    if (page.photograph.unit !== id) page.photograph.leave();
    desk.corrections.open(id, unit, known, body);
    page.compare.offer(id, known);
  };
  desk.listen({
    // a rerun is done for people when the list and the scene have what it made
    job: (job) => (['done', 'failed'].includes(job.stand) ? renewal.then(() => desk.reruns.told(job)) : desk.reruns.told(job)), state: () => attempt(() => desk.refresh()), watch: (news) => desk.watch.told(news),
    models: (news) => arrived(page, news),
    changed: () => (renewal = renewal.then(() => attempt(() => renew(page)))), trouble: ({ text }) => say(text),
  });
  await Promise.all([desk.refresh(), desk.review.read(), desk.watch.read(), page.compare.read()]);
  if (!desk.token) say('This address has no token: you can look at everything, and change nothing.');
  show('review');
  return page;
}

/** Only what a driver does, where there is no city yet; the page is opened anew when there is one. */
export async function watchOnly(desk) {
  byId('app').hidden = false;
  byId('app').classList.add('bare');
  desk.listen({ watch: (news) => desk.watch.told(news), changed: () => location.reload() });
  await desk.watch.read();
}

/** Do something, and tell what went wrong. */
export async function attempt(action) {
  try {
    return await action();
  } catch (error) {
    say(error.message);
    return null;
  }
}

/** What a task of a rerun has made stands in the scene before its texture and the files of its tile are there. */
function arrived({ city, before }, { models, without }) {
  city.add(models, without);
  before.allow();
  const names = models.map(({ id }) => id);
  say(names.length ? `${names.join(', ')} has a new model; its texture follows.` : `${without.join(', ')}: its model is gone.`);
}

/** The run has other models now: tables, tiles and layers are read again, and the camera stays where it is. */
export async function renew(page) {
  const { index, city, layers, panel, desk } = page;
  forget();
  const [about, root] = await Promise.all([json('data/city.json'), json('data/index.json')]);
  // a driver that has ended is told of more than once
  if (about.state === page.about.state) {
    if (!desk.reruns.isAtWork) city.dropRenewed();
    page.before.allow();
    return desk.refresh();
  }
  page.photograph.leave();
  page.compare.leave();
  Object.assign(page.about, about);
  index.renew(root);
  const shown = layers.renew();
  await Promise.all([page.before.renew(), desk.review.read(), desk.refresh(), page.compare.read(), ...shown]);
  const id = city.selected;
  if (id !== null) {
    if (await index.find(id)) await panel.open(id);
    else panel.wired.onclose();
  }
  byId('subtitle').textContent = about.verdict;
  return say('The new models are shown; v shows those of before beside them.');
}
