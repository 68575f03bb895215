// Models of before a rerun and of now, in the same scene: one key goes from the ones to the others.
import { element, say } from '../elements.js';

export class Before {
  constructor(page) {
    this.page = page;
    this.isShown = false;
    this.button = element('button', { type: 'button', 'aria-pressed': 'false', disabled: true, title: 'Models of before the last rerun, or of now (key: b)', onclick: () => this.toggle() }, 'Before');
    window.addEventListener('keydown', (event) => {
      if (event.key === 'b' && !isTyping(event) && !event.ctrlKey && !event.metaKey && !event.altKey) this.toggle();
    });
  }

  /** Read the tiles again; those of now become those of before. */
  async renew() {
    this.#set(false);
    await this.page.city.renew();
    this.button.disabled = false;
  }

  toggle() {
    if (this.button.disabled) return say('Nothing has been made again since this page was opened.');
    this.#set(!this.isShown);
    return say(this.isShown ? 'Models of before the rerun; the lines are those of now.' : 'Models of now.');
  }

  #set(isShown) {
    this.isShown = isShown;
    this.button.setAttribute('aria-pressed', String(isShown));
    this.page.city.showFormer(isShown);
  }
}

export const isTyping = ({ target }) => Boolean(target.matches?.('input:not([type="checkbox"], [type="radio"]), select, textarea'));
