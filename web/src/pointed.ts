// What lies below the pointer: position, values of what shows, and label, asked for once the pointer rests.
import { ApiError, type LabelName, NAMES, type Value } from "./api";
import { shownKeys, sourceOf } from "./channels";
import type { Context } from "./context";
import { h, shown } from "./dom";
import { renderOptions } from "./options";
import type { Shown } from "./shown";
import { rounded, type Vec3 } from "./vec";
import { unitName } from "./volume";

const REST_MS = 120;

export class Pointed {
  readonly element = h("output", { class: "readout", "aria-live": "off" });
  private timer = 0;
  private asking: AbortController | null = null;

  constructor(private readonly context: Context, private readonly onLabel: (label: LabelName) => void) {}

  // In a slice the position is known at once.
  atPoint(at: Vec3 | null): void {
    this.cancel();
    if (!at) return this.say("");
    this.say(this.position(at));
    const { offers, store: { state } } = this.context;
    this.later(signal => this.context.api.value({ ...sourceOf(offers, state), [NAMES.field]: shownKeys(offers, state).join(",") }, at, signal));
  }

  // In the 3-D picture it is picked, at a point of the page's pixels.
  atPixel(pane: Shown | null, x: number, y: number, found: (at: Vec3) => void): void {
    this.cancel();
    if (!pane || !this.context.volume() || this.context.api.lacks("pick")) return;
    this.later(async signal => {
      const value = await this.pick(pane, x, y, signal);
      if (value?.at && value.hit !== false) found(value.at);
      return value;
    });
  }

  pick(pane: Shown, x: number, y: number, signal?: AbortSignal): Promise<Value | null> {
    const [width, height] = pane.frame.header.size, up = width / pane.cssWidth;
    return this.context.api.pick({ ...renderOptions(this.context.offers, this.context.store.state), size: `${width}x${height}` }, rounded(x * up), rounded(y * up), signal);
  }

  clear(): void { this.cancel(); this.say(""); }

  private later(ask: (signal: AbortSignal) => Promise<Value | null>): void {
    this.timer = setTimeout(() => {
      const asking = (this.asking = new AbortController());
      ask(asking.signal).then(value => { if (this.asking === asking) this.tell(value); })
        .catch(error => { if (this.asking === asking && error instanceof ApiError) this.say(""); });
    }, REST_MS);
  }

  private cancel(): void {
    clearTimeout(this.timer);
    this.asking?.abort();
    this.asking = null;
  }

  private tell(value: Value | null): void {
    if (!value) return;
    if (value.hit === false || !value.at) return this.say("");
    const label = value.label ?? null;
    if (label && label.value > 0) this.onLabel(label);
    const fields = (value.fields ?? []).map(field => (field.value === null ? "" : `${field.name === "volume" ? "value" : field.name} ${shown(field.value)}`));
    const shape = value.shape === undefined ? "" : `${value.shape}${typeof value.shape_value === "number" ? ` ${shown(value.shape_value)}` : ""}`;
    this.say(this.position(value.at), shape, ...fields, label && label.value > 0 ? label.name || `label ${label.value}` : "");
  }

  private position(at: Vec3): string {
    const volume = this.context.volume();
    const names = volume?.world === "patient" ? ["R", "A", "S"] : ["x", "y", "z"];
    return `${at.map((c, i) => `${names[i] as string} ${c.toFixed(1).replace("-", "−")}`).join("  ")} ${volume ? unitName(volume.unit) : ""}`;
  }

  private say(...parts: string[]): void {
    if (parts.join("") === "" && !this.element.hasChildNodes()) return;
    this.element.replaceChildren(...parts.filter(part => part !== "").map(part => h("span", {}, part)));
  }
}
