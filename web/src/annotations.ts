// What the page draws over a picture, from the picture's geometry: scale bar, axes, a patient's sides, the cross-hair.
// It lies over the picture, so the pixels below stay those of the service.
import { project } from "./camera";
import { put, shown as text, svg } from "./dom";
import { BOX_EDGES, cornersOfBox } from "./measure";
import type { DrawnMeasure } from "./measuring";
import type { Geometry } from "./session";
import { pageGeometry, type Shown } from "./shown";
import { AXES, AXIS_NAMES, dot, sub, type Vec3 } from "./vec";
import { unitName } from "./volume";

// Whether dark lines stand out better on it (WCAG 2.2, relative luminance).
function isLight([r, g, b]: readonly [number, number, number, number]): boolean {
  const linear = (c: number): number => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
  return 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b) > 0.18;
}

const AXIS_DIRECTIONS: readonly Vec3[] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

// 1, 2 or 5 times a power of ten, as near as possible to a fifth of the width.
function roundLength(length: number): number {
  const power = Math.pow(10, Math.floor(Math.log10(length)));
  return [1, 2, 5, 10].map(n => n * power).reduce((best, n) => (Math.abs(Math.log(n / length)) < Math.abs(Math.log(best / length)) ? n : best));
}

function scaleBar(geometry: Geometry, width: number, height: number): SVGElement {
  const length = roundLength((geometry.pixel_size * Math.min(width, 700)) / 5), pixels = length / geometry.pixel_size;
  const right = width - 16, left = right - pixels, y = height - 18;
  const note = geometry.projection === "perspective" ? " at the centre" : "";
  return svg("g", { class: "scale-bar" },
    svg("path", { d: `M${left} ${y - 4}v8M${left} ${y}H${right}M${right} ${y - 4}v8`, class: "halo" }),
    svg("path", { d: `M${left} ${y - 4}v8M${left} ${y}H${right}M${right} ${y - 4}v8` }),
    svg("text", { x: (left + right) / 2, y: y - 8, "text-anchor": "middle" }, `${text(length)} ${unitName(geometry.unit)}${note}`));
}

function axesMarker(geometry: Geometry, height: number): SVGElement {
  const radius = 26, x = 16 + radius + 6, y = height - 16 - radius - 6;
  const names = geometry.world === "patient" ? ["R", "A", "S"] : ["x", "y", "z"];
  const arrows = AXES.map(axis => {
    const direction = AXIS_DIRECTIONS[axis] as Vec3;
    return { axis, dx: dot(direction, geometry.right) * radius, dy: -dot(direction, geometry.up) * radius, depth: dot(direction, geometry.forward) };
  }).sort((a, b) => b.depth - a.depth);
  return svg("g", { class: "axes", transform: `translate(${x} ${y})` }, ...arrows.map(({ axis, dx, dy, depth }) => {
    const long = Math.hypot(dx, dy);
    const group = svg("g", { class: `axis axis-${AXIS_NAMES[axis]}` });
    if (long < 4) group.append(svg("circle", { r: depth < 0 ? 3.5 : 2 }));
    else {
      const ux = dx / long, uy = dy / long, head = 5;
      group.append(svg("path", { d: `M0 0L${dx} ${dy}`, class: "halo" }), svg("path", { d: `M0 0L${dx} ${dy}M${dx - ux * head - uy * head * 0.6} ${dy - uy * head + ux * head * 0.6}L${dx} ${dy}L${dx - ux * head + uy * head * 0.6} ${dy - uy * head - ux * head * 0.6}` }));
      if (long > 10) group.append(svg("text", { x: dx + ux * 8, y: dy + uy * 8, "text-anchor": "middle", "dominant-baseline": "central" }, names[axis] as string));
    }
    return group;
  }));
}

// The name of an edge, as radiologists give it: in oblique views the nearest side comes first, and sides within 10 degrees of a right angle are left out.
function sideName(direction: Vec3): string {
  const sides = ["RL", "AP", "SI"].map((pair, i) => ({ name: pair[(direction[i] as number) > 0 ? 0 : 1] as string, share: Math.abs(direction[i] as number) }));
  return sides.filter(side => side.share > Math.sin(Math.PI / 18)).sort((a, b) => b.share - a.share).slice(0, 2).map(side => side.name).join("");
}

// The names of the left, right, upper and lower edge.
function sideNames({ right, up }: Geometry): readonly string[] {
  const opposite = (v: Vec3): Vec3 => [-v[0], -v[1], -v[2]];
  return [opposite(right), right, up, opposite(up)].map(sideName);
}

function patientSides(geometry: Geometry, width: number, height: number): SVGElement {
  const places = [[14, height / 2, "start"], [width - 14, height / 2, "end"], [width / 2, 18, "middle"], [width / 2, height - 18, "middle"]] as const;
  return svg("g", { class: "sides" }, ...sideNames(geometry).map((name, i) => {
    const [x, y, anchor] = places[i] as (typeof places)[number];
    return svg("text", { x, y, "text-anchor": anchor, "dominant-baseline": "central" }, name);
  }));
}

function crosshair(geometry: Geometry, width: number, height: number, { at, lines }: Crosshair): SVGElement {
  const [x, y] = project(geometry, width, height, at), gap = 8, reach = lines ? Math.max(width, height) : 18;
  return svg("path", { class: "crosshair", d: `M${x - reach} ${y}H${x - gap}M${x + gap} ${y}H${x + reach}M${x} ${y - reach}V${y - gap}M${x} ${y + gap}V${y + reach}` });
}

const LETTER = 8; // pixels across, on average

// A slice through this point, half as thick on either side.
interface Cut { at: Vec3; half: number }

// A measurement, as lines between points of the page. In a slice those that lie beside it are faint.
function drawnMeasure(geometry: Geometry, width: number, height: number, { measure, label }: DrawnMeasure, slice: Cut | undefined): SVGElement {
  const { kind, points } = measure, corners = kind === "box" ? cornersOfBox(measure) : points;
  const at = corners.map(p => project(geometry, width, height, p));
  let beside = false;
  if (slice) {
    const depths = corners.map(p => dot(sub(p, slice.at), geometry.forward));
    beside = kind === "box" ? Math.min(...depths) > slice.half || Math.max(...depths) < -slice.half : depths.some(depth => Math.abs(depth) > slice.half);
  }
  const line = (indices: readonly number[]): string => indices.map((index, i) => `${i === 0 ? "M" : "L"}${(at[index] as number[]).map(c => c.toFixed(1)).join(" ")}`).join("");
  const path = kind === "box" ? BOX_EDGES.map(line).join("") : line(points.map((_, i) => i));
  const [x, y] = kind === "angle" ? at[Math.min(1, at.length - 1)] as [number, number] : kind === "box" ? [Math.max(...at.map(p => p[0])), Math.min(...at.map(p => p[1]))] : at[at.length - 1] as [number, number];
  const fits = x + 8 + LETTER * label.length < width;
  return svg("g", { class: `measure${beside ? " beside" : ""}` }, svg("path", { d: path, class: "halo" }), svg("path", { d: path }),
    ...(kind === "box" ? [] : at.map(([cx, cy]) => svg("circle", { cx, cy, r: 3 }))), ...(beside ? [] : [svg("text", { x: fits ? x + 8 : x - 8, y: y - 6, "text-anchor": fits ? "start" : "end" }, label)]));
}

const LEGEND_ROW = 18, LEGEND_MOST = 14;

function legendOf(labels: readonly LegendEntry[], width: number, height: number): SVGElement {
  const room = Math.max(1, Math.min(LEGEND_MOST, Math.floor((height - 120) / LEGEND_ROW)));
  const rows = labels.length > room ? labels.slice(0, room - 1) : labels, left = width - 16;
  const line = (i: number, name: string, color: string): SVGElement => svg("g", {},
    ...(color ? [svg("rect", { x: left - 10, y: 16 + i * LEGEND_ROW, width: 10, height: 10, rx: 2, fill: color })] : []), svg("text", { x: left - 16, y: 25 + i * LEGEND_ROW, "text-anchor": "end" }, name));
  return svg("g", { class: "label-legend" }, ...rows.map(({ name, color }, i) => line(i, name.length > 28 ? `${name.slice(0, 27)}…` : name, color)),
    ...(rows.length < labels.length ? [line(rows.length, `and ${labels.length - rows.length} more`, "")] : []));
}

const BAR = { width: 12, right: 44, top: 0.2, bottom: 64, least: 80 } as const;

// Values for ticks: some four multiples of 1, 2 or 5 times a power of ten.
function ticksOf({ low, high }: ColorBar): number[] {
  const step = roundLength((high - low) / 4), first = Math.ceil(low / step - 1e-9);
  return Array.from({ length: Math.max(0, Math.floor(high / step + 1e-9) - first + 1) }, (_, i) => (first + i) * step);
}

// Values upwards. `above`: what the legend takes.
function colorBar(bar: ColorBar, width: number, height: number, above: number): SVGElement {
  const top = Math.max(height * BAR.top, above + 24), long = height - BAR.bottom - top, x = width - BAR.right - BAR.width, { colors, low, high } = bar;
  if (long < BAR.least) return svg("g");
  const y = (value: number): number => top + long * (1 - (value - low) / (high - low)), step = long / colors.length;
  return svg("g", { class: "color-bar" }, ...colors.map((color, i) => svg("rect", { x, y: top + long - (i + 1) * step, width: BAR.width, height: step + 0.5, fill: color })),
    svg("rect", { x, y: top, width: BAR.width, height: long, class: "frame" }),
    ...ticksOf(bar).flatMap(value => [svg("path", { d: `M${x - 5} ${y(value)}h5` }), svg("text", { x: x - 8, y: y(value), "text-anchor": "end", "dominant-baseline": "central" }, text(value))]));
}

export interface ColorBar { low: number; high: number; colors: readonly string[] } // low < high; evenly spread, from low to high
export interface LegendEntry { name: string; color: string }
interface Crosshair { at: Vec3; lines: boolean }
export interface Annotations {
  marker: boolean; scaleBar: boolean; sides: boolean; crosshair: Crosshair | null; measures: readonly DrawnMeasure[]; legend: readonly LegendEntry[];
  bar?: ColorBar | null;
  slice?: Cut; // measurements beside it are faint
}

// Lies over a pane. While a view turns, most of it stays; only the parts that change are made anew.
export class Drawing {
  readonly element = svg("svg", { class: "drawing", "aria-hidden": "true" });
  private readonly parts = new Map<string, { of: string; place: SVGElement }>();

  draw(shown: Shown, which: Annotations): void {
    const { cssWidth: width, cssHeight: height } = shown, geometry = pageGeometry(shown), { right, up, forward, world, pixel_size, projection, unit } = geometry;
    put(this.element, "viewBox", `0 0 ${width} ${height}`);
    put(this.element, "data-ground", isLight(shown.frame.header.background) ? "light" : "dark");
    this.part("crosshair", which.crosshair && [project(geometry, width, height, which.crosshair.at), which.crosshair.lines, width, height], () => crosshair(geometry, width, height, which.crosshair as Crosshair));
    const placed = which.measures.length > 0 && which.measures.map(each => [each, each.measure.points.map(p => project(geometry, width, height, p))]);
    this.part("measures", placed && [placed, which.slice], () => svg("g", {}, ...which.measures.map(each => drawnMeasure(geometry, width, height, each, which.slice))));
    this.part("legend", which.legend.length > 0 && width > 320 && [which.legend, width, height], () => legendOf(which.legend, width, height));
    const rows = width > 320 ? Math.min(which.legend.length, LEGEND_MOST) : 0;
    this.part("bar", which.bar && width > 240 && [which.bar, rows, width, height], () => colorBar(which.bar as ColorBar, width, height, rows * LEGEND_ROW));
    this.part("sides", which.sides && world === "patient" && [sideNames(geometry), width, height], () => patientSides(geometry, width, height));
    this.part("axes", which.marker && height > 160 && [right, up, forward, world, height], () => axesMarker(geometry, height));
    this.part("scale", which.scaleBar && width > 160 && [pixel_size, projection, unit, width, height], () => scaleBar(geometry, width, height));
  }

  // `of`: what the part is made from; false, null or undefined: there is none.
  private part(name: string, of: readonly unknown[] | false | null | undefined, make: () => SVGElement): void {
    let part = this.parts.get(name);
    if (!part) {
      part = { of: "", place: svg("g") };
      this.parts.set(name, part);
      this.element.append(part.place);
    }
    const text = of ? JSON.stringify(of) : "";
    if (part.of === text) return;
    part.of = text;
    part.place.replaceChildren(...(of ? [make()] : []));
  }
}
