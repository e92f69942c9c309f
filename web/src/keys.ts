// What keys do: one table, for the keyboard and for the help.
import { put } from "./dom";

export interface Key { keys: readonly string[]; label: string; does: string; run: (far: boolean, at: number) => void }
export interface KeyGroup { title: string; keys: readonly Key[] }

// Letters act while a picture has the focus, or nothing has; in fields they are text.
function isForPictures(target: EventTarget | null): boolean {
  return target === document.body || (target instanceof HTMLElement && target.closest(".pane") !== null && !target.closest("dialog"));
}

export function listenToKeys(groups: readonly KeyGroup[], undo: () => void, redo: () => void): void {
  // The picture has the focus from the start; its ring shows once keys are used.
  document.addEventListener("keydown", () => put(document.body, "data-keys", "used"), true);
  document.addEventListener("pointerdown", () => { delete document.body.dataset["keys"]; }, true);
  document.addEventListener("keydown", event => {
    const field = event.target instanceof HTMLElement && event.target.matches("input[type=text], input[type=number], textarea");
    if ((event.ctrlKey || event.metaKey) && !field && /^[zy]$/i.test(event.key)) {
      event.preventDefault();
      return event.key.toLowerCase() === "y" || event.shiftKey ? redo() : undo();
    }
    if (event.ctrlKey || event.metaKey || event.altKey || !isForPictures(event.target)) return;
    const key = groups.flatMap(group => group.keys).find(each => each.keys.includes(event.key.length === 1 ? event.key.toLowerCase() : event.key));
    if (!key) return;
    event.preventDefault();
    key.run(event.shiftKey, event.timeStamp);
  });
}
