// Finding a building by its id, or by a part of it.
import { STATUS } from './colours.js';
import { byId, element, say } from './elements.js';

const MOST_SHOWN = 30;

export function fillSearch(units, found) {
  const [field, options] = [byId('search'), byId('search-options')];
  const matching = () => {
    const text = field.value.trim().toLowerCase();
    return text ? units.filter((unit) => unit.id.toLowerCase().includes(text)) : [];
  };
  field.addEventListener('input', () => {
    options.replaceChildren(...matching().slice(0, MOST_SHOWN).map((unit) => element('option', { value: unit.id }, STATUS[unit.status][0])));
    const exact = units.find((unit) => unit.id === field.value);
    if (exact) found(exact);
  });
  field.closest('form').addEventListener('submit', (event) => {
    event.preventDefault();
    const all = matching();
    const exact = all.find((unit) => unit.id.toLowerCase() === field.value.trim().toLowerCase()) ?? all[0];
    if (!exact) return say(`No building has '${field.value}' in its id.`);
    found(exact);
    return say(all.length > 1 ? `${all.length} ids match; this is ${exact.id}.` : exact.id);
  });
}
