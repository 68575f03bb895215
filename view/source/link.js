// The address of the page says what is seen: camera, chosen building, layers. Whoever opens it sees the same.

const WAIT_MS = 250;

export class Link {
  constructor() {
    this.parts = new URLSearchParams(location.hash.slice(1));
    this.timer = null;
  }

  /** Six numbers of the camera, or null. */
  get camera() {
    const numbers = (this.parts.get('camera') ?? '').split(',').map(Number);
    return numbers.length === 6 && numbers.every(Number.isFinite) ? numbers : null;
  }

  get(name) {
    return this.parts.get(name);
  }

  set(name, value) {
    if (value === null || value === undefined || value === '') this.parts.delete(name);
    else this.parts.set(name, value);
    // history.replaceState is rationed by browsers, and a camera moves at every frame
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.#write(), WAIT_MS);
  }

  get address() {
    return `${location.origin}${location.pathname}${location.search}#${this.#text()}`;
  }

  #write() {
    history.replaceState(null, '', `#${this.#text()}`);
  }

  #text() {
    return this.parts.toString().replaceAll('%2C', ',');
  }
}
