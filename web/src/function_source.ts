// The transfer function as points: that of the state, or what its preset is for this dataset, which the gateway tells.
import type { ColorBar } from "./annotations";
import type { Source } from "./api";
import { sourceOf } from "./channels";
import type { Context } from "./context";
import { renderOptions } from "./options";
import { colorAt, type ColorMap, hexOf, parseParaView, ramp, rangeOf, stretched, visibleRangeOf } from "./transfer";

const BAR_COLORS = 64;

export class FunctionSource {
  private readonly presets = new Map<string, ColorMap | null>(); // null: the gateway does not tell
  private readonly asked = new Set<string>();

  constructor(private readonly context: Context, private readonly changed: () => void) {}

  // The function as the service draws it, in data values.
  current(): ColorMap {
    const { range } = this.context.store.state, map = this.unstretched();
    return range ? stretched(map, range) : map;
  }

  range(): [number, number] {
    const { range } = this.context.store.state;
    return range ? [range[0], range[1]] : rangeOf(this.unstretched());
  }

  // Whether current() is a ramp in the place of a preset, since the gateway does not tell its points.
  get untold(): boolean {
    const { map, preset } = this.context.store.state;
    return map === null && this.presets.get(this.key(preset)) === null;
  }

  // Whether the points are on their way: nothing is known of them yet.
  get pending(): boolean {
    const { map, preset } = this.context.store.state;
    return map === null && this.presets.get(this.key(preset)) === undefined;
  }

  // Whether the picture follows it.
  get shows(): boolean { return "transfer" in renderOptions(this.context.offers, this.context.store.state); }

  // What colours of the picture mean; null: no bar can say it.
  bar(): ColorBar | null {
    const map = this.current(), [low, high] = visibleRangeOf(map);
    if (this.pending || map.regions || !this.shows) return null;
    return low < high ? { low, high, colors: Array.from({ length: BAR_COLORS }, (_, i) => hexOf(colorAt(map, low + ((high - low) * (i + 0.5)) / BAR_COLORS))) } : null;
  }

  // The user's own function in the place of the present one.
  edit(map: ColorMap, gesture: string): void {
    const { store } = this.context;
    store.update({ map: { ...map, name: store.state.map?.name ?? `${store.state.preset}, edited` }, range: null }, gesture);
  }

  private unstretched(): ColorMap {
    const { map, preset } = this.context.store.state;
    if (map) return map;
    const known = this.presets.get(this.key(preset));
    if (known === undefined) this.ask(preset);
    const volume = this.context.volume();
    return known ?? ramp(...(volume ? ([volume.range[0], Math.max(volume.range[1], volume.range[0] + 1e-6)] as const) : ([0, 1] as const)));
  }

  // What it is a function of; presets are those of all times. Null: it is not known yet.
  of(): Source | null {
    const volume = this.context.volume();
    return volume && { ...sourceOf(this.context.offers, { ...this.context.store.state, time: "" }), dataset: volume.name };
  }

  private key(preset: string): string { return JSON.stringify([this.of(), preset]); }

  private ask(preset: string): void {
    const source = this.of(), key = this.key(preset);
    if (!source || this.asked.has(key)) return;
    this.asked.add(key);
    this.context.api.transfer(source, preset)
      .then(json => { this.presets.set(key, json === null ? null : parseParaView(json)); this.changed(); })
      .catch(() => { this.asked.delete(key); }); // it is asked again with the next change
  }
}
