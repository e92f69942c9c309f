// Pointers and keys of a plot whose points are moved by hand. Its marks have `data-index`; the chosen one has the class `selected`.
import { put, svg } from "./dom";
import { markNear } from "./near";

export interface PointEditor {
  choose(mark: SVGElement, event?: PointerEvent): void; // with the event that begins a drag
  insertAt?(event: PointerEvent): void;
  dragTo(event: PointerEvent): void;
  step(right: number, up: number): void; // in steps of an arrow key
  add(): void;
  remove(): void;
}

const ARROWS: Record<string, readonly [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

export const editPoints = (plot: SVGElement, editor: PointEditor): void => {
  let dragging = false;
  plot.addEventListener("pointerdown", event => {
    const hit = markNear(plot.querySelectorAll<SVGElement>("[data-index]"), event);
    if (hit) {
      editor.choose(hit, event);
      hit.focus();
      if (event.button === 2) return editor.remove();
    } else if (event.button === 0) {
      if (!editor.insertAt) return;
      editor.insertAt(event);
      plot.querySelector<SVGElement>(".selected")?.focus();
    }
    if (event.button !== 0) return;
    dragging = true;
    plot.setPointerCapture(event.pointerId);
    event.preventDefault();
  });
  plot.addEventListener("pointermove", event => { if (dragging) editor.dragTo(event); });
  for (const end of ["pointerup", "pointercancel"]) plot.addEventListener(end, () => { dragging = false; });
  plot.addEventListener("contextmenu", event => event.preventDefault());
  plot.addEventListener("keydown", event => {
    const arrow = ARROWS[event.key], far = event.shiftKey ? 10 : 1;
    if (arrow) editor.step(arrow[0] * far, arrow[1] * far);
    else if (event.key === "Delete" || event.key === "Backspace") editor.remove();
    else if (event.key === "Insert") editor.add();
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
};

// Where a pointer is in a plot that is `width` wide in its own units.
export function placeIn(plot: SVGElement, width: number, event: MouseEvent): [number, number] {
  const box = plot.getBoundingClientRect();
  return [((event.clientX - box.left) * width) / box.width, event.clientY - box.top];
}

// Tells how wide a plot's frame is, unless it is hidden.
export const onWidth = (frame: HTMLElement, tell: (width: number) => void): void =>
  new ResizeObserver(entries => { const wide = Math.round(entries[0]?.contentRect.width ?? 0); if (wide > 0) tell(Math.max(120, wide)); }).observe(frame);

// As many marks as wanted. Those that are there stay, and with them the focus.
export function drawMarks(group: SVGElement, tag: "circle" | "path", marks: readonly Record<string, string | number>[], focused: (mark: SVGElement) => void): void {
  while (group.childElementCount > marks.length) group.lastElementChild?.remove();
  while (group.childElementCount < marks.length) group.append(svg(tag, { tabindex: 0, role: "slider", onfocus: (event: FocusEvent) => focused(event.target as SVGElement) }));
  marks.forEach((attributes, i) => { for (const [name, value] of Object.entries(attributes)) put(group.children[i] as Element, name, String(value)); });
}
