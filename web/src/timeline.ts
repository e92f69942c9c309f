// The last frame as each worker lived it: what it did when, and when it had nothing to do.
import { svg } from "./dom";
import type { Span } from "./session";

export type Kind = "voxels" | "render" | "combine" | "finish";
export const KINDS: readonly (readonly [Kind, string])[] = [["voxels", "Voxels"], ["render", "Render"], ["combine", "Combine"], ["finish", "Finish"]];

export function kindOf(stage: string): Kind {
  if (stage === "fetch" || stage === "prepare") return "voxels";
  if (stage === "combine") return "combine";
  return stage === "encode" || stage === "resolve" ? "finish" : "render";
}

export const endOf = (spans: readonly Span[]): number => spans.reduce((end, span) => Math.max(end, span.end_ms), 0);

// How long at least one of the spans was under way.
export function busyMs(spans: readonly Span[]): number {
  let busy = 0, until = -Infinity;
  for (const span of [...spans].sort((a, b) => a.begin_ms - b.begin_ms)) {
    busy += Math.max(0, span.end_ms - Math.max(span.begin_ms, until));
    until = Math.max(until, span.end_ms);
  }
  return busy;
}

const WIDTH = 1000, HEIGHT = 20;

export function bar(spans: readonly Span[], end: number): SVGSVGElement {
  const x = (ms: number): number => (ms / end) * WIDTH;
  return svg("svg", { class: "spans", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "none", "aria-hidden": "true" }, ...spans.map(span =>
    svg("rect", { class: `${kindOf(span.stage)}${span.group % 2 === 1 ? " odd" : ""}`, x: x(span.begin_ms).toFixed(1), y: 1, width: Math.max(1.5, x(span.end_ms) - x(span.begin_ms)).toFixed(1), height: HEIGHT - 2 },
      svg("title", {}, `${span.stage.replace("_", "-")}, group ${span.group + 1}: ${span.begin_ms.toFixed(1)} to ${span.end_ms.toFixed(1)} ms`))));
}

export function sparkline(values: readonly number[], width: number, height: number): SVGSVGElement {
  const most = Math.max(...values, 1), step = width / Math.max(1, values.length - 1);
  const d = values.map((v, i) => `${i === 0 ? "M" : "L"}${(i * step).toFixed(1)} ${(height - 1 - (v / most) * (height - 2)).toFixed(1)}`).join("");
  return svg("svg", { class: "sparkline", viewBox: `0 0 ${width} ${height}`, preserveAspectRatio: "none", "aria-hidden": "true" }, svg("path", { d }));
}
