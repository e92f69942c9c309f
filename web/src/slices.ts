// Three slices beside the 3-D picture. Their cross-hair is one point of the world.
import { unproject } from "./camera";
import type { ChannelRanges } from "./channel_ranges";
import { takesFunction } from "./channels";
import type { Context } from "./context";
import { h } from "./dom";
import type { Measuring } from "./measuring";
import { sliceOptions } from "./options";
import { Pane } from "./pane";
import type { Part } from "./saving";
import { pageGeometry, type Shown } from "./shown";
import { add, clamp, dot, rounded, roundedPoint, scale, type Vec3 } from "./vec";
import type { Volume } from "./volume";

const PLANES = { patient: [["axial", "Axial"], ["coronal", "Coronal"], ["sagittal", "Sagittal"]], other: [["z", "Across z"], ["y", "Across y"], ["x", "Across x"]] } as const;

interface Slice { pane: Pane; plane: string; name: string }

export class Slices {
  private slices: Slice[] = [];

  constructor(private readonly context: Context, private readonly stage: HTMLElement, private readonly measuring: Measuring, private readonly ranges: ChannelRanges, private readonly hover: (at: Vec3 | null) => void) {
    measuring.onChange(() => this.slices.forEach(slice => this.annotate(slice)));
    context.store.subscribe(() => this.slices.forEach(slice => this.annotate(slice)), ["crosshair", "scaleBar"]);
  }

  // Makes, shows or ends the panes, as the state says.
  update(inputAt?: number): void {
    const volume = this.context.volume(), wanted = this.context.store.state.layout === "quad" && volume !== null && volume.name === this.context.store.state.dataset;
    if (!wanted) return this.end();
    const planes = volume.world === "patient" ? PLANES.patient : PLANES.other;
    if (this.slices[0]?.plane !== planes[0][0]) {
      this.end();
      this.slices = planes.map(([plane, name]) => this.make(plane, name));
    }
    for (const slice of this.slices) this.show(slice, inputAt);
  }

  again(): void { for (const { pane } of this.slices) pane.again(); }

  at(): Vec3 { return this.context.store.state.crosshair ?? this.context.volume()?.centre ?? [0, 0, 0]; }

  // What the panes show, for files.
  parts(): Part[] {
    const { state } = this.context.store;
    return this.slices.map(({ pane, plane, name }) => ({
      name: plane, title: `${name} slice`, view: { picture: "slice", timeline: false, options: sliceOptions(this.context.offers, state, plane, this.at()) },
      marks: { marker: false, scaleBar: true, sides: true, crosshair: null, measures: this.measuring.drawn(), legend: [], slice: this.plane(pane) },
    }));
  }

  private plane({ shown }: Pane): { at: Vec3; half: number } { return { at: this.at(), half: shown ? 0.51 * this.spacingAlong(shown.frame.header.geometry.forward) : 0 }; }

  end(): void {
    for (const { pane } of this.slices) pane.end();
    this.slices = [];
  }

  private make(plane: string, name: string): Slice {
    const pane = new Pane(plane, `${name} slice. Arrow keys move the cross-hair, Page Up and Page Down the slice.`, this.context.api, {
      drawn: () => this.annotate(slice), resized: () => this.show(slice), error: message => this.context.say(`${name}: ${message}`, "error"),
    });
    const slice: Slice = { pane, plane, name };
    pane.element.append(h("span", { class: "pane-title" }, name));
    this.stage.append(pane.element);
    this.listen(slice);
    return slice;
  }

  private show({ pane, plane }: Slice, inputAt?: number): void {
    pane.show({ picture: "slice", timeline: false, options: sliceOptions(this.context.offers, this.context.store.state, plane, this.at()) }, inputAt);
  }

  private annotate({ pane }: Slice): void {
    if (!pane.shown) return;
    const { scaleBar } = this.context.store.state;
    pane.drawing.draw(pane.shown, { marker: false, scaleBar, sides: true, crosshair: { at: this.at(), lines: true }, measures: this.measuring.drawn(), legend: [], slice: this.plane(pane) });
    pane.level.show(pane.shown.frame.header, this.context.volume()?.levels.length ?? 0);
  }

  // The point below the pointer, in the plane that is shown.
  private pointAt(shown: Shown, x: number, y: number): Vec3 {
    const geometry = pageGeometry(shown), p = unproject(geometry, shown.cssWidth, shown.cssHeight, x, y);
    const away = dot(add(this.at(), scale(p, -1)), geometry.forward);
    return roundedPoint(this.inVolume(add(p, scale(geometry.forward, away))));
  }

  private inVolume(p: Vec3): Vec3 {
    const volume = this.context.volume() as Volume;
    return p.map((c, i) => clamp(c, volume.low[i] as number, volume.high[i] as number)) as unknown as Vec3;
  }

  private spacingAlong(direction: Vec3): number {
    const spacing = this.context.volume()?.spacing ?? ([0, 0, 0] as const);
    return direction.reduce((sum, c, i) => sum + Math.abs(c) * (spacing[i] as number), 0);
  }

  private moveBy(direction: Vec3, voxels: number, inputAt: number): void {
    this.context.store.update({ crosshair: roundedPoint(this.inVolume(add(this.at(), scale(direction, voxels * this.spacingAlong(direction))))) });
    this.update(inputAt);
  }

  private listen({ pane }: Slice): void {
    const { canvas } = pane, { store } = this.context;
    const place = (event: PointerEvent): void => {
      if (pane.shown) store.update({ crosshair: this.pointAt(pane.shown, event.offsetX, event.offsetY) });
    };
    let last: readonly [number, number] = [0, 0];
    canvas.addEventListener("pointerdown", event => {
      last = [event.clientX, event.clientY];
      canvas.focus({ preventScroll: true });
      canvas.setPointerCapture(event.pointerId);
      if (event.button === 0 && this.measuring.tool && pane.shown) this.measuring.place(this.pointAt(pane.shown, event.offsetX, event.offsetY));
      else if (event.button === 0) place(event);
      event.preventDefault();
    });
    canvas.addEventListener("pointermove", event => {
      if (event.buttons === 1 && !this.measuring.tool) place(event);
      else if (event.buttons === 2) this.window((event.clientX - last[0]) / canvas.clientWidth, (last[1] - event.clientY) / canvas.clientHeight);
      last = [event.clientX, event.clientY];
      if (!pane.shown) return;
      const at = this.pointAt(pane.shown, event.offsetX, event.offsetY);
      this.hover(at);
      this.measuring.hover(at);
    });
    canvas.addEventListener("pointerleave", () => this.hover(null));
    canvas.addEventListener("contextmenu", event => event.preventDefault());
    canvas.addEventListener("wheel", event => {
      if (!this.context.takesWheel()) return;
      event.preventDefault();
      if (pane.shown && event.deltaY !== 0) this.moveBy(pane.shown.frame.header.geometry.forward, Math.sign(event.deltaY), event.timeStamp);
    }, { passive: false });
    canvas.addEventListener("keydown", event => {
      if (event.key === "Enter" && this.measuring.tool) return this.measuring.place(this.at());
      const geometry = pane.shown?.frame.header.geometry, far = event.shiftKey ? 10 : 1;
      if (!geometry) return;
      const move = { ArrowRight: geometry.right, ArrowLeft: scale(geometry.right, -1), ArrowUp: geometry.up, ArrowDown: scale(geometry.up, -1), PageUp: scale(geometry.forward, -1), PageDown: geometry.forward }[event.key];
      if (!move) return;
      event.preventDefault();
      event.stopPropagation();
      this.moveBy(move, far, event.timeStamp);
    });
  }

  // Window and level of the slices: dragging to the right widens, upwards brightens.
  private window(widen: number, raise: number): void {
    const { store } = this.context, volume = this.context.volume() as Volume, [low, high] = volume.range;
    if (!takesFunction(this.context.offers, store.state)) return this.ranges.window(widen, raise);
    const window = store.state.window ?? (high - low) * 0.8, level = store.state.level ?? (low + high) / 2;
    store.update({ window: rounded(Math.max(window * Math.exp(2 * widen), (high - low) * 1e-3), 4), level: rounded(level - raise * window, 4) }, "slice window");
  }
}
