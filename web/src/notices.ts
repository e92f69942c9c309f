// What the page says over the picture: what is wrong, what is loading, and short messages.
import { h } from "./dom";
import type { Connection, Progress, ServiceStatus } from "./session";

const MESSAGE_MS = 5000;

export class Notices {
  readonly banner = h("div", { class: "banner", role: "alert", hidden: true });
  readonly progress = h("div", { class: "progress", role: "progressbar", "aria-label": "Loading", hidden: true }, h("div", { class: "progress-bar" }));
  readonly messages = h("div", { class: "messages", role: "status", "aria-live": "polite" });
  readonly status = h("output", { class: "status", "aria-live": "off" });
  private connection: Connection = "connecting";
  private everOpen = false;
  private reason = "";
  private service: ServiceStatus | null = null;
  private error = "";
  private phase = "";

  say(message: string, kind: "note" | "error" = "note"): void {
    const element = h("p", { class: `message ${kind}` }, message);
    this.messages.replaceChildren(element);
    setTimeout(() => element.remove(), kind === "error" ? 2 * MESSAGE_MS : MESSAGE_MS);
  }

  onConnection(connection: Connection, reason: string): void {
    if (connection === "open") { this.everOpen = true; this.reason = ""; }
    else if (reason) this.reason = reason;
    if (connection !== "connecting" || this.connection === "open") this.connection = connection; // while it tries again it stays lost
    if (connection === "lost") this.phase = "";
    this.draw();
  }

  onStatus(status: ServiceStatus): void { this.service = status; if (status.service !== "ready") this.phase = ""; this.draw(); }
  onError(message: string): void { this.error = message; this.phase = ""; this.draw(); }

  onProgress(progress: Progress): void {
    const done = progress.group_count > 0 ? progress.groups_done / progress.group_count : 0;
    this.phase = progress.phase === "loading" ? "Loading" : progress.phase === "queued" && progress.queue_position > 0 ? `Waiting, place ${progress.queue_position}` : progress.phase === "running" ? "Rendering" : "";
    this.progress.toggleAttribute("data-measured", done > 0);
    (this.progress.firstElementChild as HTMLElement).style.width = done > 0 ? `${100 * done}%` : "";
    this.draw();
  }

  // A picture came: nothing is wrong with the view, and nothing is being waited for.
  onFrame(): void {
    if (this.error === "" && this.phase === "") return;
    this.error = this.phase = "";
    this.draw();
  }

  private draw(): void {
    const said = this.problem();
    if (this.banner.textContent !== said) this.banner.textContent = said;
    this.banner.hidden = said === "";
    this.progress.hidden = this.phase === "" || said !== "";
    const workers = this.service?.workers.length ?? 0;
    this.status.dataset["state"] = said ? "bad" : this.connection === "open" && this.service ? "good" : "wait";
    this.status.value = this.connection === "lost" ? "Not connected" : this.connection === "connecting" ? "Connecting" : this.service?.service === "gone" ? "Service gone" : this.service?.service === "no-workers" ? "No workers"
      : (this.phase !== "Rendering" && this.phase) || (this.service ? `${workers} worker${workers === 1 ? "" : "s"}` : "Connecting");
  }

  private problem(): string {
    if (this.connection === "lost") return `${this.everOpen ? "The gateway does not answer any more." : "The gateway does not answer."}${this.reason ? ` It said: ${this.reason}.` : ""} Trying again.`;
    if (this.connection === "open" && this.service && this.service.service !== "ready") {
      const { service, reason } = this.service;
      return `${service === "gone" ? "The rendering service is gone" : "The service has no worker"}${reason ? `: ${reason}` : ""}. The picture stays; it moves again when the service is back.`;
    }
    return this.error;
  }
}
