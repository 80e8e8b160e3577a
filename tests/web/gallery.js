// Tells screenshots.mjs when models of the gallery are drawn: what they show.
import { loseContext } from './lost_context.js';

// The first two: each context of WebGL takes software long.
const views = [...document.querySelectorAll('meshlet-view')].slice(0, 2);
const frame = () => new Promise(requestAnimationFrame);
const ends = [];
for (const view of views) {
  const loaded = new Promise((resolve) => {
    view.addEventListener('load', () => resolve('load'));
    view.addEventListener('error', ({ detail }) => resolve(String(detail)));
  });
  view.scrollIntoView(); // it opens its file when it is seen
  ends.push(await Promise.race([loaded, view.stream?.ready.then(() => 'load') ?? loaded]));
}
while (!views.every(({ stream }) => stream?.statistics.complete)) await frame();
scrollTo(0, 0);
await frame();
await frame();
const shown = views.map(({ stream }) => stream.statistics.triangles);
const [first] = views;
const { stream } = first;
first.setAttribute('max-bytes', '3000000');
const changed = stream.maxBytes;
first.removeAttribute('src');
const gone = first.stream;
let errors = 0;
first.addEventListener('error', () => errors++);
first.setAttribute('src', 'gear.glb');
first.parentNode.prepend(first); // moved, while its file opens
await new Promise((resolve) => first.addEventListener('load', resolve));
const other = first.stream !== stream;
first.remove();
await frame();
const canvases = first.shadowRoot.querySelectorAll('canvas').length;
const alt = views.map((view) => view.getAttribute('aria-label'));
const [, second] = views;
second.scrollIntoView();
while (!second.stream?.statistics.complete) await frame();
await loseContext(second.shadowRoot.querySelector('canvas'), () => {});
for (let i = 0; i < 5 || !second.stream.statistics.complete; i++) await frame();
globalThis.done = { ends, shown, changed, gone, other, errors, canvases, alt };
