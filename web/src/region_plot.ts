// The plot of regions over the joint histogram: values to the right, slopes upwards.
import type { JointHistogram } from "./api";
import { h } from "./dom";
import { PLOT, Scale } from "./plot";
import { type Corner, opacityIn, type Region } from "./regions";
import { clamp, rounded } from "./vec";

const HEIGHT = 196;
const EDGE_STEPS = 16;
const GREY = [118, 127, 136] as const; // on dark and on light ground

// Heights are square roots of slopes, so that slight ones have room. What lies beyond the plot is shown on its border.
export class RegionScale extends Scale {
  constructor(domain: readonly [number, number], readonly steepest: number, width: number) { super(domain, width, HEIGHT); }
  get inner(): [number, number] { return [this.width - 2 * PLOT.side, this.height - PLOT.top - PLOT.bottom]; }
  share(slope: number): number { return Math.sqrt(slope / this.steepest); }
  slope(share: number): number { return rounded(Math.max(share, 0) ** 2 * this.steepest); }
  place({ value, slope }: Corner): [number, number] { return [this.x(clamp(value, ...this.domain)), this.y(clamp(this.share(slope), 0, 1))]; }

  // At a place of the plot; a corner that was beyond the border stays there as long as it is on the border.
  corner(x: number, y: number, was?: Corner): Corner {
    const bounded = (now: number, low: number, high: number, old = now): number => (now <= low ? Math.min(old, now) : now >= high ? Math.max(old, now) : now);
    const [low, high] = this.domain;
    return { value: bounded(this.value(x), rounded(low), rounded(high), was?.value), slope: bounded(this.slope(this.opacity(y)), 0, rounded(this.steepest), was?.slope) };
  }
}

// Places on the edge that begins at a corner: a curve, since an edge is straight where slopes are not square roots.
export function edge(corners: readonly Corner[], index: number, scale: RegionScale): [number, number][] {
  const a = corners[index] as Corner, b = corners[(index + 1) % corners.length] as Corner, from = scale.share(a.slope), to = scale.share(b.slope);
  return Array.from({ length: EDGE_STEPS }, (_, i) => {
    const u = i / EDGE_STEPS, slope = (from + (to - from) * u) ** 2 * scale.steepest, t = a.slope === b.slope ? u : (slope - a.slope) / (b.slope - a.slope);
    return scale.place({ value: a.value + (b.value - a.value) * t, slope });
  });
}

export const outline = ({ corners }: Region, scale: RegionScale): string =>
  `M${corners.flatMap((_, i) => edge(corners, i, scale)).map(place => place.map(n => n.toFixed(1)).join(" ")).join("L")}Z`;

function painted(width: number, height: number, paint: (column: number, row: number, rgba: (r: number, g: number, b: number, a: number) => void) => void): HTMLCanvasElement {
  const canvas = h("canvas", { width, height }), drawing = canvas.getContext("2d") as CanvasRenderingContext2D, image = drawing.createImageData(width, height);
  for (let row = 0; row < height; row++) for (let column = 0; column < width; column++) {
    paint(column, row, (r, g, b, a) => image.data.set([r, g, b, 255 * a], 4 * (row * width + column)));
  }
  drawing.putImageData(image, 0, 0);
  return canvas;
}

// Logarithms of the counts.
export function jointImage({ values, slopes, counts }: JointHistogram): HTMLCanvasElement {
  const most = Math.log1p(counts.reduce((a, b) => Math.max(a, b), 1));
  return painted(values, slopes, (value, row, rgba) => rgba(...GREY, Math.log1p(counts[value * slopes + slopes - 1 - row] ?? 0) / most));
}

// Slight opacities are shown stronger than they are.
function regionImage(region: Region, scale: RegionScale): HTMLCanvasElement {
  const [width, height] = scale.inner, [low, high] = scale.domain, opacity = opacityIn(region);
  return painted(width, height, (column, row, rgba) => {
    const value = low + ((column + 0.5) / width) * (high - low), share = 1 - (row + 0.5) / height;
    rgba(255 * region.r, 255 * region.g, 255 * region.b, 0.85 * Math.sqrt(opacity(value, share * share * scale.steepest)));
  });
}

export function drawPlot(canvas: HTMLCanvasElement, joint: { image: HTMLCanvasElement; of: JointHistogram } | null, regions: readonly Region[], scale: RegionScale): void {
  [canvas.width, canvas.height] = scale.inner;
  const drawing = canvas.getContext("2d") as CanvasRenderingContext2D;
  if (joint) {
    const [low, high] = joint.of.range.map(value => scale.x(value) - PLOT.side) as [number, number], top = canvas.height * scale.share(joint.of.steepest);
    if (high > low && top > 0) drawing.drawImage(joint.image, low, canvas.height - top, high - low, top);
  }
  for (const region of regions) drawing.drawImage(regionImage(region, scale), 0, 0);
}
