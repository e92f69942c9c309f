// What keys do: one table, for the keyboard and for the help.
import { put } from "./dom";

export interface Key { keys: readonly string[]; label: string; does: string; run: (far: boolean, at: number) => void }
export interface KeyGroup { title: string; keys: readonly Key[] }

const TEXT_FIELDS = "input[type=text], input[type=number], textarea";
// Controls that arrows change.
const ARROW_CONTROLS = "input[type=range], input[type=radio], select, [role=menuitem]";
// Those that Space presses.
const SPACE_CONTROLS = "button, summary, select, input:not([type=range])";

// Keys act wherever the focus is, but in text fields, where they are text, and while a dialog is open. A control keeps the arrows that change it.
function actsOn(viewer: HTMLElement, target: EventTarget | null, key: string): boolean {
  return target instanceof Element && !viewer.querySelector("dialog[open]") && !target.matches(TEXT_FIELDS) && !(key.startsWith("Arrow") && target.matches(ARROW_CONTROLS)) && !(key === " " && target.matches(SPACE_CONTROLS));
}

// Keys whose place counts where their letter is none of ours, by their places on the keyboard of the United States.
const PLACES: Readonly<Record<string, string>> = { BracketLeft: "[{", BracketRight: "]}", Comma: ",<", Period: ".>", Minus: "-_", Equal: "=+", Slash: "/?" };

// What a key may mean, the likelier first: what it types; and where that is no Latin letter (Greek, Cyrillic, Hebrew, Arabic, ...), or a sign
// in the place of a digit or a bracket (French, Czech, ...), what its place would type. A letter is found where it is printed.
export function meaningsOf({ key, code, shiftKey }: Pick<KeyboardEvent, "key" | "code" | "shiftKey">): readonly string[] {
  const typed = key.length === 1 ? key.toLowerCase() : key;
  if (/^[a-z0-9]$/.test(typed)) return [typed];
  const placed = /^Key([A-Z])$|^Digit([0-9])$/.exec(code), place = placed ? (placed[1] ?? placed[2] ?? "").toLowerCase() : PLACES[code]?.charAt(shiftKey ? 1 : 0);
  return place ? [typed, place] : [typed];
}

// With other keys held, a key belongs to the browser; but many keyboards type brackets with AltGr (Ctrl and Alt to some systems) or Alt.
const isFree = ({ ctrlKey, metaKey, altKey, key }: KeyboardEvent): boolean => (!ctrlKey && !metaKey && !altKey) || (altKey && !metaKey && /^[[\]{}]$/.test(key));

// On a page of its own a viewer hears all keys. Elsewhere it hears keys while it has the focus, and these act on nothing else.
export function listenToKeys(viewer: HTMLElement, isPage: boolean, signal: AbortSignal, groups: () => readonly KeyGroup[], undo: () => void, redo: () => void): void {
  const heard: GlobalEventHandlers = isPage ? document : viewer;
  // The picture has the focus from the start; its ring shows once keys are used.
  heard.addEventListener("keydown", () => put(viewer, "data-keys", "used"), { capture: true, signal });
  heard.addEventListener("pointerdown", () => { delete viewer.dataset["keys"]; }, { capture: true, signal });
  if (!isPage) viewer.addEventListener("keydown", event => { if (!event.ctrlKey && !event.metaKey) event.stopPropagation(); });
  heard.addEventListener("keydown", event => {
    const field = event.target instanceof HTMLElement && event.target.matches(TEXT_FIELDS);
    const meanings = meaningsOf(event), step = meanings.find(each => each === "z" || each === "y");
    if ((event.ctrlKey || event.metaKey) && !event.altKey && !field && step) {
      event.preventDefault();
      event.stopPropagation();
      return step === "y" || event.shiftKey ? redo() : undo();
    }
    if (!isFree(event) || !actsOn(viewer, event.target, event.key)) return;
    const all = groups().flatMap(group => group.keys), meant = meanings.find(each => all.some(({ keys }) => keys.includes(each)));
    const key = all.find(({ keys }) => meant !== undefined && keys.includes(meant));
    if (!key) return;
    event.preventDefault();
    key.run(event.shiftKey, event.timeStamp);
  }, { signal });
}
