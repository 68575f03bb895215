// Buildings: an index of ground tiles, a table for each, read when its tile is in sight or one of its buildings is asked for.
import { json } from './data.js';

const MOST_FOUND = 30;

export class Units {
  /** @param {object} root data/index.json: a row for each tile, where each part of the sorted ids begins, where the city ends @param {string} base of the files */
  constructor(root, base = '') {
    this.base = base;
    this.renew(root);
    this.reading = 0;
  }

  /** The run has gone on: everything is read again when it is asked for. */
  renew({ fields, rows, ids = [], ends = [] }) {
    this.tiles = asObjects(fields, rows);
    this.names = new Set(this.tiles.map(({ name }) => name));
    Object.assign(this, { firsts: ids, ends });
    this.byId = new Map();
    this.tables = new Map();
  }

  /** The table of a tile: cut lines, shapes of failures; its buildings are in `byId` then. Empty for a tile without buildings. */
  table(tile) {
    if (!this.tables.has(tile)) this.tables.set(tile, this.#read(tile));
    return this.tables.get(tile);
  }

  async #read(tile) {
    if (!this.names.has(tile)) return { failures: [], cuts: [] };
    this.reading += 1;
    try {
      const { fields, rows, failures, cuts } = await json(`${this.base}data/index/${encodeURIComponent(tile)}.json`);
      for (const unit of asObjects(fields, rows)) this.byId.set(unit.id, unit);
      return { failures, cuts: asObjects(cuts.fields, cuts.rows) };
    } finally {
      this.reading -= 1;
    }
  }

  /** A building by its id, null where there is none. */
  async find(id) {
    if (!this.byId.has(id)) {
      const row = (await this.#around(id)).find(([name]) => name === id);
      if (row) await this.table(row[1]);
    }
    return this.byId.get(id) ?? null;
  }

  /** [id, tile] of buildings whose id begins with a text, or else has it in it; upper and lower case are the same. */
  async matching(text) {
    const key = text.toLowerCase();
    const beginning = (await this.#around(key)).filter(([id]) => id.toLowerCase().startsWith(key));
    if (beginning.length) return beginning.slice(0, MOST_FOUND);
    const found = [];
    for (let part = 0; part < this.firsts.length && found.length < MOST_FOUND; part += 1) {
      found.push(...(await this.#part(part)).filter(([id]) => id.toLowerCase().includes(key)));
    }
    return found.slice(0, MOST_FOUND);
  }

  /** Rows of the parts that ids with a beginning stand in, as many as are shown at most. */
  async #around(beginning) {
    const key = beginning.toLowerCase();
    const after = this.firsts.findIndex((first) => first >= key);
    const rows = [];
    for (let part = Math.max((after < 0 ? this.firsts.length : after) - 1, 0); part < this.firsts.length; part += 1) {
      if (this.firsts[part] > key && !this.firsts[part].startsWith(key)) break;
      rows.push(...(await this.#part(part)));
      if (rows.filter(([id]) => id.toLowerCase().startsWith(key)).length >= MOST_FOUND) break;
    }
    return rows;
  }

  async #part(number) {
    this.reading += 1;
    try {
      return await json(`${this.base}data/ids/${number}.json`);
    } finally {
      this.reading -= 1;
    }
  }
}

const asObjects = (fields, rows) => rows.map((row) => Object.fromEntries(fields.map((field, i) => [field, row[i]])));
