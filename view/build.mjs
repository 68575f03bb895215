// Bundles source/ into the Python package, or with --check says whether what is committed there is what would be built.
import { build } from 'esbuild';
import { readFile, readdir, writeFile } from 'node:fs/promises';
import path from 'node:path';
import { fileURLToPath } from 'node:url';

const here = path.dirname(fileURLToPath(import.meta.url));
const out = path.join(here, '..', 'src', 'cityflow', 'viewer', 'web');
const isCheck = process.argv.includes('--check');

const result = await build({
  absWorkingDir: here,
  entryPoints: ['source/main.js'],
  outfile: path.join(out, 'view.js'),
  bundle: true,
  minify: true,
  format: 'iife',
  target: ['es2022'],
  legalComments: 'none',
  charset: 'utf8',
  metafile: true,
  write: false,
  banner: { js: '/* Built by view/build.mjs; whose code is in it, and under which licences: licences.txt */' },
});

const files = new Map([
  ['view.js', Buffer.from(result.outputFiles[0].contents)],
  ['licences.txt', Buffer.from(await licences(bundled(result.metafile)))],
]);

let differing = 0;
for (const [name, data] of files) {
  const target = path.join(out, name);
  if (!isCheck) {
    await writeFile(target, data);
    console.log(`${name}: ${data.length} bytes`);
    continue;
  }
  const committed = await readFile(target).catch(() => Buffer.alloc(0));
  if (!committed.equals(data)) {
    differing += 1;
    console.error(`${name} is not what view/source makes: run \`make view-bundle\` and commit it`);
  }
}
process.exitCode = differing ? 1 : 0;

/** Paths of the sources of which something is left in the bundle. */
function bundled({ outputs }) {
  const inputs = Object.values(outputs).flatMap((output) => Object.entries(output.inputs));
  return inputs.filter(([, { bytesInOutput }]) => bytesInOutput > 0).map(([name]) => name);
}

/** The licence of every package that has code in the bundle, as one text. */
async function licences(inputs) {
  const packages = new Set(inputs.map(packageOf).filter(Boolean));
  const parts = ['view.js holds code of these packages.\n'];
  for (const name of [...packages].sort()) {
    const folder = path.join(here, 'node_modules', name);
    const said = JSON.parse(await readFile(path.join(folder, 'package.json'), 'utf8'));
    const file = (await readdir(folder)).find((entry) => /^licen[cs]e/i.test(entry));
    const text = file ? await readFile(path.join(folder, file), 'utf8') : `Licence: ${said.license}\n`;
    parts.push(`${'='.repeat(80)}\n${said.name} ${said.version} (${said.license})\n${'='.repeat(80)}\n${text.trim()}\n`);
  }
  return parts.join('\n');
}

function packageOf(input) {
  const found = /node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(input);
  return found ? found[1] : null;
}
