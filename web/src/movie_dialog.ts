// The window for a movie of one turn, which the gateway makes while the page reads it.
import { ApiError, type Options } from "./api";
import { annotationFields } from "./annotation_fields";
import type { Context } from "./context";
import { button, row, segmented } from "./controls";
import { dialog } from "./dialogs";
import { bytes, copyText, download, h } from "./dom";
import { pathOf } from "./key_frames";
import { renderOptions } from "./options";
import type { State } from "./state";

const FRAMES = { usual: 120, most: 1000 } as const, FPS = { usual: 25, most: 120 } as const;
const MOST_PIXELS = 2048 * 2048;
const CAMERA = ["projection", "azimuth", "elevation", "roll", "zoom", "look-at", "fit"] as const; // what each key frame has of its own
const even = (side: number): number => Math.max(16, Math.round(side / 2) * 2);

// Counts the frames of an MP4 stream, in which each has a box "moof" of its own.
class FrameCounter {
  frames = 0;
  private head: number[] = []; // the next box's first bytes: 4 of size, 4 of type
  private skip = 0; // bytes of the box that are still to come

  add(part: Uint8Array): void {
    for (let at = 0; at < part.length;) {
      if (this.skip > 0) {
        const step = Math.min(this.skip, part.length - at);
        this.skip -= step;
        at += step;
        continue;
      }
      this.head.push(part[at++] as number);
      if (this.head.length < 8) continue;
      this.skip = this.head.slice(0, 4).reduce((size, byte) => size * 256 + byte, 0) - 8;
      if (String.fromCharCode(...this.head.slice(4)) === "moof") this.frames++;
      this.head = [];
    }
  }
}

// `front`: where a movie begins unless it is to begin at the present view; null: the dataset has no front.
export function movieDialog({ store: { state }, offers, api, element }: Context, width: number, height: number, front: Partial<State> | null): void {
  const field = (label: string, value: number, low: number, high: number): HTMLInputElement => h("input", { type: "number", min: low, max: high, step: 1, required: true, value, "aria-label": label });
  const shrink = Math.min(1, Math.sqrt(MOST_PIXELS / (width * height)));
  const w = field("Width in pixels", even(width * shrink), 16, 4096), t = field("Height in pixels", even(height * shrink), 16, 4096);
  w.step = t.step = "2";
  const frames = field("Frames", FRAMES.usual, 1, FRAMES.most), fps = field("Frames a second", FPS.usual, 1, FPS.most);
  const bar = h("progress", { max: 1, value: 0, hidden: true, "aria-label": "Progress of the movie" });
  const status = h("p", { role: "status", class: "hint" });
  const help = h("section", { hidden: true });
  const save = h("button", { type: "submit", class: "button primary" }, "Make movie");
  let running: AbortController | null = null;
  const cancel = button("Cancel", null, () => running?.abort(), "quiet");
  cancel.hidden = true;
  const length = (): string => `${frames.value} frames, ${Math.round((10 * Number(frames.value)) / Number(fps.value)) / 10} s`;
  const marks = annotationFields(offers, state);
  // One turn, from the front or from here, or the way through the key frames.
  const ways = [...(front ? [["front", "A turn from the front"] as const] : []), ["view", "A turn from here"] as const, ...(state.path.length > 1 ? [["path", `${state.path.length} key frames`] as const] : [])];
  let way: string = state.path.length > 1 ? "path" : front ? "front" : "view";
  const start = segmented("Way", ways, value => { way = value; });
  start.set(way);
  const view = (): Options => {
    const options = renderOptions(offers, way === "front" ? { ...state, ...front } : state);
    if (way !== "path") return options;
    for (const name of CAMERA) delete options[name];
    return { ...options, path: pathOf(offers, state) };
  };
  const options = (): Options => ({ ...view(), ...marks.options(), size: `${w.value}x${t.value}` });

  // What to do where the gateway cannot: the same by the command line.
  const offerCommand = async (): Promise<void> => {
    const { path, ...rest } = options(), { command } = await api.command(rest);
    const movie = command.replace(/^slabstream render/, "slabstream turntable").replace(/ -o \S+$/, `${path ? " --path path.json" : ""} --frames ${frames.value} --fps ${fps.value} -o turntable.mp4`);
    help.replaceChildren(h("h3", {}, "On a machine with ffmpeg, use this command"), h("pre", { tabindex: 0 }, movie), button("Copy", "copy", () => void copyText(movie).then(() => { status.textContent = "Copied."; }), "quiet"));
    help.hidden = false;
  };

  const make = async (): Promise<void> => {
    const control = running = new AbortController(), count = new FrameCounter(), parts: Uint8Array[] = [], wanted = Number(frames.value);
    let size = 0;
    save.disabled = true;
    cancel.hidden = bar.hidden = false;
    help.hidden = true;
    bar.removeAttribute("value"); // until the first frames come it only says that work goes on
    status.textContent = "Rendering…";
    try {
      const reader = await api.turntable({ ...options(), frames: wanted, fps: Number(fps.value) }, control.signal);
      for (let part = await reader.read(); !part.done; part = await reader.read()) {
        parts.push(part.value);
        size += part.value.length;
        count.add(part.value);
        if (count.frames > 0) bar.value = count.frames / wanted;
        if (count.frames > 0) status.textContent = `Frame ${count.frames} of ${wanted}, ${bytes(size)}`;
      }
      download(`${state.dataset}-turntable.mp4`, new Blob(parts, { type: "video/mp4" }));
      status.textContent = `Saved: ${length()}, ${bytes(size)}.`;
    } catch (error) {
      status.textContent = control.signal.aborted ? "Cancelled." : parts.length > 0 ? "The movie stopped. Is the service still running?" : error instanceof Error ? error.message : String(error);
      if (error instanceof ApiError && error.status === 501) await offerCommand().catch(() => undefined);
    }
    running = null;
    save.disabled = false;
    cancel.hidden = bar.hidden = true;
  };

  const form = h("form", { onsubmit: (event: Event) => { event.preventDefault(); void make(); } },
    h("p", { class: "hint" }, "An MP4. The service renders each frame."),
    h("div", { class: "size-row" }, w, h("span", { "aria-hidden": "true" }, "×"), t, h("span", {}, "pixels")),
    h("div", { class: "size-row" }, frames, h("span", {}, "frames,"), fps, h("span", {}, "a second")),
    ...(ways.length > 1 ? [row("Way", start.element)] : []), ...marks.elements, bar, status, help, h("div", { class: "dialog-actions" }, cancel, save));
  dialog(element, "Movie", form).addEventListener("close", () => running?.abort());
}
