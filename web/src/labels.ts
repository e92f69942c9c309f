// The labels of the dataset: their names and colours, and which of them show.
import type { LegendEntry } from "./annotations";
import type { LabelName } from "./api";
import type { Context } from "./context";
import { can } from "./offers";

// "1,5-9" as a set; empty text: all.
export const isListed = (list: string, label: number): boolean => list === "" || list.split(",").some(part => { const [first, last] = part.split("-").map(Number); return label >= (first ?? 0) && label <= (last ?? first ?? 0); });
export const labelText = ({ name, value }: LabelName): string => name || `Label ${value}`;

export class Labels {
  names: readonly LabelName[] = []; // all of the dataset if the gateway tells them, else those that were pointed at
  private readonly listeners: (() => void)[] = [];

  constructor(private readonly context: Context) {
    context.onVolume(volume => {
      this.set([]);
      if (volume && volume.labels > 0) context.api.labels(volume.name).then(answer => this.set(answer?.labels ?? [])).catch(() => undefined);
    });
  }

  onChange(listener: () => void): void { this.listeners.push(listener); }

  // A label that was pointed at.
  note(label: LabelName): void {
    if (!this.names.some(known => known.value === label.value)) this.set([...this.names, label].sort((a, b) => a.value - b.value));
  }

  shows({ value }: LabelName): boolean {
    const { labelsShown, labelOpacities } = this.context.store.state;
    return isListed(labelsShown, value) && labelOpacities[value] !== 0;
  }

  // Of the picture, if it is wanted.
  legend(): readonly LegendEntry[] {
    const { legend, labels, renderer } = this.context.store.state;
    if (!legend || labels === "off" || !can("labels", renderer)) return [];
    return this.names.filter(label => this.shows(label)).map(label => ({ name: labelText(label), color: label.color ?? "" }));
  }

  private set(names: readonly LabelName[]): void {
    this.names = names;
    for (const listener of this.listeners) listener();
  }
}
