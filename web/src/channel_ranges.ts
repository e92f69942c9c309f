// The ranges of values of channels, which the picture shows from dark to bright, as far as the page knows them.
import type { LegendEntry } from "./annotations";
import type { Histogram } from "./api";
import { type Channel, colorOf, ownOf, shownChannels, sourceOf, withOwn } from "./channels";
import type { Context } from "./context";
import { shown as text } from "./dom";
import type { Histograms } from "./histograms";
import { rounded } from "./vec";

const DARK = 0.1, BRIGHT = 0.995, LEAST = 1e-6; // shares of the values above the background; of the range of values

// The value below which so many of the voxels from a bin on are.
function quantile({ counts, range: [low, high] }: Histogram, first: number, share: number): number {
  const most = share * counts.slice(first).reduce((a, b) => a + b, 0);
  let sum = 0, bin = first;
  while (bin < counts.length - 1 && (sum += counts[bin] as number) < most) bin++;
  return rounded(low + ((bin + (share > 0.5 ? 1 : 0)) * (high - low)) / counts.length);
}

// Of values above the most frequent one, which mostly is the background.
function usualRange(histogram: Histogram): readonly [number, number] {
  const { counts, range } = histogram, mode = counts.indexOf(Math.max(...counts)) + 1, first = counts.slice(mode).some(count => count > 0) ? mode : 0;
  const low = quantile(histogram, first, DARK), high = quantile(histogram, first, BRIGHT);
  return low < high ? [low, high] : range;
}

export class ChannelRanges {
  constructor(private readonly context: Context, private readonly histograms: Histograms) {}

  histogram(channel: Channel): Histogram | null { return this.histograms.of(sourceOf(this.context.offers, this.context.store.state, channel)); }

  of(channel: Channel): readonly [number, number] {
    return ownOf(this.context.store.state.channelRanges, channel) ?? channel.window ?? this.usual(channel);
  }

  usual(channel: Channel): readonly [number, number] {
    const histogram = this.histogram(channel);
    return histogram ? usualRange(histogram) : this.context.volume()?.range ?? [0, 1];
  }

  // The values to plot: almost all there are, and the range. A few voxels that are much brighter leave no room for the others.
  domain(channel: Channel): readonly [number, number] {
    const histogram = this.histogram(channel), [low, high] = this.of(channel), all = histogram?.range ?? this.context.volume()?.range ?? [0, 1];
    const most = histogram ? Math.min(all[1], 2 * quantile(histogram, 0, 0.9999) - all[0]) : all[1];
    const from = Math.min(all[0], low), to = Math.max(most, high, channel.window?.[1] ?? -Infinity);
    return [from, to > from ? to : from + 1];
  }

  set(channel: Channel, [low, high]: readonly [number, number], gesture: string): void {
    if (low < high) this.context.store.update({ channelRanges: withOwn(this.context.store.state.channelRanges, channel, [rounded(low), rounded(high)] as const) }, gesture);
  }

  // One end moves as far as the other one.
  move(channel: Channel, end: number, value: number): void {
    const [low, high] = this.of(channel), [from, to] = this.domain(channel), least = LEAST * (to - from);
    this.set(channel, end === 0 ? [Math.min(value, high - least), high] : [low, Math.max(value, low + least)], `range ${end} of ${channel.key}`);
  }

  // All that show become wider or narrower, and brighter or darker, as Viewer.window.
  window(widen: number, raise: number): void {
    const { offers, store } = this.context;
    store.update({ channelRanges: shownChannels(offers, store.state).reduce((ranges, channel) => {
      const [low, high] = this.of(channel), width = (high - low) * Math.exp(1.5 * widen), middle = (low + high) / 2 - raise * (high - low);
      return withOwn(ranges, channel, [rounded(middle - width / 2), rounded(middle + width / 2)] as const);
    }, store.state.channelRanges) }, "window");
  }

  legend(): readonly LegendEntry[] {
    const { offers, store: { state } } = this.context;
    return state.colorBar ? shownChannels(offers, state).map(channel => {
      const [low, high] = this.of(channel);
      return { name: `${channel.name}  ${text(low)} to ${text(high)}`, color: colorOf(state, channel) };
    }) : [];
  }
}
