// Key frames: views that are kept, through which a movie goes (docs/movies.md). Section of the panel.
import type { Context } from "./context";
import { button, iconButton, section } from "./controls";
import { download, h, shown } from "./dom";
import type { Offers } from "./offers";
import { projectionOf } from "./options";
import { type KeyFrame, MOST_KEY_FRAMES, type State } from "./state";

// The path as `slabstream turntable --path` reads it.
export const pathOf = (offers: Offers, state: State): object[] =>
  state.path.map(({ azimuth, elevation, roll, zoom, lookAt }) => ({ projection: projectionOf(offers, state), azimuth, elevation, roll, zoom, "look-at": lookAt.join(",") }));

export function keepView({ store, say }: Context): void {
  const { azimuth, elevation, roll, zoom, lookAt, path } = store.state;
  if (!lookAt) return say("There is no view to keep before the first picture.", "error");
  if (path.length >= MOST_KEY_FRAMES) return say(`At most ${MOST_KEY_FRAMES} key frames.`, "error");
  store.update({ path: [...path, { azimuth, elevation, roll, zoom, lookAt }] }, "key frame");
  say(`Key frame ${path.length + 1}`);
}

export function keyFramesSection(context: Context): HTMLDetailsElement {
  const { store, offers } = context;
  const without = (index: number): void => store.update({ path: store.state.path.filter((_, i) => i !== index) }, "no key frame");
  const line = ({ azimuth, elevation, zoom, ...view }: KeyFrame, i: number): HTMLElement => h("li", {}, h("div", { class: "measure-row" }, h("b", {}, String(i + 1)),
    h("span", { class: "measure-text" }, `${shown(azimuth)}°, ${shown(elevation)}°, zoom ${shown(zoom, 3)}`),
    iconButton(`Show key frame ${i + 1}`, "eye", () => store.update({ azimuth, elevation, zoom, ...view })), iconButton(`Remove key frame ${i + 1}`, "close", () => without(i))));
  const list = h("ol", { class: "measures" });
  const add = button("Add this view", "add", () => keepView(context), "quiet");
  const save = button("Save for --path", "save", () => download("path.json", new Blob([`${JSON.stringify(pathOf(offers, store.state), null, 1)}\n`], { type: "application/json" })), "quiet");
  const hint = h("p", { class: "hint" }, "A movie goes through the views that are added here.");
  const draw = (): void => {
    const { path } = store.state;
    list.replaceChildren(...path.map(line));
    hint.hidden = path.length > 1;
    save.disabled = path.length < 2;
  };
  store.subscribe(draw, ["path"]);
  draw();
  return section("Key frames", false, hint, list, h("div", { class: "button-row" }, add, save));
}
