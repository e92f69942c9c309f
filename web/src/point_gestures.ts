// Pointers and keys of a plot whose points are moved by hand. Its circles have `data-index`; the chosen one has the class `selected`.
export interface PointEditor {
  choose(circle: SVGElement): void;
  insertAt(event: PointerEvent): void;
  dragTo(event: PointerEvent): void;
  step(right: number, up: number): void; // in steps of an arrow key
  add(): void;
  remove(): void;
}

const ARROWS: Record<string, readonly [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

export const editPoints = (plot: SVGElement, editor: PointEditor): void => {
  let dragging = false;
  plot.addEventListener("pointerdown", event => {
    const hit = event.target instanceof SVGElement && event.target.dataset["index"] ? event.target : null;
    if (hit) {
      editor.choose(hit);
      hit.focus();
      if (event.button === 2) return editor.remove();
    } else if (event.button === 0) {
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
