// The times of the dataset that is shown: which one a state means, and how it is called.
import { type Dataset, NAMES, type Times } from "./api";
import { shown } from "./dom";
import type { Offers } from "./offers";
import type { State, Store } from "./state";

const REST_MS = 1200; // longer than a time shows while it is played

export const LAST = "last";
const SECONDS: Readonly<Record<string, number>> = { ns: 1e-9, us: 1e-6, "µs": 1e-6, ms: 1e-3, s: 1, min: 60, h: 3600, d: 86400, a: 31557600 };

export const timesOf = (dataset: Dataset | null): Times => dataset?.times ?? { count: 1 };

// The number of a time of the dataset, which a text of a state means; null: it has none such.
export function numberOf(time: string, dataset: Dataset): number | null {
  const { count, step, unit = "" } = timesOf(dataset);
  if (time === "" || time === LAST) return time === "" ? dataset.time ?? 0 : count - 1;
  const amount = parseFloat(time), of = time.replace(/^[\d.]+/, "");
  const number = of === "" ? amount : Math.round((amount * (SECONDS[of] ?? NaN)) / ((step ?? NaN) * (SECONDS[unit] ?? NaN)));
  return Number.isInteger(number) && number >= 0 && number < count ? number : null;
}

export function timeOptions({ dataset }: Offers, { time }: State): Record<string, string> {
  if (time === "" || (dataset && timesOf(dataset).count < 2)) return {};
  const number = dataset && numberOf(time, dataset);
  return dataset && number === null ? {} : { [NAMES.time]: number === null ? time : String(number) };
}

// Tells when the time has stood still for a while: of times that are played nobody asks more than their picture.
export function whenTimeRests({ store, ended }: { store: Store; ended: AbortSignal }, tell: () => void): void {
  let timer = 0;
  store.subscribe(() => { clearTimeout(timer); timer = setTimeout(() => { if (!ended.aborted) tell(); }, REST_MS); }, ["time"]);
}

// In the file's unit, or else its number.
export const timeText = (number: number, { step, unit }: Times): string => (step && unit ? `${shown(number * step)} ${unit}` : String(number));
