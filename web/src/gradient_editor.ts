// The editor of gradient opacity: a curve of factors of opacity over the gradient's magnitude, as --gradient-opacity takes it.
import { type Context, follow } from "./context";
import { iconButton, numberField, toggle } from "./controls";
import { h, shown, svg } from "./dom";
import { Scale } from "./plot";
import { drawMarks, editPoints, onWidth, placeIn } from "./point_gestures";
import { LOOK, type SlopePoint } from "./state";
import { clamp, rounded } from "./vec";
import { slopeUnit, STEEP, steepestOf } from "./volume";

const HEIGHT = 92;
const KEY_STEPS = 100;

export class GradientEditor {
  readonly element: HTMLElement;
  private readonly plot = svg("svg", { class: "plot", role: "group", "aria-label": "Gradient opacity" });
  private readonly area = svg("path", { class: "area plain" });
  private readonly curve = svg("path", { class: "curve" });
  private readonly points = svg("g");
  private readonly ticks = svg("g", { class: "ticks" });
  private readonly on = toggle("By gradient", on => this.switch(on));
  private readonly slope = numberField("Gradient of the point", value => this.moveTo(value, null));
  private readonly opacity = numberField("Factor of the point", value => this.moveTo(null, value), "0.01");
  private readonly removeButton = iconButton("Remove the point of the gradient", "remove", () => this.remove(), "Delete");
  private readonly hint = h("p", { class: "hint" });
  private readonly body: HTMLElement;
  private selected = 0;
  private width = 280;

  constructor(private readonly context: Context) {
    this.plot.append(this.area, this.curve, this.ticks, this.points);
    this.body = h("div", { class: "editor" }, h("div", { class: "plot-frame" }, this.plot),
      h("div", { class: "fields" }, h("label", {}, h("span", {}, "Gradient"), this.slope.input), h("label", {}, h("span", {}, "Factor"), this.opacity.input),
        h("div", { class: "tools-row" }, iconButton("Add a point to the gradient", "add", () => this.add(), "Insert"), this.removeButton)));
    this.element = h("div", { class: "editor by-gradient" }, this.on.element, this.hint, this.body);
    onWidth(this.plot.parentElement as HTMLElement, width => { this.width = width; this.refresh(); });
    editPoints(this.plot, {
      choose: circle => this.choose(Number(circle.dataset["index"])), insertAt: event => this.insert(...this.at(event)), dragTo: event => this.moveTo(...this.at(event)),
      step: (right, up) => this.step(right, up), add: () => this.add(), remove: () => this.remove(),
    });
    follow(context, LOOK, () => this.refresh());
  }

  // ---- drawing

  private get list(): readonly SlopePoint[] { return this.context.store.state.slopes; }

  private scale(): Scale {
    const steep = STEEP * steepestOf(this.context.volume());
    return new Scale([0, Math.max(rounded(steep, 2), this.list[this.list.length - 1]?.slope ?? 0)], this.width, HEIGHT);
  }

  private refresh(): void {
    const { list } = this, { state } = this.context.store, on = list.length > 0, able = this.context.offers.can("gradient-opacity", state.renderer);
    this.on.set(on);
    this.body.hidden = !on;
    this.hint.hidden = !on;
    this.hint.textContent = able ? `Opacity is multiplied by this factor. Gradients are in ${slopeUnit(this.context.volume())}.` : "Only ray casting shows opacity by the gradient.";
    if (!on) return;
    const scale = this.scale(), first = list[0] as SlopePoint, last = list[list.length - 1] as SlopePoint;
    this.selected = clamp(this.selected, 0, list.length - 1);
    this.plot.setAttribute("viewBox", `0 0 ${this.width} ${HEIGHT + 14}`);
    this.plot.setAttribute("height", String(HEIGHT + 14));
    const path = `M${scale.x(0)} ${scale.y(first.opacity)}${list.map(p => `L${scale.x(p.slope)} ${scale.y(p.opacity)}`).join("")}L${scale.x(scale.domain[1])} ${scale.y(last.opacity)}`;
    this.curve.setAttribute("d", path);
    this.area.setAttribute("d", `${path}L${scale.x(scale.domain[1])} ${scale.y(0)}L${scale.x(0)} ${scale.y(0)}Z`);
    this.ticks.replaceChildren(...([[0, "start"], [scale.domain[1], "end"]] as const).map(([value, anchor]) =>
      svg("text", { x: scale.x(value), y: HEIGHT + 11, "text-anchor": anchor }, shown(value))));
    this.drawPoints(scale);
    const chosen = list[this.selected] as SlopePoint;
    this.slope.set(chosen.slope);
    this.opacity.set(chosen.opacity);
    this.removeButton.disabled = list.length < 2;
  }

  private drawPoints(scale: Scale): void {
    drawMarks(this.points, "circle", this.list.map(({ slope, opacity }, i) => ({
      cx: scale.x(slope), cy: scale.y(opacity), r: 5.5, "data-index": i, class: `point opacity plain${i === this.selected ? " selected" : ""}`,
      "aria-label": `Gradient point ${i + 1}`, "aria-valuenow": slope, "aria-valuemin": 0, "aria-valuemax": scale.domain[1], "aria-valuetext": `factor ${shown(opacity, 2)} at ${shown(slope)}`,
    })), point => this.choose(Number(point.dataset["index"])));
  }

  private choose(index: number): void {
    this.selected = index;
    this.refresh();
  }

  // ---- changing

  private edit(slopes: readonly SlopePoint[], gesture: string): void { this.context.store.update({ slopes }, gesture); }

  private switch(on: boolean): void {
    const { store } = this.context, steep = this.scale().domain[1];
    this.selected = 0;
    if (!on) return this.edit([], "by gradient");
    store.update({ slopes: [{ slope: rounded(steep * 0.05, 3), opacity: 0 }, { slope: rounded(steep * 0.4, 3), opacity: 1 }], ...this.context.offers.turnTo("gradient-opacity", store.state.renderer) }, "by gradient");
  }

  private moveTo(slope: number | null, opacity: number | null): void {
    const { list, selected } = this;
    const bounded = (old: number): number => rounded(clamp(slope ?? old, list[selected - 1]?.slope ?? 0, list[selected + 1]?.slope ?? Infinity));
    this.edit(list.map((p, i) => (i === selected ? { slope: bounded(p.slope), opacity: clamp(opacity ?? p.opacity, 0, 1) } : p)), `gradient point ${selected}`);
  }

  private insert(slope: number, opacity: number): void {
    const { list } = this, after = list.findIndex(point => point.slope > slope), index = after < 0 ? list.length : after;
    this.selected = index;
    this.edit([...list.slice(0, index), { slope, opacity }, ...list.slice(index)], `insert gradient ${index} ${slope}`);
  }

  // Half way to the next point of the chosen one.
  private add(): void {
    const here = this.list[this.selected], next = this.list[this.selected + 1];
    if (here) this.insert(rounded((here.slope + (next?.slope ?? this.scale().domain[1])) / 2), rounded((here.opacity + (next?.opacity ?? here.opacity)) / 2, 3));
  }

  private remove(): void {
    if (this.list.length > 1) this.edit(this.list.filter((_, i) => i !== this.selected), `remove gradient ${this.selected}`);
  }

  // ---- pointers and keys

  private at(event: PointerEvent): [number, number] {
    const [x, y] = placeIn(this.plot, this.width, event), scale = this.scale();
    return [scale.value(x), scale.opacity(y)];
  }

  private step(right: number, up: number): void {
    const point = this.list[this.selected];
    if (right !== 0 && point) this.moveTo(point.slope + (right * this.scale().domain[1]) / KEY_STEPS, null);
    if (up !== 0 && point) this.moveTo(null, rounded(point.opacity + 0.01 * up, 3));
  }
}
