// Buttons and keys that belong to no layer and no building.
import { byId, copy, say } from './elements.js';

const TOOLS = ['distance', 'area', 'section', 'residuals'];

export function wireControls(page, { choose }) {
  const { stage, tools, link } = page;
  const setFlying = flying(stage);
  const overview = () => {
    setFlying(false);
    stage.overview();
  };
  byId('fly').addEventListener('click', () => setFlying(!stage.isFlying));
  byId('home').addEventListener('click', overview);
  byId('share').addEventListener('click', () => share(link));
  for (const name of TOOLS) {
    byId(`tool-${name}`).addEventListener('click', () => {
      fold(false);
      tools.start(name);
      // so that keys move the city at once, and Enter takes a place
      if (tools.active) stage.canvas.focus();
    });
  }
  byId('layers-open').addEventListener('click', () => fold(!byId('layers').classList.contains('open')));
  const help = wireHelp();
  stage.afterMove.push(() => link.set('camera', stage.place.join(',')));
  window.addEventListener('keydown', (event) => {
    const isTyping = event.target.matches?.('input:not([type="checkbox"], [type="radio"]), select, textarea');
    if (event.key === 'Escape') escape(page, setFlying, choose);
    else if (isTyping || help.open || event.ctrlKey || event.metaKey || event.altKey) return;
    else if (event.key === 'f') setFlying(!stage.isFlying);
    else if (event.key === 'h') overview();
    else if (event.key === '?') help.showModal();
    else if (event.key === '/') {
      event.preventDefault();
      byId('search').focus();
    }
  });
}

function flying(stage) {
  return (isFlying) => {
    if (isFlying === stage.isFlying) return;
    stage.fly(isFlying);
    byId('fly').setAttribute('aria-pressed', String(isFlying));
    byId('fly-hint').hidden = !isFlying;
    stage.canvas.focus();
  };
}

/** On a narrow screen the layers are folded away until they are asked for. */
function fold(isOpen) {
  byId('layers').classList.toggle('open', isOpen);
  byId('layers-open').setAttribute('aria-expanded', String(isOpen));
}

function wireHelp() {
  const help = byId('help');
  byId('help-open').addEventListener('click', () => help.showModal());
  byId('help-close').addEventListener('click', () => help.close());
  help.addEventListener('click', (event) => event.target === help && help.close());
  return help;
}

/** Esc leaves one thing at a time: help, the tool in hand, flying, the layers of a narrow screen, then the panel. */
function escape(page, setFlying, choose) {
  const { tools, stage } = page;
  if (byId('help').open) byId('help').close();
  else if (page.taking) page.taking = null;
  else if (tools.active || tools.isTelling) tools.stop();
  else if (stage.isFlying) setFlying(false);
  else if (byId('layers').classList.contains('open')) fold(false);
  else choose(null);
}

async function share(link) {
  const isCopied = await copy(link.address);
  say(isCopied ? 'The link to this view is copied.' : `The address of the page leads back to this view: ${link.address}`);
}
