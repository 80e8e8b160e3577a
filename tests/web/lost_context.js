// Loses the WebGL context of a canvas, as drivers do, draws some frames without it, with numbers
// from 0 to 1, and waits until it is back.
const FRAMES = 20;

export async function loseContext(canvas, draw) {
  const driver = canvas.getContext('webgl2').getExtension('WEBGL_lose_context');
  driver.loseContext();
  for (let i = 0; i <= FRAMES; i++) {
    draw(i / FRAMES);
    await new Promise(requestAnimationFrame);
  }
  const restored = new Promise((resolve) => {
    canvas.addEventListener('webglcontextrestored', () => setTimeout(resolve)); // after the engine
  });
  driver.restoreContext();
  await restored;
}
