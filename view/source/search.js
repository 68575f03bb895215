// Finding a building by its id, or by a part of it.
import { byId, element, say } from './elements.js';

/** @param {Units} units @param {(id: string) => void} found */
export function fillSearch(units, found) {
  const [field, options] = [byId('search'), byId('search-options')];
  const matching = async () => {
    const text = field.value.trim();
    const ids = text ? (await units.matching(text)).map(([id]) => id) : [];
    return field.value.trim() === text ? ids : null;
  };
  field.addEventListener('input', async () => {
    const ids = await matching();
    if (!ids) return;
    options.replaceChildren(...ids.map((id) => element('option', { value: id })));
    if (ids.includes(field.value)) found(field.value);
  });
  field.closest('form').addEventListener('submit', async (event) => {
    event.preventDefault();
    const ids = await matching();
    if (!ids) return undefined;
    const chosen = ids.find((id) => id.toLowerCase() === field.value.trim().toLowerCase()) ?? ids[0];
    if (!chosen) return say(`No building has '${field.value}' in its id.`);
    found(chosen);
    return say(ids.length > 1 ? `${ids.length} ids match; this is ${chosen}.` : chosen);
  });
}
