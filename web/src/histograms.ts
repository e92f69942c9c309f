// Histograms of what shows: of the present time, once it has stood still.
import { type Histogram, NAMES, type Source } from "./api";
import type { Context } from "./context";
import { whenTimeRests } from "./times";

export class Histograms {
  private readonly known = new Map<string, Histogram>(); // by fields
  private asked = new Set<string>();
  private readonly listeners: (() => void)[] = [];

  constructor(private readonly context: Context) {
    context.onVolume(() => { this.known.clear(); this.asked = new Set(); });
    whenTimeRests(context, () => { this.asked = new Set(); this.changed(); });
  }

  onChange(listener: () => void): void { this.listeners.push(listener); }

  // What is known of it; more is asked for.
  of(source: Source): Histogram | null {
    const field = source[NAMES.field] ?? "", { asked } = this;
    if (!asked.has(field) && this.context.volume()?.name === source["dataset"]) {
      asked.add(field);
      this.context.api.histogram(source).then(histogram => {
        if (!histogram || asked !== this.asked) return;
        this.known.set(field, histogram);
        this.changed();
      }).catch(() => undefined);
    }
    return this.known.get(field) ?? null;
  }

  private changed(): void { for (const listener of this.listeners) listener(); }
}
