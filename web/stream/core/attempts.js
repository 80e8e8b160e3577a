// Tries of something that fails now and then, such as a request.
import { delayAfter, pause } from '../io/source.js';

const MOST = 3; // of a page that is malformed or kills its Worker, and of what a server refuses

export class Attempts {
  #at = 0; // time of the next one
  failed = 0;

  isDue(now) {
    return this.#at <= now;
  }

  // No more, unless reset.
  block() {
    this.#at = Infinity;
  }

  reset() {
    this.#at = 0;
    this.failed = 0;
  }

  get isOver() {
    return this.failed >= MOST;
  }

  // After an error: calls again() when it is time for another one, unless a signal is aborted. Gives up
  // after a few, if that does not promise to help. Returns whether there is another one.
  postpone(error, again, signal) {
    this.failed++;
    this.block();
    if (!error.retry && this.isOver) return false;
    const delay = delayAfter(this.failed, error);
    this.#at = performance.now() + delay;
    pause(delay + 1, signal).then(again, () => {});
    return true;
  }
}
