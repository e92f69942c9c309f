// The labels of the dataset: their names and colours, and which of them show.
import type { LegendEntry } from "./annotations";
import type { LabelName } from "./api";
import type { Context } from "./context";
import { labelMode } from "./options";

// Whether * (any characters, also none) and ? (one) in the pattern can stand for what the name has there.
function matches(name: string, pattern: string): boolean {
  const letters = [...name], signs = [...pattern];
  let n = 0, p = 0, star = -1, taken = 0; // the last star stands for what ends before `taken`
  while (n < letters.length) {
    if (signs[p] === "*") { star = p++; taken = n; }
    else if (p < signs.length && (signs[p] === "?" || signs[p] === letters[n])) { p++; n++; }
    else if (star >= 0) { p = star + 1; n = ++taken; }
    else return false;
  }
  return signs.slice(p).every(sign => sign === "*");
}

// "1,5-9,Precentral_L,Temporal_*" as a set; empty text: all.
export const isListed = (list: string, { value, name }: LabelName): boolean => list === "" || list.split(",").some(part => {
  if (/[^\d-]/.test(part)) return matches(name ?? "", part);
  const [first, last] = part.split("-").map(Number);
  return value >= (first ?? 0) && value <= (last ?? first ?? 0);
});

// The list of these of all labels, both in ascending order, with ranges where labels follow one another.
export function listOf(shown: readonly LabelName[], all: readonly LabelName[]): string {
  const parts: [number, number][] = [];
  let before = -2; // the last one's place among all
  for (const label of shown) {
    const place = all.indexOf(label), last = parts[parts.length - 1];
    if (last && place === before + 1) last[1] = label.value; else parts.push([label.value, label.value]);
    before = place;
  }
  return parts.map(([first, last]) => (first === last ? `${first}` : `${first}-${last}`)).join(",");
}

export const labelText = ({ name, value }: LabelName): string => name || `Label ${value}`;

export class Labels {
  names: readonly LabelName[] = []; // those that the gateway tells, and those that were pointed at
  complete = false; // the dataset has no others
  private readonly listeners: (() => void)[] = [];

  constructor(private readonly context: Context) {
    context.onVolume(volume => {
      this.complete = false;
      this.set([]);
      if (volume && volume.labels > 0) context.api.labels(volume.name).then(answer => {
        this.complete = answer?.complete ?? answer?.labels.length === volume.labels;
        this.set(answer?.labels ?? []);
      }).catch(() => undefined);
    });
  }

  onChange(listener: () => void): void { this.listeners.push(listener); }

  // A label that was pointed at.
  note(label: LabelName): void {
    if (!this.names.some(known => known.value === label.value)) this.set([...this.names, label].sort((a, b) => a.value - b.value));
  }

  shows(label: LabelName): boolean {
    const { labelsShown, labelOpacities } = this.context.store.state;
    return isListed(labelsShown, label) && labelOpacities[label.value] !== 0;
  }

  // The legend of the picture, if it is wanted.
  legend(): readonly LegendEntry[] {
    const { offers, store: { state } } = this.context;
    if (!state.legend || labelMode(offers, state) === "off" || !offers.can("labels", state.renderer)) return [];
    return this.names.filter(label => this.shows(label)).map(label => ({ name: labelText(label), color: label.color ?? "" }));
  }

  private set(names: readonly LabelName[]): void {
    this.names = names;
    for (const listener of this.listeners) listener();
  }
}
