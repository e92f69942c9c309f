// The time line: which time of the dataset shows, and playing through all of them. A time that cannot be drawn in time is left out.
import { NAMES, type Options } from "./api";
import type { Context } from "./context";
import { choice, iconButton } from "./controls";
import { h, icon, put, putText } from "./dom";
import { LAST, numberOf, timeOptions, timesOf, timeText } from "./times";
import { clamp } from "./vec";

const SPEEDS = [1, 2, 5, 10, 15, 25], USUAL_SPEED = 5;

export class Player {
  private readonly back = iconButton("Time before", "back", () => this.step(-1), ",");
  private readonly play = iconButton("Play", "play", () => this.toggle(), "Space");
  private readonly forth = iconButton("Next time", "forth", () => this.step(1), ".");
  private readonly slider: HTMLInputElement = h("input", { type: "range", min: 0, step: 1, "aria-label": "Time", oninput: () => this.show(Number(this.slider.value)) });
  private readonly text = h("output", {});
  private readonly loop = iconButton("Loop", "loop", () => { put(this.loop, "aria-pressed", String(!this.loops)); this.begin(); });
  private readonly live = iconButton("Live: the newest time", "live", () => { this.pause(); this.context.store.update({ time: this.isLive ? String(this.number) : LAST }); });
  private readonly speeds = choice("Times a second", SPEEDS.map(each => [String(each), `${each} /s`] as const), value => { this.speed = Number(value); this.begin(); });
  readonly element = h("div", { class: "player", role: "group", "aria-label": "Times", hidden: true }, this.back, this.play, this.forth, this.slider, this.text, this.speeds.element, this.loop, this.live);
  private speed = USUAL_SPEED;
  private playing = false;
  private since = { ms: 0, number: 0 }; // when which time was played
  private wanted = -1; // the time whose picture is on its way
  private timer = 0;

  constructor(private readonly context: Context) {
    put(this.loop, "aria-pressed", "true");
    this.play.append(icon("pause"));
    this.speeds.set(String(this.speed));
    context.onVolume(() => this.refresh());
    context.store.subscribe(() => this.refresh(), ["time"]);
    context.store.subscribe(() => this.pause(), ["dataset"]);
    document.addEventListener("visibilitychange", () => { if (this.playing) this.begin(); }, { signal: context.ended });
    context.ended.addEventListener("abort", () => this.pause());
  }

  get present(): boolean { return this.count > 1; }
  private get count(): number { return timesOf(this.context.offers.dataset).count; }
  private get loops(): boolean { return this.loop.getAttribute("aria-pressed") === "true"; }
  private get isLive(): boolean { return this.context.store.state.time === LAST; }
  private get number(): number {
    const { dataset } = this.context.offers;
    return dataset ? numberOf(this.context.store.state.time, dataset) ?? dataset.time ?? 0 : 0;
  }

  toggle(): void {
    if (this.playing) return this.pause();
    if (!this.present) return;
    this.playing = true;
    if (this.number === this.count - 1) this.context.store.update({ time: "0" });
    this.begin();
    this.refresh();
  }

  pause(): void {
    this.playing = false;
    clearTimeout(this.timer);
    this.refresh();
  }

  step(by: number): void {
    this.pause();
    this.show(this.loops ? (this.number + by + this.count) % this.count : clamp(this.number + by, 0, this.count - 1));
  }

  // A picture of the 3-D view is there.
  drawn(options: Options): void {
    if (this.playing && options[NAMES.time] === timeOptions(this.context.offers, this.context.store.state)[NAMES.time] && this.number === this.wanted) this.next();
  }

  refresh(): void {
    const times = timesOf(this.context.offers.dataset), { number } = this;
    put(this.element, "hidden", !this.present);
    if (!this.present) return;
    put(this.slider, "max", String(times.count - 1));
    this.slider.value = String(number);
    put(this.slider, "aria-valuetext", `${timeText(number, times)}, ${number + 1} of ${times.count}`);
    const last = timeText(times.count - 1, times);
    putText(this.text, `${timeText(number, times)} / ${last}`);
    this.text.style.minWidth = `${2 * last.length + 1}ch`; // the slider keeps its width
    put(this.play, "aria-pressed", String(this.playing));
    put(this.live, "aria-pressed", String(this.isLive));
    if (this.playing && number !== this.wanted) this.begin(); // somebody chose another time
  }

  private show(number: number): void { this.context.store.update({ time: String(number) }); }

  // From the present time on.
  private begin(): void {
    this.since = { ms: performance.now(), number: this.number };
    this.wanted = this.number;
    if (this.playing) this.next();
  }

  // The time of now, once the last one has been drawn.
  private next(): void {
    clearTimeout(this.timer);
    if (document.hidden) return;
    const { speed } = this, passed = ((performance.now() - this.since.ms) * speed) / 1000, steps = Math.floor(passed), last = this.count - 1;
    const number = this.since.number + steps;
    if (number > last && !this.loops) {
      this.show(last);
      return this.pause();
    }
    if (number % this.count === this.number) { this.timer = setTimeout(() => this.next(), ((steps + 1 - passed) * 1000) / speed); return; }
    this.wanted = number % this.count;
    this.show(this.wanted);
  }
}
