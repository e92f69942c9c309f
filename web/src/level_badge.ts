// The badge of a pane: which level of its dataset the picture was drawn from, and what was read for it from files or servers. Pictures of a
// view that moves may be of coarser levels.
import { bytes, h, put, putText } from "./dom";
import type { FrameHeader } from "./session";

// "Level 2 of 0–4"; "" if the dataset has one level.
export function levelText({ statistics }: FrameHeader, count: number): string {
  const drawn = statistics.levels.map(use => use.level), first = drawn[0], last = drawn[drawn.length - 1];
  if (count < 2 || first === undefined || last === undefined) return "";
  return `${first === last ? `Level ${first}` : `Levels ${first}–${last}`} of 0–${count - 1}`;
}

export class LevelBadge {
  readonly element = h("output", { class: "pane-level", "aria-live": "off", hidden: true });

  // `count`: levels of the dataset; 0: it is not known yet.
  show(header: FrameHeader, count: number): void {
    const level = levelText(header, count), read = header.statistics.bytes.stored, sharpens = header.coarseness > 1;
    const text = level !== "" && read > 0 ? `${level}, ${bytes(read)} read` : level;
    putText(this.element, sharpens && text !== "" ? `${text} …` : text);
    put(this.element, "title", sharpens ? "A finer picture follows when the view stands still" : "0 is the finest level");
    put(this.element, "hidden", text === "");
  }
}
