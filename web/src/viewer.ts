// The 3-D picture: its view follows the state, gestures move it, the page's drawing lies over it.
import type { LegendEntry } from "./annotations";
import { zoomOf } from "./camera";
import type { ChannelRanges } from "./channel_ranges";
import { channels } from "./channels";
import { ClipHandles } from "./clip_handles";
import type { Context } from "./context";
import type { FunctionSource } from "./function_source";
import { listenToGestures } from "./gestures";
import type { Labels } from "./labels";
import type { Measuring } from "./measuring";
import { projectionOf, renderOptions } from "./options";
import { Pane, type PaneEvents } from "./pane";
import type { Pointed } from "./pointed";
import type { Part } from "./saving";
import { pageGeometry, type Shown } from "./shown";
import type { State } from "./state";
import { visibleRangeOf } from "./transfer";
import { rounded, roundedPoint, type Vec3 } from "./vec";

const LEAST_WINDOW = 1e-3; // as a share of the data's range

const LETTERS = 13; // pixels of the page

export class Viewer {
  readonly pane: Pane;
  private readonly handles: ClipHandles;
  private inputAt: number | undefined;
  private frameAsked = 0;
  private changed = false; // since the last view was sent

  constructor(private readonly context: Context, private readonly source: FunctionSource, private readonly pointed: Pointed, private readonly measuring: Measuring, private readonly labels: Labels, private readonly ranges: ChannelRanges, events: PaneEvents) {
    this.pane = new Pane("3d", "Volume. Arrow keys turn it, plus and minus zoom, question mark shows all keys.", context.api, {
      ...events, drawn: shown => { this.resolveFit(shown); this.annotate(); events.drawn?.(shown); }, resized: () => this.send(),
    });
    this.handles = new ClipHandles(clipBox => this.change({ clipBox }, "handle"));
    this.pane.element.append(this.handles.element);
    context.onVolume(volume => {
      if (this.pane.shown) this.resolveFit(this.pane.shown);
      this.annotate();
      if (volume) this.later(); // by now it is known which of its options apply
    });
    measuring.onChange(() => this.annotate());
    labels.onChange(() => this.annotate());
    context.store.subscribe(() => this.later());
    context.store.subscribe(() => this.annotate(), ["marker", "scaleBar", "colorBar", "layout", "crosshair", "clipBox", "legend", "labels", "labelsShown", "labelOpacities"]); // else with the next picture
    listenToGestures(this.pane.canvas, {
      takesWheel: context.takesWheel,
      state: () => context.store.state,
      pixelSize: () => this.pixelSize(),
      move: (patch, at) => this.move(patch, at),
      window: (widen, raise, at) => this.window(widen, raise, at),
      hover: (x, y) => pointed.atPixel(this.pane.shown, ...this.pane.under(x, y), at => measuring.hover(at)),
      leave: () => pointed.clear(),
      place: (x, y) => { if (!measuring.tool) void this.place(x, y, (crosshair, inside) => { if (inside) context.store.update({ crosshair, layout: "quad" }); }); },
      click: (x, y) => { if (measuring.tool) void this.place(x, y, at => measuring.place(at)); else this.tell(x, y); },
    });
  }

  // Side of a pixel of the page in the world, for the zoom of now: the picture may be one behind.
  pixelSize(): number {
    const shown = this.pane.shown;
    if (!shown || !this.context.store.state.lookAt) return 0;
    const then = Number(shown.frame.view.options["zoom"] ?? 1);
    return (pageGeometry(shown).pixel_size * then) / this.context.store.state.zoom;
  }

  move(patch: Partial<State>, inputAt: number): void {
    this.inputAt ??= inputAt;
    this.pointed.clear();
    this.context.store.update(patch);
  }

  private change(patch: Partial<State>, gesture: string): void {
    this.inputAt ??= performance.now();
    this.context.store.update(patch, gesture);
  }

  // To the right widens the range of values, upwards brightens: the range goes down. The window is that of what shows: the rest of the
  // function, such as clear air, moves with it.
  window(widen: number, raise: number, inputAt: number): void {
    const volume = this.context.volume();
    if (volume && channels(this.context.offers)?.length && !this.source.shows) {
      this.inputAt ??= inputAt;
      return this.ranges.window(widen, raise);
    }
    if (!volume || this.source.pending || !this.context.offers.can("transfer", this.context.store.state.renderer)) return;
    const [low, high] = this.source.range(), [from, to] = visibleRangeOf(this.source.current());
    const least = LEAST_WINDOW * Math.max(volume.range[1] - volume.range[0], Number.MIN_VALUE);
    const width = Math.max((to - from) * Math.exp(1.5 * widen), least), middle = (from + to) / 2 - raise * (to - from);
    const moved = (value: number): number => rounded(middle + ((value - (from + to) / 2) * width) / (to - from), 5);
    if (!(to > from && moved(low) < moved(high))) return;
    this.inputAt ??= inputAt;
    this.context.store.update({ range: [moved(low), moved(high)] }, "window");
    this.context.say(`Window ${rounded(width, 3)}, level ${rounded(middle, 3)}`);
  }

  // At once, but at most one view a frame of the screen; the latest wins.
  private later(): void {
    if (this.frameAsked) { this.changed = true; return; }
    this.send();
    this.frameAsked = requestAnimationFrame(() => {
      this.frameAsked = 0;
      if (!this.changed) return;
      this.changed = false;
      this.later();
    });
  }

  private send(): void {
    const { state } = this.context.store;
    if (!state.dataset) return;
    const letters = state.axes === "off" ? {} : { "font-size": LETTERS * devicePixelRatio };
    this.pane.show({ picture: "render", timeline: state.machine, options: { ...renderOptions(this.context.offers, state), ...letters } }, this.inputAt);
    this.inputAt = undefined;
  }

  // `fit` frames what shows. From the first such picture on the view stays, even if other settings change.
  private resolveFit({ frame: { header, view } }: Shown): void {
    const { state } = this.context.store, volume = this.context.volume();
    if (state.lookAt || !volume || view.options["fit"] !== true || view.options["dataset"] !== state.dataset || volume.name !== state.dataset) return;
    if (view.options["projection"] !== projectionOf(this.context.offers, state)) return;
    const made = Number(view.options["zoom"] ?? 1);
    this.context.store.update({ lookAt: roundedPoint(header.geometry.target), zoom: rounded((zoomOf(header.geometry, header.size[0], header.size[1], volume.extent) * state.zoom) / made) });
  }

  annotate(): void {
    const { shown } = this.pane, { state } = this.context.store;
    if (!shown) return;
    const crosshair = state.layout === "quad" && state.crosshair ? { at: state.crosshair, lines: false } : null;
    this.pane.drawing.draw(shown, { marker: state.marker, scaleBar: state.scaleBar, sides: state.marker, crosshair, measures: this.measuring.drawn(), legend: this.legend(), bar: state.colorBar ? this.source.bar() : null });
    this.handles.update(shown, state.clipBox, this.context.volume());
    this.pane.level.show(shown.frame.header, this.context.volume()?.levels.length ?? 0);
  }

  private legend(): readonly LegendEntry[] { return [...this.ranges.legend(), ...this.labels.legend()]; }

  // What the pane shows, for a file.
  part(): Part {
    return {
      name: "3d", title: "3-D picture", view: { picture: "render", timeline: false, options: renderOptions(this.context.offers, this.context.store.state) },
      marks: { marker: true, scaleBar: true, sides: true, crosshair: null, measures: this.measuring.drawn(), legend: this.legend(), bar: this.context.store.state.colorBar ? this.source.bar() : null },
    };
  }

  // Who embeds the viewer hears what was clicked at.
  private tell(x: number, y: number): void {
    const { picked } = this.context;
    if (picked && this.pane.shown) this.pointed.pick(this.pane.shown, ...this.pane.under(x, y)).then(value => { if (value) picked(value); }).catch(() => undefined);
  }

  // Uses the point that a pixel shows; one of a shape may lie outside the volume.
  private async place(x: number, y: number, use: (at: Vec3, inside: boolean) => void): Promise<void> {
    if (!this.pane.shown) return;
    const value = await this.pointed.pick(this.pane.shown, ...this.pane.under(x, y)).catch(() => null);
    if (value?.at && value.hit !== false) use(roundedPoint(value.at), value.inside !== false);
    else if (this.measuring.tool) this.context.say("Nothing shows there.");
  }
}
