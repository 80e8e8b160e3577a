// Workers that the streams of a page share, if they start them alike.
import { createDecoderPool } from '../../pool.js';

let all = []; // {source, createWorker, starting, pool, users}; pool: undefined while it starts

// Returns {starting, release}: a promise of a pool of so many Workers, or more. The last stream that
// releases it ends it.
export function borrowWorkers(workers, source, createWorker) {
  let shared = all.find(
    (one) => one.source === source && one.createWorker === createWorker && !one.pool?.ended,
  );
  if (!shared) {
    const starting = createDecoderPool({ workers, source, createWorker });
    shared = { source, createWorker, starting, users: 0 };
    all.push(shared);
  }
  shared.users++;
  const drop = () => {
    all = all.filter((one) => one !== shared);
  };
  const starting = shared.starting.then(async (pool) => {
    shared.pool = pool;
    await pool.grow(workers);
    return pool;
  });
  starting.catch(drop); // the next stream tries again
  const release = () => {
    if (--shared.users > 0) return;
    drop();
    starting.then((pool) => pool.close()).catch(() => {});
  };
  return { starting, release };
}
