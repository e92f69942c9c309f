// The machine panel: the workers, and what they did for the last picture. A worker that dies stays for a while, marked as lost.
import { iconButton } from "./controls";
import { bytes, h, shown } from "./dom";
import type { ServiceStatus, Span, Statistics, WorkerStatus } from "./session";
import { bar, busyMs, endOf, KINDS, sparkline } from "./timeline";

const LOST_SHOWN_MS = 30000;
const SILENT_MS = 1500;
const REDRAW_MS = 120;
const KEPT_FRAMES = 90;

interface Seen { status: WorkerStatus; lostAt: number | null; element: HTMLElement; lane: HTMLElement; name: HTMLElement; facts: HTMLElement }

export class Machine {
  readonly element: HTMLElement;
  private readonly figures = h("dl", { class: "figures" });
  private readonly lanes = h("div", { class: "lanes", role: "list", "aria-label": "Workers" });
  private readonly axis = h("div", { class: "lane-axis", "aria-hidden": "true" });
  private readonly news = h("p", { class: "machine-news", role: "status" });
  private readonly spark = h("div", { class: "spark" });
  private readonly seen = new Map<number, Seen>();
  private statistics: Statistics | null = null;
  private latencies: number[] = [];
  private timer = 0;

  constructor(close: () => void) {
    this.element = h("section", { class: "machine", "aria-label": "Machine", hidden: true },
      h("header", {}, h("h2", {}, "Machine"), this.spark, h("span", { class: "space" }), h("ul", { class: "legend", "aria-label": "Colours of the timeline" }, ...KINDS.map(([kind, name]) => h("li", { class: kind }, name)), h("li", { class: "idle" }, "Idle")), iconButton("Close the machine panel", "close", close, "M")),
      this.news, this.figures, this.lanes, this.axis);
  }

  setOpen(open: boolean): void {
    if (this.element.hidden === !open) return;
    this.element.hidden = !open;
    if (open) this.redraw();
  }

  onFrame(statistics: Statistics): void {
    this.statistics = statistics;
    this.latencies = [...this.latencies.slice(1 - KEPT_FRAMES), statistics.latency_ms];
    this.later();
  }

  onStatus(status: ServiceStatus): void {
    const now = performance.now(), present = new Set(status.workers.map(worker => worker.worker));
    for (const worker of status.workers) this.place(worker);
    for (const [id, seen] of this.seen) {
      if (!present.has(id) && seen.lostAt === null && status.service !== "gone") seen.lostAt = now;
      if (seen.lostAt !== null && now - seen.lostAt > LOST_SHOWN_MS) { seen.element.remove(); this.seen.delete(id); }
    }
    const lost = [...this.seen.values()].filter(seen => seen.lostAt !== null).length;
    this.news.textContent = lost > 0 ? `${lost} of ${this.seen.size} workers lost. The others do its work.` : status.service === "gone" ? "The service is gone." : "";
    this.later();
  }

  private place(status: WorkerStatus): void {
    const known = this.seen.get(status.worker);
    if (known) { known.status = status; known.lostAt = null; return; }
    const lane = h("div", { class: "lane" }), name = h("span", { class: "worker-name" }), facts = h("span", { class: "worker-facts" });
    const element = h("div", { class: "worker", role: "listitem", "data-worker": status.worker }, h("div", { class: "worker-head" }, h("span", { class: "lamp", "aria-hidden": "true" }), name, facts), lane);
    this.seen.set(status.worker, { status, lostAt: null, element, lane, name, facts });
    const after = [...this.seen.keys()].filter(id => id > status.worker).sort((a, b) => a - b)[0];
    this.lanes.insertBefore(element, after === undefined ? null : (this.seen.get(after) as Seen).element);
  }

  private later(): void {
    if (this.timer || this.element.hidden) return;
    this.timer = setTimeout(() => { this.timer = 0; this.redraw(); }, REDRAW_MS);
  }

  private redraw(): void {
    const timeline = this.statistics?.timeline ?? [], end = endOf(timeline);
    for (const [id, seen] of this.seen) this.drawWorker(id, seen, timeline.filter(span => span.worker === id), end);
    this.axis.replaceChildren(...[0, 0.25, 0.5, 0.75, 1].map(share => h("span", {}, end > 0 ? `${(end * share).toFixed(end < 20 ? 1 : 0)} ms` : "")));
    this.spark.replaceChildren(...(this.latencies.length > 1 ? [sparkline(this.latencies, 96, 18)] : []));
    if (this.statistics) this.drawFigures(this.statistics);
  }

  private drawWorker(id: number, { status, lostAt, element, lane, name, facts }: Seen, spans: Span[], end: number): void {
    const state = lostAt !== null ? "lost" : status.leaving ? "leaving" : status.silent_ms > SILENT_MS ? "silent" : "well";
    element.dataset["state"] = state;
    const load = end > 0 ? Math.round((100 * busyMs(spans)) / end) : 0;
    name.textContent = `${status.host}:${status.pid}`;
    name.title = `Worker ${id}, ${status.threads} threads`;
    facts.textContent = state === "lost" ? `lost ${Math.round((performance.now() - (lostAt as number)) / 1000)} s ago` : state === "silent" ? `silent for ${(status.silent_ms / 1000).toFixed(1)} s` : `${state === "leaving" ? "leaving, " : ""}${load} % busy, ${bytes(status.cached_bytes)}`;
    if (spans.length > 0) lane.replaceChildren(bar(spans, end));
    else if (lostAt === null || end === 0) lane.replaceChildren();
  }

  private drawFigures({ latency_ms, round_trip_ms, encode_ms, imbalance, idle_share, groups, workers, attempts, bytes: moved, plan }: Statistics): void {
    const figure = (name: string, value: string): HTMLElement => h("div", {}, h("dt", {}, name), h("dd", {}, value));
    this.figures.replaceChildren(
      figure("Frame", `${shown(latency_ms, 3)} ms`), figure("Encode", `${shown(encode_ms, 2)} ms`), figure("Round trip", `${shown(round_trip_ms, 2)} ms`),
      figure("Imbalance", shown(imbalance, 3)), figure("Idle", `${Math.round(idle_share * 100)} %`), figure("Workers", `${workers}${attempts > 1 ? `, attempt ${attempts}` : ""}`), figure("Groups", String(groups)),
      figure("Voxels moved", bytes(moved.voxels)), figure("Between workers", bytes(moved.images)), figure("Picture", bytes(moved.picture)),
      figure("Plan", `${plan["renderer"] ?? ""}, ${plan["decomposition"] ?? ""} ${plan["axis"] ?? ""}, ${plan["combine"] ?? ""}`));
  }
}
