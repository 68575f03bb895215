// Reads the few columns of a tile's tables (EXT_structural_metadata) that drawing needs, as whole columns.

/** A plugin of GLTFLoader: ids of buildings and the class of every face become `scene.userData.tables`. */
export class TablesPlugin {
  constructor(parser) {
    this.parser = parser;
    this.name = 'EXT_structural_metadata';
  }

  async afterRoot({ scene }) {
    const extension = this.parser.json.extensions?.[this.name];
    if (!extension) return;
    const [building, surface] = ['building', 'surface'].map((kind) => extension.propertyTables.find((t) => t.class === kind));
    if (!building || !surface) return;
    const words = extension.schema.enums?.type?.values ?? [];
    scene.userData.tables = {
      units: await this.#units(building, extension.schema.classes.building.properties),
      ids: await this.#texts(building, 'id'),
      types: new Uint8Array(await this.#view(surface.properties.type.values)),
      words: words.map((word) => word.name),
    };
  }

  #view(index) {
    return this.parser.getDependency('bufferView', index);
  }

  /** How buildings ended, which a file of far ones says itself; null of near ones. */
  async #units({ properties, count }, schema) {
    if (!this.parser.json.asset.extras?.isFar) return null;
    const [status, verdict] = await Promise.all(['cityflow_status', 'verdict'].map((name) => properties[name] && this.#texts({ properties, count }, name)));
    const [nmad, rmse] = await Promise.all(['nmad', 'rmse'].map((name) => properties[name] && this.#numbers(properties[name], schema[name].noData)));
    return Array.from({ length: count }, (_, i) => ({ status: status?.[i], verdict: verdict?.[i], nmad: nmad?.[i] ?? null, rmse: rmse?.[i] ?? null }));
  }

  async #numbers({ values }, missing) {
    return Array.from(new Float64Array(await this.#view(values)), (v) => (v === missing ? null : v));
  }

  async #texts(table, name) {
    const column = table.properties[name];
    const bytes = new Uint8Array(await this.#view(column.values));
    const offsets = new Uint32Array(await this.#view(column.stringOffsets));
    const decoder = new TextDecoder();
    return Array.from({ length: table.count }, (_, i) => decoder.decode(bytes.subarray(offsets[i], offsets[i + 1])));
  }
}
