// Checks of options.

// Throws RangeError for what is not a number, or less than `least`.
export function checkNumber(name, value, least) {
  if (Number.isFinite(value) && value >= least) return;
  const bound = least.toLocaleString('en');
  throw new RangeError(`${name} must be a number of at least ${bound}, not ${String(value)}`);
}

const LEAST_BYTES = 1e6;

export const checkMaxBytes = (bytes) => checkNumber('maxBytes', bytes, LEAST_BYTES);
