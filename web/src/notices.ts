// What the page says over the picture: what is wrong, what is loading, and short messages.
import { h, put, putText } from "./dom";
import type { Progress, Reached, ServiceStatus } from "./session";

const MESSAGE_MS = 5000;
const SLOW_MS = 400;

export class Notices {
  readonly banner = h("div", { class: "banner", role: "alert", hidden: true });
  private readonly bar = h("div", { class: "progress-bar" });
  private readonly doing = h("span", { class: "progress-text" });
  readonly progress = h("div", { class: "progress", role: "progressbar", "aria-label": "Loading", hidden: true }, h("div", { class: "progress-track" }, this.bar), this.doing);
  readonly messages = h("div", { class: "messages", role: "status", "aria-live": "polite" });
  readonly status = h("output", { class: "status", "aria-live": "off" });
  private connection: Reached = "connecting";
  private everOpen = false;
  private reason = "";
  private refusal = "";
  private service: ServiceStatus | null = null;
  private error = "";
  private phase = "";
  private done = 0; // how much of the phase is done, as a share
  private parts = ""; // how many parts of the picture are drawn
  private slow = 0; // the timer of a phase; it shows once it has lasted
  private lasts = false;

  say(message: string, kind: "note" | "error" = "note"): void {
    const element = h("p", { class: `message ${kind}` }, message);
    this.messages.replaceChildren(element);
    setTimeout(() => element.remove(), kind === "error" ? 2 * MESSAGE_MS : MESSAGE_MS);
  }

  onConnection(connection: Reached, reason: string): void {
    if (connection === "open") { this.everOpen = true; this.reason = ""; }
    else if (reason) this.reason = reason;
    if (connection !== "connecting" || this.connection === "open") this.connection = connection; // while it tries again it stays lost
    if (connection === "lost") this.setPhase("");
    this.draw();
  }

  onRefused(line: string): void { this.refusal = line; this.draw(); } // for good
  onStatus(status: ServiceStatus): void { this.service = status; if (status.service !== "ready") this.setPhase(""); this.draw(); }
  onError(message: string): void { this.error = message; this.setPhase(""); this.draw(); }

  onProgress(progress: Progress): void {
    const read = progress.phase === "loading" ? progress.read_percent ?? 0 : 0;
    this.done = read > 0 ? read / 100 : progress.group_count > 0 ? progress.groups_done / progress.group_count : 0;
    this.parts = progress.group_count > 1 ? `${progress.groups_done} of ${progress.group_count} parts` : "";
    this.setPhase(progress.phase === "loading" ? (read > 0 ? `Reading, ${read} %` : "Reading") : progress.phase === "queued" && progress.queue_position > 0 ? `Waiting, place ${progress.queue_position}` : progress.phase === "running" ? "Rendering" : "");
    this.draw();
  }

  // A picture came: nothing is wrong with the view, unless it lacks something, and nothing is being waited for.
  onFrame(lacks = ""): void {
    if (this.error === lacks && this.phase === "") return;
    this.error = lacks;
    this.setPhase("");
    this.draw();
  }

  private setPhase(phase: string): void {
    this.phase = phase;
    if (phase !== "") { this.slow ||= setTimeout(() => { this.lasts = true; this.draw(); }, SLOW_MS); return; }
    clearTimeout(this.slow);
    this.slow = 0;
    this.lasts = false;
  }

  private draw(): void {
    const said = this.problem();
    putText(this.banner, said);
    put(this.banner, "hidden", said === "");
    put(this.progress, "hidden", !this.lasts || said !== "");
    if (this.lasts) {
      put(this.progress, "data-measured", this.done > 0);
      if (this.done > 0) put(this.progress, "aria-valuenow", String(Math.round(100 * this.done)));
      else this.progress.removeAttribute("aria-valuenow");
      putText(this.doing, this.phase.startsWith("Reading") ? this.phase : this.phase === "Rendering" ? this.parts : "");
      this.bar.style.width = this.done > 0 ? `${100 * this.done}%` : "";
    }
    const workers = this.service?.workers.length ?? 0;
    put(this.status, "data-state", said ? "bad" : this.connection === "open" && this.service ? "good" : "wait");
    putText(this.status, this.connection === "lost" ? "Not connected" : this.connection === "connecting" ? "Connecting" : this.service?.service === "gone" ? "Service gone" : this.service?.service === "no-workers" ? "No workers"
      : (this.phase !== "Rendering" && this.phase) || (this.service ? `${workers} worker${workers === 1 ? "" : "s"}` : "Connecting"));
  }

  private problem(): string {
    if (this.refusal) return this.refusal;
    if (this.connection === "lost") return `${this.everOpen ? "The gateway no longer answers." : "The gateway does not answer."}${this.reason ? ` It said: ${this.reason}.` : ""} Trying again.`;
    if (this.connection === "open" && this.service && this.service.service !== "ready") {
      const { service, reason } = this.service;
      const what = service === "gone" ? `The rendering service is gone${reason ? `: ${reason}` : ""}` : "The service has no worker";
      return `${what}. The picture stays; it moves again when the service is back.`;
    }
    return this.error;
  }
}
