// Models of before a rerun and of now: one key goes from the ones to the others, another one draws both beside each other.
import { byId, element, say } from '../elements.js';

const NOTHING = 'Nothing has been made again since this page was opened.';

export class Before {
  constructor(page) {
    Object.assign(this, { page, isShown: false });
    this.button = button('Before', 'Models of before the last rerun, or of now (key: b)', () => this.toggle());
    this.both = button('Side by side', 'Models of before the last rerun beside those of now (key: v)', () => this.toggleBeside());
    this.names = ['before', 'after'].map((name) => element('span', { class: 'half' }, name));
    this.line = element('div', { id: 'halves', hidden: true }, this.names);
    byId('stage').append(this.line);
    page.stage.beforeFrame.push(() => this.#place());
    window.addEventListener('keydown', (event) => {
      if (isTyping(event) || event.ctrlKey || event.metaKey || event.altKey || page.stage.isFlying) return;
      if (event.key === 'b') this.toggle();
      else if (event.key === 'v') this.toggleBeside();
    });
  }

  /** Read the tiles again; those of now become those of before. */
  async renew() {
    const { isBeside } = this;
    this.leave();
    this.#set(false);
    await this.page.city.renew();
    this.allow();
    if (isBeside) this.toggleBeside();
  }

  /** There is something of before, or no more. */
  allow() {
    this.button.disabled = this.both.disabled = !this.page.city.hasFormer;
    if (this.both.disabled) this.leave();
  }

  toggle() {
    if (this.button.disabled) return say(NOTHING);
    this.leave();
    this.#set(!this.isShown);
    return say(this.isShown ? 'Models of before the rerun; the lines are those of now.' : 'Models of now.');
  }

  #set(isShown) {
    this.isShown = isShown;
    this.button.setAttribute('aria-pressed', String(isShown));
    this.page.city.showFormer(isShown);
  }

  toggleBeside() {
    if (this.both.disabled) return say(NOTHING);
    if (this.isBeside) {
      this.leave();
      return say('Models of now.');
    }
    const { city, stage, compare, photograph } = this.page;
    photograph.leave();
    compare.leave();
    this.#set(false);
    stage.controls.zoomToCursor = false;
    stage.beside = (isFormer) => {
      city.drawFormer(isFormer);
      if (city.edges) city.edges.visible = city.shown.buildings && !isFormer;
    };
    this.#pressed();
    return say('On the left the models of before the rerun, on the right those of now; both move together. Key v ends.');
  }

  get isBeside() {
    return Boolean(this.page.stage.beside);
  }

  /** One picture again. */
  leave() {
    const { stage } = this.page;
    if (!stage.beside) return;
    stage.beside(false);
    stage.beside = null;
    stage.controls.zoomToCursor = true;
    this.#pressed();
  }

  #pressed() {
    this.both.setAttribute('aria-pressed', String(this.isBeside));
    this.line.hidden = !this.isBeside;
    document.body.classList.toggle('beside', this.isBeside);
    this.page.stage.changed();
  }

  #place() {
    if (!this.isBeside) return;
    this.line.style.left = `${this.page.stage.halves[1].left}px`;
  }
}

const button = (text, title, onclick) => element('button', { type: 'button', 'aria-pressed': 'false', disabled: true, title, onclick }, text);

export const isTyping = ({ target }) => Boolean(target.matches?.('input:not([type="checkbox"], [type="radio"]), select, textarea'));
