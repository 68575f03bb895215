// The server beside the view: what the desk reads, what it may change, and what it hears as it happens.

export class Interface {
  /** @param {string} token of the address; without it nothing can be changed */
  constructor(token) {
    this.token = token;
    this.state = { who: '', roofs: [], methods: [], notes: {}, edits: [], jobs: [], pending: 0, refused: '' };
    this.onstate = [];
    this.handlers = {};
  }

  async get(name, query = {}) {
    const text = new URLSearchParams(query).toString();
    return answered(await fetch(`../desk/${name}${text ? `?${text}` : ''}`));
  }

  async post(name, body) {
    const headers = { 'Content-Type': 'application/json', 'X-Desk-Token': this.token };
    return answered(await fetch(`../desk/${name}`, { method: 'POST', headers, body: JSON.stringify(body) }));
  }

  /** Edits, notes and reruns as they are now. */
  async refresh() {
    this.state = await this.get('state');
    for (const told of this.onstate) told(this.state);
  }

  /** Hear of `job`, `state`, `models`, `changed`, `watch`, `trouble`; after an interruption all is read again. */
  listen(handlers) {
    const source = new EventSource('../desk/events');
    for (const [name, handler] of Object.entries(handlers)) source.addEventListener(name, (event) => handler(JSON.parse(event.data)));
    let wasLost = false;
    source.addEventListener('error', () => (wasLost = true));
    source.addEventListener('open', () => {
      if (wasLost) this.refresh();
      wasLost = false;
    });
    window.addEventListener('pagehide', () => source.close());
  }
}

async function answered(response) {
  const found = await response.json().catch(() => ({ error: `${response.status} ${response.statusText}` }));
  if (!response.ok) throw new Error(found.error ?? response.statusText);
  return found;
}
