// Section of the panel: the clip box by numbers, planes, and what of them is shown.
import { cornersOf, boxWith, wholeBox } from "./clip_handles";
import { axesOf } from "./camera";
import { type Context, follow } from "./context";
import { button, iconButton, numberField, row, rows, section, segmented, toggle } from "./controls";
import { h } from "./dom";
import { type ClipPlane, LOOK } from "./state";
import { AXES, AXIS_NAMES, dot, rounded } from "./vec";
import { unitName } from "./volume";

const MOST_PLANES = 6;

export function clipSection(context: Context): HTMLDetailsElement {
  const { store } = context;
  const on = toggle("Box", enabled => store.update({ clipBox: enabled ? wholeBox : null }, "box"));
  const fields = AXES.map(axis => ([0, 1] as const).map(end => numberField(`${AXIS_NAMES[axis]} ${end === 0 ? "from" : "to"}`, value => {
    const volume = context.volume(), box = store.state.clipBox;
    if (volume && box) store.update({ clipBox: boxWith(box, volume, axis, end, value) }, `box ${axis} ${end}`);
  })));
  const unit = h("span", { class: "unit" });
  const grid = h("div", { class: "grid-fields" }, h("span", {}), h("span", { class: "label" }, "From"), h("span", { class: "label" }, "To"),
    ...AXES.flatMap(axis => [h("span", { class: "label" }, AXIS_NAMES[axis]), ...(fields[axis] ?? []).map(field => field.input)]));
  const resetBox = button("Whole volume", null, () => store.update({ clipBox: wholeBox }, "whole"), "quiet");
  const planes = rows<ClipPlane>(index => {
    const inputs = ["x", "y", "z", "d"].map((name, i) => numberField(`Plane ${index + 1}, ${name}`, value => {
      const changed = store.state.clipPlanes.map((plane, at) => (at === index ? (plane.map((old, j) => (j === i ? value : old)) as unknown as ClipPlane) : plane));
      if (changed[index]?.slice(0, 3).some(c => c !== 0)) store.update({ clipPlanes: changed }, `plane ${index}`);
    }));
    const remove = iconButton(`Remove plane ${index + 1}`, "close", () => store.update({ clipPlanes: store.state.clipPlanes.filter((_, i) => i !== index) }, "no plane"));
    return { element: h("div", { class: "list-row four" }, ...inputs.map(field => field.input), remove), set: plane => plane.forEach((value, i) => inputs[i]?.set(value)) };
  });
  const planeHead = h("div", { class: "list-head four", "aria-hidden": "true" }, ...["x", "y", "z", "d"].map(name => h("span", {}, name)));
  const planeHint = h("p", { class: "hint" }, "Keeps the points with x X + y Y + z Z + d ≥ 0.");
  const addPlane = button("Cut here, facing the view", "add", () => {
    const volume = context.volume(), { forward } = axesOf(store.state);
    if (!volume) return;
    const normal = forward.map(c => rounded(c, 4)) as [number, number, number];
    store.update({ clipPlanes: [...store.state.clipPlanes, [...normal, rounded(-dot(normal, store.state.crosshair ?? volume.centre), 5)]] }, "plane");
  }, "quiet");
  const mode = segmented("Show", [["keep", "Inside"], ["cut-away", "Outside"]], value => store.update({ clipMode: value as "keep" }, "clip mode"));
  const modeRow = row("Show what is", mode.element);
  const update = (): void => {
    const { clipBox, clipPlanes, clipMode } = store.state, volume = context.volume();
    on.set(clipBox !== null);
    grid.hidden = resetBox.hidden = unit.hidden = clipBox === null || volume === null;
    if (clipBox && volume) {
      const corners = cornersOf(clipBox, volume);
      for (const axis of AXES) for (const end of [0, 1] as const) fields[axis]?.[end]?.set(corners[end][axis]);
      unit.textContent = `Bounds in ${unitName(volume.unit)}`;
    }
    planes.set(clipPlanes);
    planeHead.hidden = planeHint.hidden = clipPlanes.length === 0;
    mode.set(clipMode);
    modeRow.hidden = clipBox === null && clipPlanes.length === 0;
    addPlane.disabled = clipPlanes.length >= MOST_PLANES;
  };
  follow(context, LOOK, update);
  return section("Clipping", false, on.element, grid, h("div", { class: "button-row" }, resetBox, unit), planeHead, planes.element, planeHint, addPlane, modeRow);
}
