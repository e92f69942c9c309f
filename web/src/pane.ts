// A pane: a canvas with the pictures of one session, at the screen's own pixels, and a drawing over it.
import { Drawing } from "./annotations";
import type { Api } from "./api";
import { type Placing, placing } from "./camera";
import { h, put } from "./dom";
import { LevelBadge } from "./level_badge";
import { type Frame, Session, type SessionEvents, type View } from "./session";
import { pageGeometry, type Shown } from "./shown";

export interface PaneEvents extends Omit<SessionEvents, "frame"> {
  drawn?(shown: Shown): void;
  resized?(): void;
}

const LEAST_SIDE = 16, MOST_SIDE = 8192;
const FAR_MS = 50;

export class Pane {
  readonly canvas = h("canvas", { width: LEAST_SIDE, height: LEAST_SIDE });
  readonly drawing = new Drawing();
  readonly level = new LevelBadge();
  readonly element: HTMLElement;
  shown: Shown | null = null;
  private readonly context = this.canvas.getContext("2d", { alpha: false }) as CanvasRenderingContext2D;
  private readonly session: Session;
  private readonly watcher: ResizeObserver;
  private size: [number, number] = [0, 0]; // pixels of the screen
  private wanted: View | null = null;
  private placed: Placing | null = null; // where the last picture is, unless it is where it was drawn
  private readonly last = document.createElement("canvas"); // the last picture, where the next one takes a while; else empty
  private exact: [number, number] | null = null; // the same as the browser rounds it, where it tells

  constructor(name: string, label: string, api: Api, private readonly events: PaneEvents) {
    this.canvas.setAttribute("tabindex", "0");
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-label", label);
    this.element = h("section", { class: `pane pane-${name}`, "data-pane": name, "aria-label": name }, this.canvas, this.drawing.element, this.level.element);
    this.session = new Session(api, { ...events, frame: frame => this.draw(frame) });
    this.watcher = new ResizeObserver(entries => {
      const exact = entries[entries.length - 1]?.devicePixelContentBoxSize?.[0];
      this.exact = exact ? [exact.inlineSize, exact.blockSize] : null;
      this.measure();
    });
    addEventListener("resize", this.measure); // also when the window moves to a screen with other pixels
    try { this.watcher.observe(this.element, { box: "device-pixel-content-box" }); } catch { this.watcher.observe(this.element); }
  }

  get isVisible(): boolean { return this.size[0] >= LEAST_SIDE && this.size[1] >= LEAST_SIDE; }

  // The view without its size, which is the pane's.
  show(view: View, inputAt?: number): void {
    if (!this.isVisible) return;
    this.wanted = { ...view, options: { ...view.options, size: this.size.join("x") } };
    this.session.show(this.wanted, inputAt);
    this.place();
  }

  again(): void { if (this.isVisible) this.session.again(); }

  end(): void {
    this.watcher.disconnect();
    removeEventListener("resize", this.measure);
    this.session.end();
    this.element.remove();
  }

  private readonly measure = (): void => {
    const sides = [this.element.clientWidth * devicePixelRatio, this.element.clientHeight * devicePixelRatio].map((side, i) => {
      const exact = this.exact?.[i];
      return Math.min(exact !== undefined && Math.abs(exact - side) < 2 ? exact : Math.round(side), MOST_SIDE);
    });
    this.size = sides as [number, number];
    this.markOld();
    if (this.isVisible) this.events.resized?.();
  };

  // Until a picture of the new size comes, the old one keeps its shape.
  private markOld(): void {
    const [width, height] = this.size;
    put(this.canvas, "data-old", Math.abs(width - this.canvas.width) > 1 || Math.abs(height - this.canvas.height) > 1);
  }

  // The canvas keeps its picture until another is there: resizing a canvas clears it.
  private draw(frame: Frame): void {
    const { header, picture } = frame;
    const [width, height] = String(frame.view.options["size"]).split("x").map(Number) as [number, number]; // a small picture fills it, too
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
    const [r, g, b] = header.background.map(c => Math.round(c * 255));
    this.element.style.background = this.context.fillStyle = `rgb(${r} ${g} ${b})`;
    this.context.fillRect(0, 0, width, height);
    const paint = (onto: CanvasRenderingContext2D): void => {
      if (picture) onto.drawImage(picture, x * across, y * down, w * across, h * down);
    };
    const across = width / header.size[0], down = height / header.size[1], [x, y, w, h] = header.bounds;
    paint(this.context);
    const far = header.statistics.round_trip_ms > FAR_MS;
    this.last.width = far ? width : 0; // which also clears it
    this.last.height = far ? height : 0;
    if (far) paint(this.last.getContext("2d") as CanvasRenderingContext2D);
    this.markOld();
    this.placed = null;
    this.shown = { frame, cssWidth: width / devicePixelRatio, cssHeight: height / devicePixelRatio };
    this.events.drawn?.(this.shown);
    // For whoever embeds or measures the page.
    this.canvas.dispatchEvent(new CustomEvent("slabstream:drawn", {
      bubbles: true, composed: true,
      detail: { pane: this.element.dataset["pane"], header, seq: header.seq, final: header.final, options: frame.view.options, inputAt: frame.view.inputAt, drawnAt: performance.now() },
    }));
    this.place();
  }

  // The pixel of the picture that is seen at a pixel of the page.
  under(x: number, y: number): [number, number] {
    if (!this.placed) return [x, y];
    const { placed, canvas } = this, cos = Math.cos(placed.roll) / placed.zoom, sin = Math.sin(placed.roll) / placed.zoom;
    const across = x * devicePixelRatio - canvas.width / 2, down = y * devicePixelRatio - canvas.height / 2;
    return [(placed.x + across * cos + down * sin) / devicePixelRatio, (placed.y + down * cos - across * sin) / devicePixelRatio];
  }

  // Until the picture of the wanted view is there, the last one is drawn where it lies in that: moving, zooming and rolling follow the hand at once,
  // however far the service is. What turns has to wait.
  private place(): void {
    const { wanted, shown, canvas, context } = this;
    if (!wanted || !shown || this.last.width === 0 || wanted.picture !== "render") return;
    const at = placing(pageGeometry({ ...shown, cssWidth: canvas.width }), canvas.width, canvas.height, shown.frame.view.options, wanted.options);
    if (!at) return;
    const same = at.zoom === 1 && at.roll === 0 && Math.hypot(at.x - canvas.width / 2, at.y - canvas.height / 2) < 0.01;
    if (same && !this.placed) return;
    this.placed = same ? null : at;
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.translate(canvas.width / 2, canvas.height / 2);
    context.rotate(at.roll);
    context.scale(at.zoom, at.zoom);
    context.drawImage(this.last, -at.x, -at.y);
    context.resetTransform();
  }
}
