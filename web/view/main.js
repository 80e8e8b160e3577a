// The web page: buttons, keys, dropped files, the table of sizes and times.
import { SCALES } from './difference.js';
import { load } from './loading.js';
import { Models, SUFFIXES } from './models.js';
import { Stage } from './stage.js';
import { look, openStream } from './streaming.js';

const TURN = Math.PI / 24; // of an arrow key
const STEP = 40; // pixels
const ZOOM = 1.15;
const KEPT = 'gltf-meshlet-theme'; // in localStorage
const TOAST_SECONDS = 6;
const WIPE_STEP = 0.05; // of an arrow key
const REFRESH = 500; // milliseconds between updates of what a stream tells

/** @type {(id: string) => any} */
const element = (id) => document.getElementById(id);
const make = (tag, text) => Object.assign(document.createElement(tag), { textContent: text });
const count = new Intl.NumberFormat('en').format;

const models = new Models();
const list = []; // of models
let stage;
let attempt = 0; // a later one makes an earlier one void
let abort = new AbortController();
let shown = null; // {model, main, beside, notices}: main and beside are {loaded, times}
let compare = 'beside'; // of stage.js
const on = { meshlets: false, wireframe: false, original: false, play: true, info: true };
// Of models with levels: the sliders' values are powers of two, of pixels and of megabytes.
const levels = { pixels: 0, megabytes: 6, colour: 'meshlet' };

// --- opening ---

async function start() {
  element('starting').remove();
  setTheme(keptTheme());
  stage = new Stage(element('canvas'));
  setTheme(keptTheme());
  on.play = !matchMedia('(prefers-reduced-motion: reduce)').matches;
  on.info = innerWidth > 700;
  connect();
  update();
  add(await models.start());
}

function add(more) {
  list.push(...more);
  listModels(list.length - 1);
  return open(list.length - 1);
}

function listModels(selected) {
  const names = list.map(({ name }) => new Option(name));
  element('models').replaceChildren(...names);
  element('models').selectedIndex = selected;
  element('models').hidden = list.length < 2;
  element('name').classList.toggle('unseen', list.length > 1);
  element('name').textContent = list[selected].name;
  document.title = `${list[selected].name} – gltf-meshlet`;
}

async function open(number) {
  const mine = begin();
  const { name } = list[number];
  try {
    const notices = [];
    if (list[number].compressed === null) await compress(number, notices);
    if (mine !== attempt) return;
    const model = list[number];
    const main = await read(model.compressed ?? model.original, name, true);
    if (mine !== attempt) return main.loaded.dispose();
    shown = { model, main, beside: null, notices: [...notices, ...main.loaded.warnings] };
    arrange();
    stage.fit(true);
    main.times.frame = stage.drawNow();
    document.body.dataset.state = 'ready';
    if (on.original && hasOriginal()) await showOriginal();
    update();
  } catch (error) {
    if (mine === attempt) fail(error, name);
  }
}

// Ends what is shown and what is being opened.
function begin() {
  abort.abort();
  abort = new AbortController();
  stage.show([]);
  shown?.main.loaded.dispose();
  shown?.beside?.loaded.dispose();
  shown = null;
  element('error').hidden = true;
  element('freeze').checked = false;
  document.body.dataset.state = 'loading';
  update();
  return ++attempt;
}

// Replaces a model by its compressed form, or says why there is none.
async function compress(number, notices) {
  const model = list[number];
  if (!models.compresses) {
    notices.push('Shown uncompressed: this page has no server that could compress it.');
    return;
  }
  const since = performance.now();
  const tell = () =>
    status(`Compressing ${model.name} … ${Math.round((performance.now() - since) / 1000)} s`);
  const timer = setInterval(tell, 1000);
  tell();
  try {
    list[number] = await models.compress(model, abort.signal);
  } catch (error) {
    if (abort.signal.aborted) throw error;
    notices.push(`Shown uncompressed: ${error.message}.`);
  } finally {
    clearInterval(timer);
  }
}

async function read(source, name, streams = false) {
  const mine = attempt;
  const { signal } = abort;
  const tell = (text) => mine === attempt && status(text);
  tell(`Opening ${name} …`);
  const since = performance.now();
  const looked = streams && source.place ? await look(source.place, signal) : {};
  const { levels: has, blob, fetch } = looked;
  if (blob) Object.assign(source, { place: blob, read: () => blob.arrayBuffer() }); // not again
  if (has) {
    const loaded = await openStream(source.place, {
      pixels: 2 ** levels.pixels,
      maxBytes: 1e6 * 2 ** levels.megabytes,
      onChange: () => stage.invalidate(),
      signal,
      fetch,
    });
    tell(null);
    return { loaded, times: { ...loaded.times }, whole: blob?.size ?? 0 };
  }
  const buffer = await source.read();
  const times = { read: performance.now() - since };
  tell(`Decoding ${name} …`);
  await painted();
  const loaded = await load(buffer, source.type);
  tell(null);
  return { loaded, times: { ...times, ...loaded.times } };
}

// Decoding may keep the web page busy: first let it show that.
const painted = () => new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));

async function showOriginal() {
  const mine = attempt;
  if (!shown.beside) {
    document.body.dataset.state = 'loading';
    try {
      const beside = await read(shown.model.original, `the original of ${shown.model.name}`);
      if (mine !== attempt) return beside.loaded.dispose();
      shown.beside = beside;
    } catch (error) {
      if (mine !== attempt) return;
      on.original = false;
      status(null);
      shown.notices.push(`The original cannot be shown: ${sentence(error)}.`);
      toast(shown.notices.at(-1));
    }
    document.body.dataset.state = 'ready';
  }
  arrange();
  if (shown.beside && shown.beside.times.frame === undefined)
    shown.beside.times.frame = stage.drawNow();
  update();
}

const hasOriginal = () => Boolean(shown?.model.compressed && shown.model.original);

// Puts on the stage what the buttons say.
function arrange() {
  if (!shown) return;
  const { main, beside } = shown;
  main.loaded.colourMeshlets(on.meshlets && shown.model.compressed !== null, levels.colour);
  Object.assign(stage, { wireframe: on.wireframe, playing: on.play, compare });
  stage.show(on.original && beside ? [beside.loaded, main.loaded] : [main.loaded]);
  update();
}

// --- what the web page says ---

function status(text) {
  element('status').hidden = text === null;
  element('status').textContent = text ?? '';
}

function toast(text) {
  status(text);
  setTimeout(() => element('status').textContent === text && status(null), 1000 * TOAST_SECONDS);
}

function fail(error, name) {
  console.error(error);
  status(null);
  element('error-title').textContent = `${name ?? 'The page'} cannot be shown`;
  element('error-text').textContent = sentence(error);
  element('error').hidden = false;
  document.body.dataset.state = 'error';
}

const sentence = (error) =>
  String(error?.message || error)
    .replace(/^THREE\.\w+: /, '')
    .replace(/\.$/, '');

function update() {
  updateDetails();
  updateComparison();
  for (const id of ['meshlets', 'wireframe', 'original', 'play', 'info'])
    element(id).setAttribute('aria-pressed', String(on[id]));
  const ready = shown !== null;
  for (const id of ['fit', 'wireframe', 'screenshot', 'info']) element(id).disabled = !ready;
  element('meshlets').disabled = !shown?.model.compressed;
  element('save').hidden = !shown?.model.compressed;
  element('original').disabled = !hasOriginal();
  element('play').hidden = !(ready && stage.animated);
  element('details').hidden = !(on.info && ready);
  element('levels').hidden = !stream();
}

function updateComparison() {
  const compares = Boolean(on.original && shown?.beside);
  element('comparing').hidden = !compares;
  element('labels').hidden = !compares || compare in SCALES;
  element('labels').classList.toggle('stacked', stage.stacked && compare === 'beside');
  element('labels').classList.toggle('wiped', compare === 'wipe');
  element('wipe').hidden = !compares || compare !== 'wipe';
  element('scale').hidden = !(compare in SCALES);
  if (!(compare in SCALES)) return;
  const [least, most] = SCALES[compare].map((power) => 10 ** power);
  const text = (value) => (compare === 'normal' ? `${value}°` : `${fixedSmall(100 * value)} %`);
  element('least').textContent = text(least);
  element('most').textContent = `${text(most)}${compare === 'normal' ? '' : ' of the size'}`;
}

const fixedSmall = (value) => value.toFixed(6).replace(/\.?0+$/, '');

function moveWipe(at) {
  stage.wipe = Math.min(Math.max(at, 0), 1);
  element('wipe').style.left = `${100 * stage.wipe}%`;
  element('wipe').setAttribute('aria-valuenow', String(Math.round(100 * stage.wipe)));
  stage.invalidate();
}

// How two models are compared, and the light.
function connectStage() {
  element('compare').addEventListener('change', ({ target }) => {
    compare = target.value;
    arrange();
  });
  const wipe = element('wipe');
  wipe.addEventListener('pointerdown', ({ pointerId }) => wipe.setPointerCapture(pointerId));
  wipe.addEventListener('pointermove', ({ pointerId, clientX }) => {
    if (!wipe.hasPointerCapture(pointerId)) return;
    const { left, width } = element('canvas').getBoundingClientRect();
    moveWipe((clientX - left) / width);
  });
  wipe.addEventListener('keydown', (event) => {
    const [step] = moves[event.key] ?? [0];
    if (step === 0) return;
    moveWipe(stage.wipe + WIPE_STEP * step);
    event.preventDefault();
    event.stopPropagation();
  });
  moveWipe(stage.wipe);
  const setLight = () => {
    const angle = Number(element('angle').value);
    element('angle-value').textContent = `${angle}°`;
    stage.setLight(element('environment').value, (angle * Math.PI) / 180);
  };
  element('environment').addEventListener('change', setLight);
  element('angle').addEventListener('input', setLight);
  element('turns').addEventListener('change', ({ target }) => {
    stage.turns = target.checked;
    stage.invalidate();
  });
}

const stream = () => shown?.main.loaded.stream;

// What a stream tells, as rows of the details.
function streamRows() {
  if (!stream()) return [];
  const { triangles, error, requests, resident, pages, bytes, ...more } = stream().statistics;
  const fetched = more.fetched + shown.main.whole; // without ranges it was fetched before
  return [
    ['Drawn', '', count(triangles)],
    ['Error in pixels', '', error.toFixed(2)],
    ['Fetched', '', size(fetched)],
    ['Requests', '', count(requests)],
    ['Pages in memory', '', `${count(resident)} of ${count(pages)}`],
    ['Memory', '', size(bytes.total)],
  ];
}

function updateDetails() {
  if (!shown) return;
  const { model, main, beside, notices } = shown;
  const sides = model.compressed ? [beside, main] : [main, null];
  const cells = (value) => sides.map((side) => (side ? value(side) : ''));
  const files = [model.original, model.compressed].map((file) => (file ? size(file.bytes) : ''));
  const both = model.original && model.compressed;
  const { bytes, rawBytes } = main.loaded.counts;
  const rows = [
    ['File', ...files],
    ['Times smaller', '', both && fixed(model.original.bytes / model.compressed.bytes)],
    ['Geometry', optional(rawBytes, size), optional(bytes, size)],
    ['Triangles', ...cells(({ loaded }) => count(loaded.counts.triangles))],
    ['Vertices', ...cells(({ loaded }) => optional(loaded.counts.vertices, count))],
    ['Meshlets', ...cells(({ loaded }) => optional(loaded.counts.meshlets, count))],
    ['Bits per triangle', ...cells(({ loaded }) => optional(loaded.counts.bitsPerTriangle, fixed))],
    ['Compress', '', optional(model.seconds, (seconds) => time(1000 * seconds))],
    ['Read', ...cells(({ times }) => optional(times.read, time))],
    ['Decode', ...cells(({ times }) => optional(times.decode, time))],
    ['Build', ...cells(({ times }) => time(times.build))],
    ['First frame', ...cells(({ times }) => optional(times.frame, time))],
    ...streamRows(),
  ];
  element('rows').replaceChildren(
    ...rows.filter(([, ...values]) => values.some(Boolean)).map(tableRow),
  );
  const missing = [!model.original, !model.compressed];
  missing.forEach((none, side) => element('details').classList.toggle(`without-${side}`, none));
  const items = [...model.warnings, ...notices].map((text) => make('li', text));
  element('notices').replaceChildren(...items);
}

function tableRow([label, ...values]) {
  const row = document.createElement('tr');
  const head = Object.assign(make('th', label), { scope: 'row' });
  row.append(head, ...values.map((value) => make('td', value || '')));
  return row;
}

const optional = (value, text) => (value ? text(value) : '');
const fixed = (value) => value.toFixed(1);

function size(bytes) {
  if (bytes >= 1e9) return `${(bytes / 1e9).toFixed(2)} GB`;
  if (bytes >= 1e6) return `${(bytes / 1e6).toFixed(2)} MB`;
  return bytes >= 1e3 ? `${(bytes / 1e3).toFixed(1)} kB` : `${bytes} B`;
}

function time(milliseconds) {
  if (milliseconds >= 1000) return `${(milliseconds / 1000).toFixed(2)} s`;
  return `${milliseconds.toFixed(milliseconds < 10 ? 1 : 0)} ms`;
}

// --- buttons, keys, files ---

const actions = {
  open: () => element('files').click(),
  theme: () => setTheme(document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark'),
  help: () => element('keys').showModal(),
  fit: () => stage.fit(),
  reset: () => stage.fit(true),
  meshlets: () => toggle('meshlets', arrange),
  wireframe: () => toggle('wireframe', arrange),
  original: () => toggle('original', () => (on.original ? showOriginal() : arrange())),
  play: () => toggle('play', arrange),
  screenshot: async () => save(await stage.picture(), '.png'),
  save: async () => save(new Blob([await shown.model.compressed.read()]), '.compressed.glb'),
  info: () => toggle('info', update),
};

// Key -> name of an action; those of buttons come from their titles, which end with "(KEY)".
const keys = { r: 'reset' };

const moves = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

function toggle(name, then) {
  on[name] = !on[name];
  return then();
}

function act(name) {
  const button = element(name);
  if (button?.disabled || button?.hidden) return;
  Promise.resolve(actions[name]()).catch((error) => toast(sentence(error)));
}

function key(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || element('keys').open) return;
  const { key: name, target } = event;
  if (target.matches('select') || (name === ' ' && target.matches('button, input'))) return;
  if (name in moves) {
    if (target.matches('[type=range]')) return; // a slider's own keys
    const [x, y] = moves[name];
    if (event.shiftKey) stage.pan(-STEP * x, -STEP * y);
    else stage.orbit(TURN * x, TURN * y);
  } else if (name === '+' || name === '=') stage.zoom(ZOOM);
  else if (name === '-') stage.zoom(1 / ZOOM);
  else if (name.toLowerCase() in keys) act(keys[name.toLowerCase()]);
  else return;
  event.preventDefault();
}

// Downloads a blob under the model's name with another suffix.
function save(blob, suffix) {
  const url = URL.createObjectURL(blob);
  const link = document.createElement('a');
  link.href = url;
  link.download = shown.model.name.replace(/\.[^.]*$/, '') + suffix;
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

async function openFiles(files) {
  if (files.length === 0) return;
  const mine = begin();
  try {
    const found = await models.fromFiles(files);
    if (mine === attempt) await add(found);
  } catch (error) {
    if (mine === attempt) fail(error, files.length === 1 ? files[0].name : null);
  }
}

// The sliders, the colours and the frozen cut of models with levels.
function connectLevels() {
  element('pixels').addEventListener('input', ({ target }) => {
    levels.pixels = Number(target.value);
    element('pixels-value').textContent = fixed(2 ** levels.pixels);
    stream().pixels = 2 ** levels.pixels;
    stage.invalidate();
  });
  const megabytes = element('megabytes');
  const tell = () => {
    element('megabytes-value').textContent = `${2 ** megabytes.value} MB`;
  };
  megabytes.addEventListener('input', tell);
  megabytes.addEventListener('change', () => {
    try {
      stream().maxBytes = 1e6 * 2 ** megabytes.value;
      levels.megabytes = Number(megabytes.value);
    } catch (error) {
      megabytes.value = levels.megabytes;
      tell();
      toast(sentence(error));
    }
  });
  element('colour').addEventListener('change', ({ target }) => {
    levels.colour = target.value;
    on.meshlets = true;
    arrange();
  });
  element('freeze').addEventListener('change', ({ target }) => {
    stream().frozen = target.checked;
    stage.invalidate();
  });
  setInterval(() => stream() && on.info && updateDetails(), REFRESH);
}

function listKeys() {
  for (const { id, title } of document.querySelectorAll('button')) {
    const [, about, key] = title.match(/^(.*) \((\S|space)\)$/) ?? [];
    if (!key) continue;
    keys[key === 'space' ? ' ' : key.toLowerCase()] = id;
    const shown = make('dt', '');
    shown.append(make('kbd', key));
    element('key-list').append(shown, make('dd', about));
  }
}

function connect() {
  listKeys();
  for (const name of Object.keys(actions))
    element(name)?.addEventListener('click', () => act(name));
  addEventListener('keydown', key);
  addEventListener('resize', update);
  connectLevels();
  connectStage();
  element('models').addEventListener('change', ({ target }) => {
    listModels(target.selectedIndex);
    open(target.selectedIndex);
  });
  element('files').accept = `${SUFFIXES.map((suffix) => `.${suffix}`).join()},.bin,image/*`;
  element('files').addEventListener('change', ({ target }) => {
    openFiles([...target.files]);
    target.value = ''; // so that the same file can be opened again
  });
  const drop = element('drop');
  addEventListener('dragover', (event) => {
    event.preventDefault();
    drop.hidden = !event.dataTransfer.types.includes('Files');
  });
  addEventListener('dragleave', (event) => {
    if (event.relatedTarget === null) drop.hidden = true;
  });
  addEventListener('drop', (event) => {
    event.preventDefault();
    drop.hidden = true;
    openFiles([...event.dataTransfer.files]);
  });
  let before; // state of the page, while the WebGL context is lost
  const lost = new Error(
    'the graphics driver has failed; wait until it recovers, or reload the page',
  );
  element('canvas').addEventListener('webglcontextlost', () => {
    before = document.body.dataset.state;
    if (before !== 'error') fail(lost, shown?.model.name);
  });
  element('canvas').addEventListener('webglcontextrestored', () => {
    stage.restore();
    setTheme(document.documentElement.dataset.theme);
    const { state } = document.body.dataset;
    if (state !== 'error' || element('error-text').textContent !== sentence(lost)) return;
    element('error').hidden = true;
    document.body.dataset.state = shown ? 'ready' : before;
  });
}

// --- dark and light ---

// The browser may keep nothing for this web page; then it throws.
function stored(action) {
  try {
    return action();
  } catch {
    return null;
  }
}

function keptTheme() {
  const kept = stored(() => localStorage.getItem(KEPT));
  const light = matchMedia('(prefers-color-scheme: light)').matches;
  return ['dark', 'light'].includes(kept) ? kept : light ? 'light' : 'dark';
}

function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  const style = getComputedStyle(document.documentElement);
  stage?.setColours(style.getPropertyValue('--scene'), style.getPropertyValue('--accent'));
  if (theme !== keptTheme()) stored(() => localStorage.setItem(KEPT, theme));
}

start().catch((error) => fail(error, null));
