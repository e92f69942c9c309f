// Windows over the page: help, the picture as a file, the command, the token.
import type { Context } from "./context";
import { button, choice, iconButton, toggle } from "./controls";
import { copyText, download, h } from "./dom";
import type { KeyGroup } from "./keys";
import { renderOptions } from "./options";
import { type Part, pictureFile } from "./saving";

// In a viewer, or in a place that has its style.
export function dialog(place: HTMLElement, title: string, ...content: (HTMLElement | null)[]): HTMLDialogElement {
  const element: HTMLDialogElement = h("dialog", { "aria-label": title, onclose: () => element.remove(), onclick: (event: MouseEvent) => { if (event.target === element) element.close(); } },
    h("div", { class: "dialog-body" }, h("header", {}, h("h2", {}, title), iconButton("Close", "close", () => element.close(), "Esc")), ...content));
  place.append(element);
  element.showModal();
  return element;
}

const POINTER_HELP: readonly (readonly [string, string])[] = [
  ["Drag", "Turn"], ["Shift and drag, or middle button", "Move"], ["Wheel", "Zoom about the pointer"], ["Ctrl and drag", "Roll"],
  ["Right button and drag", "Window and level: sideways widens, upwards brightens"], ["Double click", "Put the cross-hair there"],
  ["One finger", "Turn"], ["Two fingers", "Move, zoom and roll"],
];

export function helpDialog(place: HTMLElement, groups: readonly KeyGroup[], takesVolumes: boolean): void {
  const drop = ["Drop a file", takesVolumes ? "Show it: a volume, or a colour map (ParaView’s JSON)" : "Take it as colour map (ParaView’s JSON)"] as const;
  const table = (rows: readonly (readonly [string, string])[]): HTMLElement => h("dl", { class: "keys" }, ...rows.map(([key, does]) => h("div", {}, h("dt", {}, h("kbd", {}, key)), h("dd", {}, does))));
  dialog(place, "Help", h("div", { class: "help" },
    h("section", {}, h("h3", {}, "Pointer and touch"), h("dl", { class: "keys wide" }, ...[...POINTER_HELP, drop].map(([key, does]) => h("div", {}, h("dt", {}, key), h("dd", {}, does))))),
    ...groups.map(group => h("section", {}, h("h3", {}, group.title), table(group.keys.map(key => [key.label, key.does]))))));
}

export function tokenDialog(place: HTMLElement, reason: string, use: (token: string) => void): void {
  const input = h("input", { type: "text", id: "token", placeholder: " ", autocomplete: "off", spellcheck: "false", required: true });
  const form = h("form", { method: "dialog", onsubmit: () => use(/token=([^&\s]+)/.exec(input.value)?.[1] ?? input.value.trim()) },
    h("p", {}, reason), h("label", { for: "token" }, "Token, or the whole address that slabstream view printed"), input,
    h("div", { class: "dialog-actions" }, h("button", { type: "submit", class: "button primary" }, "Open")));
  dialog(place, "This viewer needs a token", form);
  input.focus();
}

const SIZES: readonly (readonly [string, number, number])[] = [["Square", 1024, 1024], ["Full HD", 1920, 1080], ["4K", 3840, 2160]];

// `parts`: of the panes, the 3-D picture first.
export function screenshotDialog(context: Context, parts: readonly Part[], width: number, height: number, paneSize: readonly [number, number]): void {
  const { state } = context.store;
  const field = (label: string, value: number): HTMLInputElement => h("input", { type: "number", min: 16, max: 8192, step: 1, required: true, value, "aria-label": label });
  const w = field("Width in pixels", paneSize[0]), t = field("Height in pixels", paneSize[1]);
  let transparent = false, marked = state.scaleBar, chosen: readonly Part[] = parts.slice(0, 1), name = "";
  const shownSize = (): readonly [number, number] => (chosen.length > 1 ? [width, height] : paneSize);
  const setSize = (x: number, y: number): void => { w.value = String(x); t.value = String(y); };
  const what = choice("Picture", [...parts.map(part => [part.name, part.title] as const), ["all", "All panes"]], value => {
    name = value === parts[0]?.name ? "" : `-${value}`;
    chosen = value === "all" ? parts : parts.filter(part => part.name === value);
    setSize(...shownSize());
  });
  const clear = toggle("Transparent background", on => { transparent = on; }), notes = toggle("Scale bar, sides, measurements and legend", on => { marked = on; });
  notes.set(marked);
  const status = h("p", { role: "status", class: "hint" });
  const save = h("button", { type: "submit", class: "button primary" }, "Save PNG");
  const shoot = async (): Promise<void> => {
    save.disabled = true;
    status.textContent = "Rendering…";
    try {
      download(`${state.dataset}${name}-${w.value}x${t.value}.png`, await pictureFile(context, chosen, { width: Number(w.value), height: Number(t.value), marked, transparent }));
      status.textContent = "Saved.";
    } catch (error) {
      status.textContent = error instanceof Error ? error.message : String(error);
    }
    save.disabled = false;
  };
  const form = h("form", { onsubmit: (event: Event) => { event.preventDefault(); void shoot(); } },
    h("p", { class: "hint" }, "The service renders the picture again, at any size, lossless."), ...(parts.length > 1 ? [what.element] : []),
    h("div", { class: "size-row" }, w, h("span", { "aria-hidden": "true" }, "×"), t, h("span", {}, "pixels")),
    h("div", { class: "button-row" }, button("As shown", null, () => setSize(...shownSize()), "quiet"), ...SIZES.map(([size, x, y]) => button(size, null, () => setSize(x, y), "quiet"))),
    clear.element, notes.element, status, h("div", { class: "dialog-actions" }, save));
  dialog(context.element, "Picture", form);
}

// The commands that make this picture, and a movie that turns it.
export async function commandDialog({ store: { state }, offers, api, element, say }: Context, width: number, height: number): Promise<void> {
  try {
    const { command, files } = await api.command({ ...renderOptions(offers, state), size: `${width}x${height}` });
    const movie = command.replace(/^slabstream render/, "slabstream turntable").replace(/ -o \S+$/, " --frames 120 -o turntable.mp4");
    const line = (title: string, text: string): HTMLElement => h("section", {}, h("h3", {}, title), h("pre", { tabindex: 0 }, text), button("Copy", "copy", () => void copyText(text).then(() => say("Copied.")), "quiet"));
    dialog(element, "Command", line("This picture", command), line("A movie of one turn (needs ffmpeg)", movie),
      ...Object.entries(files ?? {}).map(([name, text]) => h("section", {}, h("h3", {}, `The file ${name}`), h("p", { class: "hint" }, "The command reads this colour map."), button(`Save ${name}`, "save", () => download(name, new Blob([text], { type: "application/json" })), "quiet"))));
  } catch (error) {
    say(error instanceof Error ? error.message : String(error), "error");
  }
}
