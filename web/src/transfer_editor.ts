// The editor of the transfer function: points of opacity in the plot, points of colour in the strip below; or regions in their place.
import type { Histogram } from "./api";
import { channels, sourceOf, takesFunction } from "./channels";
import type { Context } from "./context";
import { button, choice, colorField, iconButton, numberField, slider, undoButtons } from "./controls";
import { copyText, download, h, put, shown, svg } from "./dom";
import type { FunctionSource } from "./function_source";
import type { Histograms } from "./histograms";
import { curvePath, gradientStops, histogramPath, PLOT, Scale } from "./plot";
import { drawMarks, editPoints, onWidth, placeIn } from "./point_gestures";
import { RegionEditor } from "./region_editor";
import { LOOK } from "./state";
import { type ColorMap, colorAt, hexOf, opacityAt, parseParaView, rangeOf, rgbOf, toParaView } from "./transfer";
import { clamp, rounded } from "./vec";

const MOST_BYTES = 1 << 20;

interface Selected { kind: "color" | "opacity"; index: number }
type Kind = Selected["kind"];

export class TransferEditor {
  readonly element: HTMLElement;
  private readonly plot = svg("svg", { class: "plot", role: "group", "aria-label": "Transfer function" });
  private readonly gradient = svg("linearGradient", { id: "function-colors" });
  private readonly bars = svg("path", { class: "histogram" });
  private readonly area = svg("path", { class: "area", fill: "url(#function-colors)" });
  private readonly curve = svg("path", { class: "curve" });
  private readonly strip = svg("rect", { class: "strip", fill: "url(#function-colors)", rx: 3 });
  private readonly points = svg("g");
  private readonly ticks = svg("g", { class: "ticks" });
  private readonly presets = choice("Preset", [], value => this.choosePreset(value));
  private readonly value = numberField("Value of the point", value => this.moveTo(value, null));
  private readonly opacity = numberField("Opacity of the point", value => this.moveTo(null, value), "0.01");
  private readonly color = colorField("Colour of the point", value => this.paint(value));
  private readonly low = numberField("Stretch from", value => this.stretch(value, this.source.range()[1]));
  private readonly high = numberField("Stretch to", value => this.stretch(this.source.range()[0], value));
  private readonly density = slider("Density", -2, 2, 0.05, v => `× ${shown(Math.pow(10, v), 2)}`, v => this.context.store.update({ opacityDistance: rounded(Math.pow(10, -v), 4) }, "density"));
  private readonly note = h("p", { class: "hint" });
  private readonly undo = undoButtons(this.context.store);
  private readonly addButton = iconButton("Add a point of opacity", "add", () => this.add(), "Insert");
  private readonly removeButton = iconButton("Remove the point", "remove", () => this.remove(), "Delete");
  private readonly frame = h("div", { class: "plot-frame" }, this.plot);
  private readonly regions: RegionEditor;
  private readonly pointFields: HTMLElement;
  private readonly stretchFields: HTMLElement;
  private selected: Selected = { kind: "opacity", index: 0 };
  private width = 280;

  constructor(private readonly context: Context, private readonly source: FunctionSource, private readonly histograms: Histograms) {
    this.plot.append(svg("defs", {}, this.gradient), this.bars, this.area, this.curve, this.ticks, this.strip, this.points);
    const file = h("input", { type: "file", accept: ".json,application/json", class: "offscreen", tabindex: -1, "aria-label": "Colour map", onchange: () => { const chosen = file.files?.[0]; if (chosen) void this.open(chosen); file.value = ""; } });
    this.pointFields = h("div", { class: "fields" },
      h("label", {}, h("span", {}, "Value"), this.value.input), h("label", { class: "of-opacity" }, h("span", {}, "Opacity"), this.opacity.input), h("label", { class: "of-color" }, h("span", {}, "Colour"), this.color.input));
    this.stretchFields = h("div", { class: "fields" }, h("label", {}, h("span", {}, "From"), this.low.input), h("label", {}, h("span", {}, "To"), this.high.input), button("Whole range", null, () => this.wholeRange(), "quiet"));
    this.regions = new RegionEditor(context, source);
    this.element = h("div", { class: "editor" }, this.presets.element, this.frame, this.note, this.pointFields, this.regions.element,
      h("div", { class: "tools-row" }, ...this.undo.elements, this.addButton, this.removeButton, h("span", { class: "space" }),
        iconButton("Open a colour map", "open", () => file.click()), iconButton("Save as a file", "save", () => this.save()), iconButton("Copy for --transfer", "copy", () => void this.copy()), file),
      this.stretchFields, this.density.element, this.regions.switch);
    onWidth(this.frame, width => { this.width = width; this.refresh(); });
    editPoints(this.plot, {
      choose: circle => this.focusOn(circle), insertAt: event => this.insertAt(event), dragTo: event => this.drag(event),
      step: (right, up) => this.step(right, up), add: () => this.add(), remove: () => this.remove(),
    });
    context.onVolume(() => this.refresh());
    histograms.onChange(() => this.refresh());
    context.store.subscribe(() => this.refresh(), LOOK);
  }

  async open(file: File): Promise<void> {
    try {
      if (file.size > MOST_BYTES) throw new Error("it is larger than 1 MiB");
      const map = parseParaView(JSON.parse(await file.text()));
      this.context.store.update({ map, range: null, ...this.rendererFor(map.regions !== undefined) }, "open");
      this.context.say(`Colour map “${map.name}”`);
    } catch (error) {
      this.context.say(`${file.name}: ${error instanceof Error ? error.message : "it cannot be read"}`, "error");
    }
  }

  refresh(): void {
    const { offers, store: { state } } = this.context, map = this.source.current(), custom = state.map !== null, { pending } = this.source;
    this.presets.fill([...this.context.offers.presetChoices(), ...(custom ? [["", `${state.map?.name ?? ""} (own)`] as const] : [])]);
    this.presets.set(custom ? "" : state.preset);
    for (const part of [this.frame, this.pointFields, this.addButton, this.removeButton]) part.hidden = map.regions !== undefined;
    for (const part of [this.pointFields, this.stretchFields]) put(part, "data-pending", pending);
    if (pending) this.drawNothing();
    else if (!map.regions) this.drawCurves(map);
    this.regions.refresh(map);
    this.regions.switch.hidden = pending;
    this.note.textContent = pending ? "The function shows once the dataset is read." : this.source.untold ? "This gateway does not send the points of a preset. Editing begins with a ramp." : takesFunction(offers, state) && !this.source.shows && channels(offers)?.length ? "The channel has its colour. A function that you choose or change here takes its place." : "";
    this.note.hidden = this.note.textContent === "";
    const [low, high] = this.source.range();
    this.low.set(low);
    this.high.set(high);
    this.density.set(-Math.log10(state.opacityDistance));
    this.undo.refresh();
  }

  // ---- drawing

  // No curve is made up before its points are known.
  private drawNothing(): void {
    for (const path of [this.bars, this.area, this.curve]) path.setAttribute("d", "");
    for (const part of [this.ticks, this.points, this.gradient]) part.replaceChildren();
  }

  private drawCurves(map: ColorMap): void {
    const scale = this.scale(map), height = PLOT.height + PLOT.stripGap + PLOT.strip + 26;
    this.plot.setAttribute("viewBox", `0 0 ${this.width} ${height}`);
    this.plot.setAttribute("height", String(height));
    const { histogram } = this;
    this.bars.setAttribute("d", histogram ? histogramPath(histogram, scale) : "");
    const path = curvePath(map, scale);
    this.curve.setAttribute("d", path);
    this.area.setAttribute("d", `${path}L${scale.x(scale.domain[1])} ${scale.y(0)}L${scale.x(scale.domain[0])} ${scale.y(0)}Z`);
    this.gradient.replaceChildren(...gradientStops(map, scale));
    const stripY = PLOT.height + PLOT.stripGap;
    for (const [name, value] of Object.entries({ x: PLOT.side, y: stripY, width: this.width - 2 * PLOT.side, height: PLOT.strip })) this.strip.setAttribute(name, String(value));
    this.ticks.replaceChildren(...([[scale.domain[0], "start"], [scale.domain[1], "end"]] as const).map(([value, anchor]) =>
      svg("text", { x: scale.x(value), y: stripY + PLOT.strip + 20, "text-anchor": anchor }, shown(value))));
    this.drawPoints(map, scale, stripY);
  }

  private get histogram(): Histogram | null { return this.histograms.of(sourceOf(this.context.offers, this.context.store.state)); }

  private scale(map: ColorMap): Scale {
    const volume = this.context.volume(), [low, high] = rangeOf(map);
    const range = this.histogram?.range ?? volume?.range ?? [low, high];
    const domain: [number, number] = [Math.min(range[0], low), Math.max(range[1], high)];
    if (domain[1] <= domain[0]) domain[1] = domain[0] + 1;
    return new Scale(domain, this.width);
  }

  private drawPoints(map: ColorMap, scale: Scale, stripY: number): void {
    const list = this.listOf(map, this.selected.kind);
    this.selected.index = clamp(this.selected.index, 0, list.length - 1);
    drawMarks(this.points, "circle", [...map.opacities, ...map.colors].map((_, i) => {
      const kind: Kind = i < map.opacities.length ? "opacity" : "color", index = kind === "opacity" ? i : i - map.opacities.length;
      const opacity = map.opacities[index], color = map.colors[index];
      const x = kind === "opacity" ? opacity?.x ?? 0 : color?.x ?? 0, y = kind === "opacity" ? scale.y(opacity?.y ?? 0) : stripY + PLOT.strip / 2;
      return {
        cx: scale.x(x), cy: y, r: kind === "opacity" ? 5.5 : 5, "data-kind": kind, "data-index": index, fill: hexOf(colorAt(map, x)),
        class: `point ${kind}${this.selected.kind === kind && this.selected.index === index ? " selected" : ""}`,
        "aria-label": kind === "opacity" ? `Opacity point ${index + 1}` : `Colour point ${index + 1}`, "aria-valuenow": rounded(x, 4), "aria-valuemin": scale.domain[0], "aria-valuemax": scale.domain[1],
        "aria-valuetext": kind === "opacity" ? `opacity ${shown(opacity?.y ?? 0, 2)} at ${shown(x)}` : `${hexOf(colorAt(map, x))} at ${shown(x)}`,
      };
    }), circle => this.focusOn(circle));
    const { kind, index } = this.selected, opacity = map.opacities[index], color = map.colors[index];
    this.value.set((kind === "opacity" ? opacity?.x : color?.x) ?? 0);
    if (opacity) this.opacity.set(opacity.y);
    if (color) this.color.set(hexOf([color.r, color.g, color.b]));
    this.pointFields.dataset["kind"] = kind;
    this.removeButton.disabled = list.length < 2;
  }

  private listOf(map: ColorMap, kind: Kind): readonly { x: number }[] { return kind === "opacity" ? map.opacities : map.colors; }

  private focusOn(circle: SVGElement): void {
    this.selected = { kind: circle.dataset["kind"] as Kind, index: Number(circle.dataset["index"]) };
    this.refresh();
  }

  // ---- changing

  private edit(map: ColorMap, gesture: string): void { if (!this.source.pending) this.source.edit(map, gesture); }
  private rendererFor(regions: boolean): { renderer?: string } { return regions ? this.context.offers.turnTo("regions", this.context.store.state.renderer) : {}; }

  private moveTo(x: number | null, y: number | null): void {
    const map = this.source.current(), { kind, index } = this.selected, list = this.listOf(map, kind);
    const bounded = (old: number): number => rounded(clamp(x ?? old, list[index - 1]?.x ?? -Infinity, list[index + 1]?.x ?? Infinity));
    if (kind === "opacity") this.edit({ ...map, opacities: map.opacities.map((p, i) => (i === index ? { ...p, x: bounded(p.x), y: clamp(y ?? p.y, 0, 1) } : p)) }, `point ${kind} ${index}`);
    else this.edit({ ...map, colors: map.colors.map((p, i) => (i === index ? { ...p, x: bounded(p.x) } : p)) }, `point ${kind} ${index}`);
  }

  private paint(hex: string): void {
    const map = this.source.current(), [r, g, b] = rgbOf(hex);
    this.edit({ ...map, colors: map.colors.map((p, i) => (i === this.selected.index ? { ...p, r, g, b } : p)) }, `paint ${this.selected.index}`);
  }

  private insert(kind: Kind, x: number, y: number): void {
    const map = this.source.current(), list = this.listOf(map, kind);
    const after = list.findIndex(point => point.x > x), index = after < 0 ? list.length : after;
    this.selected = { kind, index };
    if (kind === "opacity") this.edit({ ...map, opacities: [...map.opacities.slice(0, index), { x, y, mid: 0.5, sharp: 0 }, ...map.opacities.slice(index)] }, `insert ${index} ${x}`);
    else {
      const [r, g, b] = colorAt(map, x);
      this.edit({ ...map, colors: [...map.colors.slice(0, index), { x, r: rounded(r, 4), g: rounded(g, 4), b: rounded(b, 4) }, ...map.colors.slice(index)] }, `insert color ${index} ${x}`);
    }
  }

  // Half way to the next point of the chosen one.
  private add(): void {
    const map = this.source.current(), { kind, index } = this.selected, list = this.listOf(map, kind), scale = this.scale(map);
    const here = list[index]?.x ?? scale.domain[0], next = list[index + 1]?.x ?? scale.domain[1], x = rounded((here + next) / 2);
    this.insert(kind, x, rounded(opacityAt(map, x), 3));
  }

  private remove(): void {
    const map = this.source.current(), { kind, index } = this.selected;
    if (this.listOf(map, kind).length < 2) return;
    if (kind === "opacity") this.edit({ ...map, opacities: map.opacities.filter((_, i) => i !== index) }, `remove ${index}`);
    else this.edit({ ...map, colors: map.colors.filter((_, i) => i !== index) }, `remove ${index}`);
  }

  private choosePreset(preset: string): void {
    if (preset) this.context.store.update({ preset, map: null, range: null, ...this.rendererFor(this.context.offers.hasRegions(preset)) }, "preset");
  }

  stretch(low: number, high: number): void {
    if (low < high) this.context.store.update({ range: [rounded(low), rounded(high)] }, "stretch");
  }

  private wholeRange(): void {
    const volume = this.context.volume();
    if (volume && volume.range[0] < volume.range[1]) this.context.store.update({ range: [volume.range[0], volume.range[1]] }, "range");
  }

  private json(): string { return `${JSON.stringify(toParaView(this.source.current()), null, 1)}\n`; }
  private save(): void { download("transfer.json", new Blob([this.json()], { type: "application/json" })); }
  private async copy(): Promise<void> {
    await copyText(this.json());
    this.context.say("The function is copied. Save it as a file for --transfer.");
  }

  // ---- pointers and keys

  private insertAt(event: PointerEvent): void {
    const [x, y] = placeIn(this.plot, this.width, event), scale = this.scale(this.source.current());
    this.insert(y > PLOT.height + PLOT.stripGap / 2 ? "color" : "opacity", scale.value(x), scale.opacity(y));
  }

  private drag(event: PointerEvent): void {
    const [x, y] = placeIn(this.plot, this.width, event), scale = this.scale(this.source.current());
    this.moveTo(scale.value(x), this.selected.kind === "opacity" ? scale.opacity(y) : null);
  }

  private step(right: number, up: number): void {
    const map = this.source.current(), { kind, index } = this.selected, [low, high] = this.scale(map).domain;
    if (right !== 0) this.moveTo((this.listOf(map, kind)[index]?.x ?? low) + (right * (high - low)) / 256, null);
    if (up !== 0 && kind === "opacity") this.moveTo(null, rounded((map.opacities[index]?.y ?? 0) + 0.01 * up, 3));
  }
}
