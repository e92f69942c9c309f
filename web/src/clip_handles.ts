// The clip box in the picture: its edges, and a handle on each face that moves it.
import { project } from "./camera";
import { put, svg } from "./dom";
import { BOX_EDGES } from "./measure";
import { pageGeometry, type Shown } from "./shown";
import type { Bounds, ClipBox } from "./state";
import { AXES, type Axis, AXIS_NAMES, clamp, rounded, scale, add, type Vec3, withAxis } from "./vec";
import type { Volume } from "./volume";

export const wholeBox: ClipBox = [[null, null], [null, null], [null, null]];

// The box as it cuts the volume.
export function cornersOf(box: ClipBox, volume: Volume): [Vec3, Vec3] {
  const bound = (axis: Axis, end: 0 | 1): number => clamp(box[axis][end] ?? (end === 0 ? volume.low : volume.high)[axis], volume.low[axis], volume.high[axis]);
  return [[bound(0, 0), bound(1, 0), bound(2, 0)], [bound(0, 1), bound(1, 1), bound(2, 1)]];
}

// With one bound moved: it stays in the volume and a voxel away from the other one. At the volume's side it does not clip.
export function boxWith(box: ClipBox, volume: Volume, axis: Axis, end: 0 | 1, value: number): ClipBox {
  const [low, high] = cornersOf(box, volume), least = volume.spacing[axis];
  const limited = end === 0 ? clamp(value, volume.low[axis], high[axis] - least) : clamp(value, low[axis] + least, volume.high[axis]);
  const atSide = Math.abs(limited - (end === 0 ? volume.low : volume.high)[axis]) < least / 2;
  const bounds = [...box[axis]] as [number | null, number | null];
  bounds[end] = atSide ? null : rounded(limited);
  return box.map((old, i) => (i === axis ? bounds : old)) as unknown as readonly [Bounds, Bounds, Bounds];
}

export class ClipHandles {
  readonly element = svg("svg", { class: "tools" });
  private readonly edges = svg("path", { class: "clip-edges" });
  private readonly handles: SVGCircleElement[] = [];
  private readonly reaches: SVGCircleElement[] = [];
  private last: readonly [number, number] = [0, 0]; // where the pointer that drags was
  private shown: Shown | null = null;
  private box: ClipBox | null = null;
  private volume: Volume | null = null;

  constructor(private readonly change: (box: ClipBox) => void) {
    this.element.append(this.edges);
    for (const axis of AXES) for (const end of [0, 1] as const) {
      const handle = svg("circle", { r: 7, class: `handle axis-${AXIS_NAMES[axis]}`, tabindex: 0, role: "slider", "aria-label": `Clip ${AXIS_NAMES[axis]} ${end === 0 ? "from" : "to"}` });
      const reach = svg("circle", { r: 22, class: "reach" }); // where a finger counts
      for (const part of [reach, handle]) {
        part.addEventListener("pointerdown", event => { part.setPointerCapture(event.pointerId); this.last = [event.clientX, event.clientY]; event.preventDefault(); });
        part.addEventListener("pointermove", event => {
          if (!part.hasPointerCapture(event.pointerId)) return;
          this.drag(axis, end, event.clientX - this.last[0], event.clientY - this.last[1]);
          this.last = [event.clientX, event.clientY];
        });
      }
      handle.addEventListener("keydown", event => this.press(axis, end, event));
      this.handles.push(handle);
      this.reaches.push(reach);
      this.element.append(reach, handle);
    }
  }

  update(shown: Shown | null, box: ClipBox | null, volume: Volume | null): void {
    this.shown = shown;
    this.box = box;
    this.volume = volume;
    put(this.element, "hidden", !shown || !box || !volume);
    if (!shown || !box || !volume) return;
    const { cssWidth: width, cssHeight: height } = shown, geometry = pageGeometry(shown);
    this.element.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const [low, high] = cornersOf(box, volume);
    const at = (p: Vec3): [number, number] => project(geometry, width, height, p);
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map(i => at([i & 1 ? high[0] : low[0], i & 2 ? high[1] : low[1], i & 4 ? high[2] : low[2]]));
    this.edges.setAttribute("d", BOX_EDGES.map(([a, b]) => `M${(corners[a] as number[]).join(" ")}L${(corners[b] as number[]).join(" ")}`).join(""));
    const middle = scale(add(low, high), 0.5);
    for (const axis of AXES) for (const end of [0, 1] as const) {
      const handle = this.handles[2 * axis + end] as SVGCircleElement, value = (end === 0 ? low : high)[axis];
      const [x, y] = at(withAxis(middle, axis, value));
      for (const part of [handle, this.reaches[2 * axis + end] as SVGCircleElement]) { part.setAttribute("cx", String(x)); part.setAttribute("cy", String(y)); }
      handle.setAttribute("aria-valuenow", String(rounded(value)));
      handle.setAttribute("aria-valuemin", String(rounded(volume.low[axis])));
      handle.setAttribute("aria-valuemax", String(rounded(volume.high[axis])));
    }
  }

  // Along the axis as the picture shows it.
  private drag(axis: Axis, end: 0 | 1, dx: number, dy: number): void {
    if (!this.shown || !this.volume || !this.box) return;
    const geometry = pageGeometry(this.shown), { cssWidth: width, cssHeight: height } = this.shown;
    const [low, high] = cornersOf(this.box, this.volume), value = (end === 0 ? low : high)[axis];
    const middle = scale(add(low, high), 0.5), unit = this.volume.extent[axis] / 100;
    const [ax, ay] = project(geometry, width, height, withAxis(middle, axis, value)), [bx, by] = project(geometry, width, height, withAxis(middle, axis, value + unit));
    const sx = bx - ax, sy = by - ay, square = sx * sx + sy * sy;
    if (square < 1e-4) return; // seen along the axis
    this.moveTo(axis, end, value + (unit * (dx * sx + dy * sy)) / Math.max(square, 0.04));
  }

  private press(axis: Axis, end: 0 | 1, event: KeyboardEvent): void {
    if (!this.volume || !this.box) return;
    const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    const [low, high] = cornersOf(this.box, this.volume);
    this.moveTo(axis, end, (end === 0 ? low : high)[axis] + step * this.volume.spacing[axis]);
  }

  private moveTo(axis: Axis, end: 0 | 1, value: number): void {
    if (!this.box || !this.volume) return;
    this.box = boxWith(this.box, this.volume, axis, end, value); // the next step of a drag starts here, not at the picture
    this.change(this.box);
  }
}
