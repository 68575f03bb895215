// Edits that were drawn, and reruns that carry them out: the queue, what each prints, and how it ended.
import { words } from '../attributes.js';
import { element, say } from '../elements.js';
import { isTyping } from './before.js';
import { attempt } from './desk.js';

export const LAYERS = {
  outlines: 'Outline', locked: 'Outline, never split', cut_lines: 'Border', no_cut_lines: 'No border', roof_types: 'Roof type', rejected: 'Not a building',
};

const BEST = '*';
const NO_TOKEN = 'This address has no token, and can change nothing';

export class Reruns {
  constructor(page, root) {
    Object.assign(this, { page, jobs: new Map() });
    this.wait = element('p', { id: 'desk-pending' });
    this.all = element('button', { type: 'button', id: 'desk-rerun', disabled: true, onclick: () => this.ask([]) }, 'Rerun');
    this.these = element('button', { type: 'button', id: 'desk-rerun-list', disabled: true, onclick: () => this.#askList() }, 'Rerun the list');
    this.how = element('select', { 'aria-label': 'How the list is made again', id: 'desk-rerun-how' });
    this.edits = element('ol', { id: 'desk-edits', 'aria-label': 'Edits' });
    this.queue = element('ol', { id: 'desk-jobs', 'aria-label': 'Reruns' });
    root.append(this.wait, element('div', { class: 'row' }, this.all), element('div', { class: 'row' }, this.these, this.how), element('h3', {}, 'Reruns'), this.queue, element('h3', {}, 'Edits'), this.edits);
    page.desk.onstate.push((state) => this.#draw(state));
    window.addEventListener('keydown', (event) => {
      if (event.key !== 'r' || isTyping(event) || event.ctrlKey || event.metaKey || event.altKey || page.stage.isFlying) return;
      this.ask(page.desk.state.pending || !page.city.selected ? [] : [page.city.selected]);
    });
  }

  /** Make buildings again, and carry out all edits that wait; `more`: one method alone, or `clear`. */
  async ask(units, more = {}) {
    const job = await attempt(() => this.page.desk.post('rerun', { units, ...more }));
    if (!job) return null;
    say(`Running again: ${job.what}.`);
    await attempt(() => this.page.desk.refresh());
    return job;
  }

  async undo(edit) {
    const done = await attempt(() => this.page.desk.post('undo', { edit }));
    if (!done) return;
    await attempt(() => this.page.desk.refresh());
    say(this.page.desk.state.pending ? 'The edit is taken back; a rerun makes the model that was.' : 'The edit is taken back.');
  }

  get isAtWork() {
    return [...this.jobs.values()].some(({ stand }) => stand === 'at work');
  }

  /** News of a job. */
  told(job) {
    this.jobs.set(job.number, job);
    this.#drawJobs();
    if (job.stand === 'failed') say(`The rerun failed: ${job.lines.at(-1) ?? ''}`);
  }

  #askList() {
    const how = this.how.value;
    return this.ask(this.#listed(), how === BEST ? { clear: true } : how ? { method: how } : {});
  }

  /** Buildings of the list that a rerun can make. */
  #listed() {
    return this.page.desk.review.shown.filter(({ status }) => status !== 'refused').map(({ id }) => id);
  }

  /** What cannot be asked for now cannot be pressed, and says why. */
  allow() {
    const { pending, refused } = this.page.desk.state;
    const never = this.page.desk.token ? refused : NO_TOKEN;
    const listed = this.#listed().length;
    allowed(this.all, never || (pending ? '' : 'No edit waits for a rerun'), 'Carry out all edits that wait (key: r)');
    allowed(this.these, never || (listed ? '' : 'No building is in the list'), `Make the ${listed.toLocaleString('en')} buildings of the list again`);
  }

  #draw(state) {
    for (const job of state.jobs) this.jobs.set(job.number, job);
    this.wait.textContent = state.refused || (state.pending ? `${state.pending} ${state.pending === 1 ? 'change waits' : 'changes wait'} for a rerun.` : 'No change waits for a rerun.');
    this.allow();
    if (!this.how.options.length) this.how.replaceChildren(...[['', 'as it is set'], ...state.methods.map((method) => [method, `by ${words(method)} alone`]), [BEST, 'by the best of all again']].map(([value, title]) => element('option', { value }, title)));
    this.edits.replaceChildren(...[...state.edits].reverse().map((edit) => this.item(edit)));
    this.#drawJobs();
  }

  /** A row for an edit, with its undo where it was made at a desk. */
  item(edit) {
    const title = LAYERS[edit.layer] + (edit.value && edit.layer === 'roof_types' ? `: ${edit.value}` : edit.value ? ` of ${edit.value}` : '');
    const when = edit.when ? new Date(1000 * edit.when).toLocaleString() : '';
    return element(
      'li', { 'data-edit': edit.edit },
      element('span', {}, element('b', {}, title), edit.is_pending ? ' · waits for a rerun' : ''),
      element('span', { class: 'muted' }, [edit.who || 'drawn elsewhere', when].filter(Boolean).join(', ')),
      edit.edit ? element('button', { type: 'button', class: 'undo', onclick: () => this.undo(edit.edit) }, 'Undo') : null,
    );
  }

  #drawJobs() {
    const jobs = [...this.jobs.values()].sort((a, b) => b.number - a.number);
    this.queue.replaceChildren(...jobs.map((job) => element(
      'li', { 'data-stand': job.stand },
      element('span', {}, element('b', {}, `${job.number}: ${job.what}`)),
      element('span', { class: 'muted' }, `${job.stand}${job.seconds ? `, ${job.seconds.toFixed(0)} s` : ''}, asked by ${job.who}`),
      job.stand === 'waiting' ? element('button', { type: 'button', onclick: () => attempt(() => this.page.desk.post('withdraw', { job: job.number })) }, 'Withdraw') : null,
      job.lines.length ? element('details', { open: job.stand === 'failed' }, element('summary', {}, job.lines.at(-1)), element('pre', {}, job.lines.join('\n'))) : null,
    )));
  }
}

/** A button can be pressed where nothing speaks against it; its title tells what it does, or why it does nothing. */
function allowed(button, why, what) {
  button.disabled = Boolean(why);
  button.title = why || what;
}
