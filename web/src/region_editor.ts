// The editor of two-dimensional transfer functions: regions of values and gradients over their joint histogram.
import type { JointHistogram } from "./api";
import type { Context } from "./context";
import { button, colorField, iconButton, numberField, toggle } from "./controls";
import { h, shown, svg } from "./dom";
import type { FunctionSource } from "./function_source";
import { PLOT } from "./plot";
import { drawMarks, editPoints, onWidth, placeIn } from "./point_gestures";
import { drawPlot, edge, jointImage, outline, RegionScale } from "./region_plot";
import { boundsOf, boxOf, type Corner, FEWEST_CORNERS, isArea, MOST_CORNERS, MOST_REGIONS, type Region } from "./regions";
import { type ColorMap, hexOf, rangeOf, rgbOf } from "./transfer";
import { clamp, rounded } from "./vec";
import { slopeUnit, STEEP, steepestOf } from "./volume";

const COLORS = ["#f2ede4", "#e0b089", "#d98383", "#7fb4d8", "#b99cf0"];
const NEAR_PIXELS = 9;
const KEY_STEP = { value: 1 / 256, share: 0.01 };

interface Selected { region: number; corner: number; whole: boolean } // whole: keys and drags are for the region
interface Joint { image: HTMLCanvasElement; of: JointHistogram }

function regionOf(corners: readonly Corner[], color: string, opacity: number): Region {
  const [r, g, b] = rgbOf(color);
  return { corners, r, g, b, opacity, softness: 0.25 };
}
const hexOfRegion = ({ r, g, b }: Region): string => hexOf([r, g, b]);

export class RegionEditor {
  readonly element: HTMLElement; // in the place of the curves
  readonly switch: HTMLElement;
  private readonly picture = h("canvas", { role: "img", "aria-label": "How often values occur with gradients" });
  private readonly plot = svg("svg", { class: "plot", role: "group", "aria-label": "Regions of values and gradients" });
  private readonly outlines = svg("g");
  private readonly points = svg("g");
  private readonly ticks = svg("g", { class: "ticks" });
  private readonly on = toggle("By value and gradient", on => this.turn(on));
  private readonly value = numberField("Value of the corner", value => this.moveCorner({ value }));
  private readonly slope = numberField("Gradient of the corner", slope => this.moveCorner({ slope: Math.max(0, slope) }));
  private readonly color = colorField("Colour of the region", hex => { const [r, g, b] = rgbOf(hex); this.change({ r, g, b }, "colour"); });
  private readonly opacity = numberField("Opacity of the region", value => this.change({ opacity: clamp(value, 0, 1) }, "opacity"), "0.01");
  private readonly softness = numberField("Softness of the region", value => this.change({ softness: clamp(value, 0, 1) }, "softness"), "0.01");
  private readonly addCornerButton = iconButton("Add a corner", "add", () => this.addCorner(), "Insert");
  private readonly removeCornerButton = iconButton("Remove the corner", "remove", () => this.removeCorner(), "Delete");
  private readonly addButton = button("Add a region", "add", () => this.addRegion(), "quiet");
  private readonly removeButton = button("Remove region", "remove", () => this.removeRegion(), "quiet");
  private readonly hint = h("p", { class: "hint" });
  private selected: Selected = { region: 0, corner: 0, whole: true };
  private grabbed: { at: readonly [number, number]; corners: readonly Corner[] } | null = null; // where a drag of a region began
  private joint: Joint | null = null;
  private asked = ""; // the dataset whose joint histogram was asked for
  private width = 280;

  constructor(private readonly context: Context, private readonly source: FunctionSource) {
    this.plot.append(this.outlines, this.ticks, this.points);
    const frame = h("div", { class: "plot-frame joint" }, this.picture, this.plot);
    const field = (label: string, input: HTMLElement): HTMLElement => h("label", {}, h("span", {}, label), input);
    this.element = h("div", { class: "editor" }, frame,
      h("div", { class: "fields" }, field("Value", this.value.input), field("Gradient", this.slope.input), h("div", { class: "tools-row" }, this.addCornerButton, this.removeCornerButton)),
      h("div", { class: "fields thirds" }, field("Colour", this.color.input), field("Opacity", this.opacity.input), field("Softness", this.softness.input)),
      h("div", { class: "button-row" }, this.addButton, this.removeButton));
    this.switch = h("div", { class: "editor by-region" }, this.on.element, this.hint);
    onWidth(frame, width => { this.width = width; this.refresh(source.current()); });
    editPoints(this.plot, {
      choose: (mark, event) => this.choose(mark, event), dragTo: event => this.drag(event), step: (right, up) => this.step(right, up),
      add: () => (this.selected.whole ? this.addRegion() : this.addCorner()), remove: () => (this.selected.whole ? this.removeRegion() : this.removeCorner()),
    });
    this.plot.addEventListener("dblclick", event => this.insertAt(event));
    context.onVolume(() => { this.joint = null; this.asked = ""; });
  }

  // ---- drawing

  private get regions(): readonly Region[] { return this.source.current().regions ?? []; }
  private get region(): Region | undefined { return this.regions[this.selected.region]; }

  private scale(map: ColorMap = this.source.current()): RegionScale {
    const volume = this.context.volume(), [low, high] = volume?.range ?? rangeOf(map);
    return new RegionScale([low, high > low ? high : low + 1], this.joint?.of.steepest || STEEP * steepestOf(volume), this.width);
  }

  private ask(): void {
    const source = this.source.of(), key = JSON.stringify(source);
    if (!source || this.asked === key) return;
    this.asked = key;
    this.context.api.jointHistogram(source).then(of => {
      if (!of || this.asked !== key) return;
      this.joint = { of, image: jointImage(of) };
      this.refresh(this.source.current());
    }).catch(() => undefined);
  }

  refresh(map: ColorMap): void {
    const regions = map.regions ?? [], on = regions.length > 0, able = this.context.offers.can("regions", this.context.store.state.renderer);
    this.on.set(on);
    this.element.hidden = this.hint.hidden = !on;
    this.switch.hidden = !on && this.context.offers.rendererThatCan("regions") === "";
    this.hint.textContent = able ? `Gradients run upwards, in ${slopeUnit(this.context.volume())}. A double click on an edge adds a corner.` : "Only ray casting shows regions. The picture shows the automatic function instead.";
    if (!on) return;
    this.ask();
    const scale = this.scale(map), { selected } = this;
    selected.region = clamp(selected.region, 0, regions.length - 1);
    const region = regions[selected.region] as Region, { corners } = region;
    selected.corner = clamp(selected.corner, 0, corners.length - 1);
    this.plot.setAttribute("viewBox", `0 0 ${this.width} ${scale.height + 14}`);
    this.plot.setAttribute("height", String(scale.height + 14));
    drawPlot(this.picture, this.joint, regions, scale);
    this.drawTicks(scale);
    this.drawMarks(regions, scale);
    const corner = corners[selected.corner] as Corner;
    this.value.set(corner.value);
    this.slope.set(corner.slope);
    this.color.set(hexOfRegion(region));
    this.opacity.set(region.opacity);
    this.softness.set(region.softness);
    this.addCornerButton.disabled = corners.length >= MOST_CORNERS;
    this.removeCornerButton.disabled = corners.length <= FEWEST_CORNERS;
    this.addButton.disabled = regions.length >= MOST_REGIONS;
    this.removeButton.disabled = regions.length < 2;
  }

  private drawTicks(scale: RegionScale): void {
    const [low, high] = scale.domain, below = scale.height + 11;
    this.ticks.replaceChildren(
      svg("text", { x: scale.x(low), y: below }, shown(low)), svg("text", { x: scale.x(high), y: below, "text-anchor": "end" }, shown(high)),
      svg("text", { x: scale.x(low) + 4, y: PLOT.top + 10 }, `↑ ${shown(scale.steepest, 3)}`));
  }

  private drawMarks(regions: readonly Region[], scale: RegionScale): void {
    const { selected } = this, values = { "aria-valuemin": scale.domain[0], "aria-valuemax": scale.domain[1] };
    const mark = (kind: string, index: number, chosen: boolean): Record<string, string | number> => ({ "data-kind": kind, "data-index": index, class: `${kind}${chosen ? " selected" : ""}` });
    drawMarks(this.outlines, "path", regions.map((region, i) => {
      const { low, high, least, most } = boundsOf(region.corners);
      return {
        ...mark("region", i, i === selected.region), d: outline(region, scale), ...values, "aria-label": `Region ${i + 1}`, "aria-valuenow": rounded((low + high) / 2, 4),
        "aria-valuetext": `values ${shown(low)} to ${shown(high)}, gradients ${shown(least)} to ${shown(most)}`,
      };
    }), path => this.choose(path));
    const region = regions[selected.region] as Region;
    drawMarks(this.points, "circle", region.corners.map((corner, i) => {
      const [cx, cy] = scale.place(corner);
      return {
        ...mark("point", i, i === selected.corner && !selected.whole), cx, cy, r: 5.5, fill: hexOfRegion(region), ...values,
        "aria-label": `Corner ${i + 1}`, "aria-valuenow": corner.value, "aria-valuetext": `value ${shown(corner.value)}, gradient ${shown(corner.slope)}`,
      };
    }), circle => this.choose(circle));
  }

  private choose(mark: SVGElement, event?: PointerEvent): void {
    const index = Number(mark.dataset["index"]), whole = mark.dataset["kind"] === "region";
    this.selected = whole ? { region: index, corner: index === this.selected.region ? this.selected.corner : 0, whole } : { ...this.selected, corner: index, whole };
    if (event) this.grabbed = this.region ? { at: this.placeAt(event), corners: this.region.corners } : null;
    this.refresh(this.source.current());
  }

  // ---- changing

  private edit(regions: readonly Region[], gesture: string): void { this.source.edit({ ...this.source.current(), regions }, gesture); }

  private change(patch: Partial<Region>, what: string): void {
    const { region } = this.selected;
    if (!patch.corners || isArea(patch.corners)) this.edit(this.regions.map((each, i) => (i === region ? { ...each, ...patch } : each)), `region ${region} ${what}`);
  }

  private turn(on: boolean): void {
    const { store, offers } = this.context, { map, preset, renderer } = store.state;
    this.selected = { region: 0, corner: 0, whole: true };
    if (on) return store.update({ map: { ...(map ? this.source.current() : { colors: [], opacities: [] }), name: map?.name ?? "by value and gradient", regions: this.start() }, range: null, ...offers.turnTo("regions", renderer) }, "by value and gradient");
    const { regions: _, ...curves } = map ?? this.source.current();
    store.update({ ...(curves.colors.length > 0 ? { map: curves } : { map: null, preset: offers.hasRegions(preset) ? "auto" : preset }), range: null }, "by value and gradient");
  }

  // Borders of what is bright, and a veil of what is less so.
  private start(): Region[] {
    const steepest = steepestOf(this.context.volume()), slight = rounded(0.05 * STEEP * steepest, 3), [low, high] = this.scale().domain;
    const at = (share: number): number => rounded(low + share * (high - low), 4);
    return [regionOf(boxOf(at(0.25), at(0.5), slight, steepest), COLORS[1] as string, 0.1), regionOf(boxOf(at(0.5), rounded(high), slight, steepest), COLORS[0] as string, 0.8)];
  }

  private moveCorner(to: Partial<Corner>): void {
    const { corner } = this.selected;
    if (this.region) this.change({ corners: this.region.corners.map((old, i) => (i === corner ? { ...old, ...to } : old)) }, `corner ${corner}`);
  }

  // Moves a region in the plot: `up` is a share of the plot's height. No corner goes below 0.
  private moveRegion(corners: readonly Corner[], right: number, up: number): void {
    const scale = this.scale(), rise = Math.max(up, -scale.share(boundsOf(corners).least));
    this.change({ corners: corners.map(({ value, slope }) => ({ value: rounded(value + right), slope: scale.slope(scale.share(slope) + rise) })) }, "moves");
  }

  private addCorner(): void {
    const { region, selected } = this, scale = this.scale(), here = region?.corners[selected.corner], next = region?.corners[(selected.corner + 1) % region.corners.length];
    if (here && next) this.insert(selected.region, selected.corner + 1, { value: rounded((here.value + next.value) / 2), slope: scale.slope((scale.share(here.slope) + scale.share(next.slope)) / 2) });
  }

  private insert(region: number, corner: number, at: Corner): void {
    const corners = this.regions[region]?.corners ?? [];
    if (corners.length >= MOST_CORNERS) return;
    this.selected = { region, corner, whole: false };
    this.change({ corners: [...corners.slice(0, corner), at, ...corners.slice(corner)] }, `insert ${corner} ${at.value}`);
  }

  // At the edge that is nearest to the pointer.
  private insertAt(event: MouseEvent): void {
    const [x, y] = placeIn(this.plot, this.width, event), scale = this.scale();
    const edges = this.regions.flatMap(({ corners }, region) => corners.map((_, i) => ({ region, corner: i + 1, distance: distanceTo(x, y, [...edge(corners, i, scale), scale.place(corners[(i + 1) % corners.length] as Corner)]) })));
    const nearest = edges.reduce((a, b) => (b.distance < a.distance ? b : a));
    if (nearest.distance <= NEAR_PIXELS) this.insert(nearest.region, nearest.corner, scale.corner(x, y));
  }

  private removeCorner(): void {
    const { corner } = this.selected;
    if (this.region) this.change({ corners: this.region.corners.filter((_, i) => i !== corner) }, `remove ${corner}`);
  }

  private addRegion(): void {
    const { regions } = this, scale = this.scale(), [low, high] = scale.domain, at = (share: number): number => rounded(low + share * (high - low), 4);
    if (regions.length >= MOST_REGIONS) return;
    this.selected = { region: regions.length, corner: 0, whole: true };
    this.edit([...regions, regionOf(boxOf(at(0.4), at(0.6), scale.slope(0.3), scale.slope(0.7)), COLORS[regions.length % COLORS.length] as string, 0.5)], `add region ${regions.length}`);
  }

  private removeRegion(): void {
    if (this.regions.length > 1) this.edit(this.regions.filter((_, i) => i !== this.selected.region), `remove region ${this.selected.region}`);
  }

  // ---- pointers and keys

  private placeAt(event: PointerEvent): [number, number] {
    const [x, y] = placeIn(this.plot, this.width, event), scale = this.scale();
    return [scale.value(x), scale.opacity(y)];
  }

  private drag(event: PointerEvent): void {
    const { grabbed, region, selected } = this;
    if (!region) return;
    if (!selected.whole) return this.moveCorner(this.scale().corner(...placeIn(this.plot, this.width, event), region.corners[selected.corner]));
    const [value, share] = this.placeAt(event);
    if (grabbed) this.moveRegion(grabbed.corners, value - grabbed.at[0], share - grabbed.at[1]);
  }

  private step(right: number, up: number): void {
    const scale = this.scale(), [low, high] = scale.domain, by = right * KEY_STEP.value * (high - low), rise = up * KEY_STEP.share;
    const corner = this.region?.corners[this.selected.corner];
    if (this.region && this.selected.whole) this.moveRegion(this.region.corners, by, rise);
    else if (corner) this.moveCorner({ value: rounded(corner.value + by), slope: up === 0 ? corner.slope : scale.slope(scale.share(corner.slope) + rise) });
  }
}

// From a place to a line of places.
function distanceTo(x: number, y: number, line: readonly (readonly [number, number])[]): number {
  return Math.min(...line.slice(1).map(([bx, by], i) => {
    const [ax, ay] = line[i] as readonly [number, number], dx = bx - ax, dy = by - ay, t = clamp(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1), 0, 1);
    return Math.hypot(x - ax - t * dx, y - ay - t * dy);
  }));
}
