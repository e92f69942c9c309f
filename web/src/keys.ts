// What keys do: one table, for the keyboard and for the help.
import { put } from "./dom";

export interface Key { keys: readonly string[]; label: string; does: string; run: (far: boolean, at: number) => void }
export interface KeyGroup { title: string; keys: readonly Key[] }

const TEXT_FIELDS = "input[type=text], input[type=number], textarea";
// Controls that arrows change.
const ARROW_CONTROLS = "input[type=range], input[type=radio], select, [role=menuitem]";

// Keys act wherever the focus is, but in text fields, where they are text, and while a dialog is open. A control keeps the arrows that change it.
function actsOn(target: EventTarget | null, key: string): boolean {
  return target instanceof Element && !document.querySelector("dialog[open]") && !target.matches(TEXT_FIELDS) && !(key.startsWith("Arrow") && target.matches(ARROW_CONTROLS));
}

export function listenToKeys(groups: readonly KeyGroup[], undo: () => void, redo: () => void): void {
  // The picture has the focus from the start; its ring shows once keys are used.
  document.addEventListener("keydown", () => put(document.body, "data-keys", "used"), true);
  document.addEventListener("pointerdown", () => { delete document.body.dataset["keys"]; }, true);
  document.addEventListener("keydown", event => {
    const field = event.target instanceof HTMLElement && event.target.matches(TEXT_FIELDS);
    if ((event.ctrlKey || event.metaKey) && !field && /^[zy]$/i.test(event.key)) {
      event.preventDefault();
      return event.key.toLowerCase() === "y" || event.shiftKey ? redo() : undo();
    }
    if (event.ctrlKey || event.metaKey || event.altKey || !actsOn(event.target, event.key)) return;
    const key = groups.flatMap(group => group.keys).find(each => each.keys.includes(event.key.length === 1 ? event.key.toLowerCase() : event.key));
    if (!key) return;
    event.preventDefault();
    key.run(event.shiftKey, event.timeStamp);
  });
}
