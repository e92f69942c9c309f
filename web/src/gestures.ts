// Pointers, fingers and the wheel over the 3-D picture.
import { orbited, panned, rolled, zoomed } from "./camera";
import type { State } from "./state";

export interface GestureTarget {
  takesWheel(): boolean;
  state(): State;
  // Side of a pixel of the page in the world, at the target's depth; 0: not known yet.
  pixelSize(): number;
  move(patch: Partial<State>, inputAt: number): void;
  window(widen: number, raise: number, inputAt: number): void; // shares of the pane's sides
  hover(x: number, y: number): void;
  leave(): void;
  place(x: number, y: number): void; // a double click
  click(x: number, y: number): void; // pressed and let go in one place
}

const DEGREES_A_PIXEL = 0.4;
const ZOOM_A_WHEEL_PIXEL = 0.0015;
const MOST_WHEEL_PIXELS = 240;

const CLICK_PIXELS = 4;

type Drag = "orbit" | "pan" | "roll" | "window";

function dragOf(event: PointerEvent): Drag {
  if (event.button === 2) return "window";
  if (event.button === 1 || event.shiftKey) return "pan";
  return event.ctrlKey || event.metaKey || event.altKey ? "roll" : "orbit";
}

export function listenToGestures(canvas: HTMLCanvasElement, target: GestureTarget): void {
  const pointers = new Map<number, { x: number; y: number }>();
  let drag: Drag = "orbit";
  let pressed: { x: number; y: number } | null = null; // null: what goes on is no click

  const fromCentre = (x: number, y: number): [number, number] => {
    const box = canvas.getBoundingClientRect();
    return [x - box.left - box.width / 2, y - box.top - box.height / 2];
  };

  const one = (before: { x: number; y: number }, event: PointerEvent): void => {
    const dx = event.clientX - before.x, dy = event.clientY - before.y, at = event.timeStamp;
    if (drag === "orbit") return target.move(orbited(target.state(), dx * DEGREES_A_PIXEL, -dy * DEGREES_A_PIXEL), at);
    if (drag === "pan") return target.move(panned(target.state(), dx, dy, target.pixelSize()), at);
    if (drag === "window") return target.window(dx / canvas.clientWidth, -dy / canvas.clientHeight, at);
    const [x, y] = fromCentre(event.clientX, event.clientY);
    const turn = Math.atan2(y, x) - Math.atan2(y - dy, x - dx);
    target.move(rolled(target.state(), (Math.atan2(Math.sin(turn), Math.cos(turn)) * 180) / Math.PI), at);
  };

  // Two fingers: the points below them stay below them.
  const two = (id: number, before: { x: number; y: number }, event: PointerEvent): void => {
    const other = [...pointers].find(([key]) => key !== id)?.[1];
    if (!other) return;
    const was = [before.x - other.x, before.y - other.y] as const, is = [event.clientX - other.x, event.clientY - other.y] as const;
    const factor = Math.hypot(...is) / Math.max(1, Math.hypot(...was));
    const turn = ((Math.atan2(is[1], is[0]) - Math.atan2(was[1], was[0])) * 180) / Math.PI;
    const [x, y] = fromCentre((event.clientX + other.x) / 2, (event.clientY + other.y) / 2);
    const size = target.pixelSize();
    let view: State = target.state();
    const patches = [panned(view, (event.clientX - before.x) / 2, (event.clientY - before.y) / 2, size)];
    view = { ...view, ...patches[0] };
    patches.push(zoomed(view, factor, x, y, size), rolled(view, turn));
    target.move(Object.assign({}, ...patches), event.timeStamp);
  };

  canvas.addEventListener("pointerdown", event => {
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    pressed = pointers.size === 1 && event.button === 0 ? { x: event.clientX, y: event.clientY } : null;
    drag = dragOf(event);
    canvas.dataset["drag"] = drag;
    event.preventDefault();
  });
  canvas.addEventListener("pointermove", event => {
    const before = pointers.get(event.pointerId);
    if (!before) {
      if (event.pointerType !== "touch") target.hover(event.offsetX, event.offsetY);
      return;
    }
    const now = { x: event.clientX, y: event.clientY };
    if (pressed && Math.hypot(now.x - pressed.x, now.y - pressed.y) > CLICK_PIXELS) pressed = null;
    if (pointers.size === 1) one(before, event);
    else if (pointers.size === 2) two(event.pointerId, before, event);
    pointers.set(event.pointerId, now);
  });
  const up = (event: PointerEvent): void => {
    pointers.delete(event.pointerId);
    if (pointers.size === 0) delete canvas.dataset["drag"];
  };
  canvas.addEventListener("pointerup", event => {
    if (pressed && pointers.has(event.pointerId)) target.click(event.offsetX, event.offsetY);
    pressed = null;
    up(event);
  });
  canvas.addEventListener("pointercancel", up);
  canvas.addEventListener("pointerleave", () => target.leave());
  canvas.addEventListener("contextmenu", event => event.preventDefault());
  canvas.addEventListener("dblclick", event => target.place(event.offsetX, event.offsetY));
  canvas.addEventListener("wheel", event => {
    if (!target.takesWheel()) return;
    event.preventDefault();
    const unit = event.deltaMode === 1 ? 30 : event.deltaMode === 2 ? 300 : event.ctrlKey ? 6 : 1;
    const pixels = Math.max(-MOST_WHEEL_PIXELS, Math.min(MOST_WHEEL_PIXELS, event.deltaY * unit));
    target.move(zoomed(target.state(), Math.exp(-pixels * ZOOM_A_WHEEL_PIXEL), ...fromCentre(event.clientX, event.clientY), target.pixelSize()), event.timeStamp);
  }, { passive: false });
}
