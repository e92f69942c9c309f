// Measuring: the tool that is in hand, its points so far, and what the service says of profiles and boxes.
import { sourceOf } from "./channels";
import type { Context } from "./context";
import { shown as text } from "./dom";
import { angleOf, boxOf, type BoxStatistics, boxRange, distanceOf, type Measure, type MeasureKind, MOST_MEASURES, nameOf, pointsOf, type Profile } from "./measure";
import { roundedPoint, type Vec3 } from "./vec";
import { whenTimeRests } from "./times";
import { unitName } from "./volume";

export interface DrawnMeasure { measure: Measure; label: string }
type Answer = { profile: Profile } | { statistics: BoxStatistics } | { error: string };

export class Measuring {
  tool: MeasureKind | null = null;
  points: readonly Vec3[] = []; // points of the measurement that has begun
  private ahead: Vec3 | null = null; // below the pointer: where the next point would be
  private time: string; // that has stood still
  private readonly answers = new Map<string, Answer | null>(); // null: it is asked
  private readonly listeners: (() => void)[] = [];

  constructor(private readonly context: Context) {
    context.store.subscribe(() => this.changed(), ["measures", "dataset", "channels"]);
    this.time = context.store.state.time;
    whenTimeRests(context, () => { this.time = context.store.state.time; this.changed(); });
    context.onVolume(() => this.changed());
  }

  onChange(listener: () => void): void { this.listeners.push(listener); }

  // The same one again puts it away.
  take(tool: MeasureKind | null): void {
    this.tool = tool === this.tool ? null : tool;
    this.points = [];
    this.ahead = null;
    this.changed();
  }

  // What is shown: the finished ones, and the one that has begun as far as it goes.
  private all(): readonly Measure[] {
    const points = this.ahead ? [...this.points, this.ahead] : this.points;
    return this.tool && points.length > 1 ? [...this.context.store.state.measures, this.made(this.tool, points)] : this.context.store.state.measures;
  }

  drawn(): readonly DrawnMeasure[] { return this.all().map(measure => ({ measure, label: this.label(measure) })); }

  hover(at: Vec3 | null): void {
    if (!this.tool || this.points.length === 0) return;
    this.ahead = at;
    this.changed();
  }

  place(at: Vec3): void {
    const { store } = this.context;
    if (!this.tool) return;
    this.points = [...this.points, roundedPoint(at)];
    this.ahead = null;
    if (this.points.length < pointsOf(this.tool)) return this.changed();
    const measure = this.made(this.tool, this.points);
    this.points = [];
    if (store.state.measures.length < MOST_MEASURES) store.update({ measures: [...store.state.measures, measure] }, "measure");
    else this.context.say(`At most ${MOST_MEASURES} measurements.`, "error");
  }

  remove(index: number): void { this.context.store.update({ measures: this.context.store.state.measures.filter((_, i) => i !== index) }, "no measure"); }

  profileOf(measure: Measure): Profile | null {
    const answer = measure.kind === "profile" ? this.answerTo(measure) : null;
    return answer && "profile" in answer ? answer.profile : null;
  }

  // In few words, for the picture.
  label(measure: Measure): string {
    if (measure.kind === "angle") return measure.points.length < 3 ? "" : `${angleOf(measure).toFixed(1)}°`;
    if (measure.kind !== "box") return this.length(distanceOf(measure));
    const answer = this.isFinished(measure) ? this.answerTo(measure) : null;
    return answer && "statistics" in answer ? this.meanOf(answer.statistics) : "";
  }

  // All that is known, for the panel.
  details(measure: Measure): string {
    const label = this.label(measure), answer = measure.kind === "box" || measure.kind === "profile" ? this.answerTo(measure) : null;
    if (answer && "error" in answer) return answer.error;
    if (answer && "profile" in answer) {
      const values = answer.profile.values.filter((value): value is number => value !== null);
      return values.length === 0 ? `${label}, no values` : `${label}, ${text(Math.min(...values))} to ${text(Math.max(...values))}`;
    }
    if (!answer || !("statistics" in answer)) return label || "…";
    const [low, high] = measure.points as readonly [Vec3, Vec3], { voxels, least, largest } = answer.statistics;
    const sides = [0, 1, 2].map(i => ((high[i] as number) - (low[i] as number)).toFixed(1)).join(" × ");
    return `${label}${least === null ? "" : `, ${text(least)} to ${text(largest as number)}`}, ${voxels} voxel${voxels === 1 ? "" : "s"}, ${sides} ${this.unit()}`;
  }

  // A table for other programs: a line for each measurement, its columns divided by tabs.
  table(): string {
    const lines = this.context.store.state.measures.map(measure => [nameOf(measure.kind), this.details(measure), ...measure.points.map(p => p.join(","))].join("\t"));
    return `${["Measurement", `Value`, "Points"].join("\t")}\n${lines.join("\n")}\n`;
  }

  private made(kind: MeasureKind, points: readonly Vec3[]): Measure {
    const spacing = this.context.volume()?.spacing ?? ([0, 0, 0] as const);
    return kind === "box" ? boxOf(points[0] as Vec3, points[points.length - 1] as Vec3, spacing) : { kind, points };
  }

  private unit(): string { return unitName(this.context.volume()?.unit ?? ""); }
  private length(value: number): string { return `${value.toFixed(1)} ${this.unit()}`; }
  private meanOf({ mean, deviation }: BoxStatistics): string { return mean === null ? "no voxels" : `mean ${text(mean)} ± ${text(deviation as number, 3)}`; }
  private isFinished(measure: Measure): boolean { return this.context.store.state.measures.includes(measure); }

  private answerTo(measure: Measure): Answer | null {
    const volume = this.context.volume(), { kind, points } = measure;
    if (!volume || this.context.store.state.time !== this.time) return null;
    const source = { ...sourceOf(this.context.offers, this.context.store.state), dataset: volume.name }, key = JSON.stringify([source, kind, points]), known = this.answers.get(key);
    if (known !== undefined) return known;
    this.answers.set(key, null);
    const { api } = this.context;
    const asked: Promise<Answer> = kind === "profile"
      ? api.profile(source, points[0] as Vec3, points[1] as Vec3).then(profile => (profile ? { profile } : { error: "This gateway makes no profiles." }))
      : api.statistics(source, boxRange(measure)).then(statistics => (statistics ? { statistics } : { error: "This gateway makes no statistics." }));
    asked.catch((error: unknown): Answer => ({ error: error instanceof Error ? error.message : String(error) })).then(answer => { this.answers.set(key, answer); this.changed(); });
    return null;
  }

  private changed(): void { for (const listener of this.listeners) listener(); }
}
