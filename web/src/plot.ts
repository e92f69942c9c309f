// The plot of a transfer function over the histogram: values to the right, opacity upwards.
import type { Histogram } from "./api";
import { svg } from "./dom";
import { type ColorMap, colorAt, hexOf, opacityAt } from "./transfer";
import { clamp, rounded } from "./vec";

export const PLOT = { height: 148, top: 11, bottom: 8, side: 11, strip: 14, stripGap: 12 } as const;
const CURVE_STEPS = 160;

export class Scale {
  constructor(readonly domain: readonly [number, number], readonly width: number, readonly height: number = PLOT.height) {}
  x(value: number): number { return PLOT.side + ((value - this.domain[0]) / (this.domain[1] - this.domain[0])) * (this.width - 2 * PLOT.side); }
  value(x: number): number { return rounded(this.domain[0] + (clamp((x - PLOT.side) / (this.width - 2 * PLOT.side), 0, 1)) * (this.domain[1] - this.domain[0])); }
  y(opacity: number): number { return this.height - PLOT.bottom - opacity * (this.height - PLOT.top - PLOT.bottom); }
  opacity(y: number): number { return rounded(clamp((this.height - PLOT.bottom - y) / (this.height - PLOT.top - PLOT.bottom), 0, 1), 3); }
}

// Fewer whole numbers than bins leave bins empty between them, like the teeth of a comb: these get the counts of their left neighbours.
function withoutGaps({ counts, range: [low, high] }: Histogram): number[] {
  const longest = Math.ceil(counts.length / Math.max(high - low, 1)) - 1;
  return counts.map((count, i) => {
    for (let back = 1; count === 0 && back <= longest && i >= back; back++) count = counts[i - back] as number;
    return count;
  });
}

// Logarithms of the counts, as an area.
export function histogramPath(histogram: Histogram, scale: Scale): string {
  const counts = withoutGaps(histogram), [low, high] = histogram.range;
  const most = Math.log1p(counts.reduce((a, b) => Math.max(a, b), 1)), step = (high - low) / counts.length, base = scale.y(0);
  const points = counts.map((count, i) => {
    const y = scale.y((0.96 * Math.log1p(count)) / most).toFixed(1);
    return `L${scale.x(low + i * step).toFixed(1)} ${y}L${scale.x(low + (i + 1) * step).toFixed(1)} ${y}`;
  });
  return `M${scale.x(low).toFixed(1)} ${base}${points.join("")}L${scale.x(high).toFixed(1)} ${base}Z`;
}

export function curvePath(map: ColorMap, scale: Scale): string {
  const [low, high] = scale.domain;
  const xs = Array.from({ length: CURVE_STEPS + 1 }, (_, i) => low + ((high - low) * i) / CURVE_STEPS);
  // Both sides of each point, so that steps are upright.
  for (const { x } of map.opacities) xs.push(x, x - (high - low) * 1e-6);
  return xs.sort((a, b) => a - b).map((x, i) => `${i === 0 ? "M" : "L"}${scale.x(x).toFixed(2)} ${scale.y(opacityAt(map, x)).toFixed(2)}`).join("");
}

// The map's colours from left to right.
export function gradientStops(map: ColorMap, scale: Scale): SVGStopElement[] {
  const [low, high] = scale.domain, width = high - low;
  const inside = map.colors.filter(point => point.x > low && point.x < high);
  const stop = (x: number, color: string): SVGStopElement => svg("stop", { offset: clamp((x - low) / width, 0, 1), "stop-color": color });
  return [stop(low, hexOf(colorAt(map, low))), ...inside.map(p => stop(p.x, hexOf([p.r, p.g, p.b]))), stop(high, hexOf(colorAt(map, high)))];
}
