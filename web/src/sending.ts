// A file of the user's computer on its way to the service, where it becomes a dataset: in parts, with a bar that says how far it is.
import { Api, ApiError } from "./api";
import { button } from "./controls";
import { bytes, h, putText } from "./dom";

const PART_BYTES = 1 << 20; // as the gateway takes at a time
const ATTEMPTS = 6, PAUSE_MS = 1000;

export class Sending {
  private readonly text = h("span", {});
  private readonly bar = h("progress", { max: 1, value: 0, "aria-label": "How much of the file is sent" });
  readonly element = h("div", { class: "sending", role: "status", hidden: true }, this.text, this.bar, button("Cancel", null, () => this.cancel(), "quiet"));
  private running: AbortController | null = null;

  constructor(private readonly api: Api, private readonly say: (message: string, kind?: "note" | "error") => void, private readonly show: (dataset: string) => void) {}

  cancel(): void { this.running?.abort(); }

  async send(file: File): Promise<void> {
    if (this.running) return this.say("Another file is being sent.", "error");
    const control = this.running = new AbortController();
    let upload = "";
    this.element.hidden = false;
    this.tell(file, 0);
    try {
      if (file.size === 0) throw new Error("the file is empty, or a folder");
      upload = (await this.post({ file: file.name, bytes: String(file.size) }, null, control.signal)).upload ?? "";
      for (let begin = 0; begin < file.size; begin += PART_BYTES) {
        const answer = await this.post({ upload, begin: String(begin) }, file.slice(begin, begin + PART_BYTES), control.signal);
        this.tell(file, answer.received ?? 0);
        if (answer.dataset) this.show(answer.dataset);
      }
    } catch (error) {
      if (upload && !(error instanceof ApiError)) void this.api.send("upload", { upload, drop: "true" }, null).catch(() => undefined);
      if (control.signal.aborted) this.say(`${file.name} is not sent.`);
      else this.say(`${file.name}: ${error instanceof DOMException ? "it cannot be read" : error instanceof Error ? error.message : String(error)}`, "error");
    }
    this.running = null;
    this.element.hidden = true;
  }

  // A part that may have come is sent again if the connection breaks.
  private async post(fields: Record<string, string>, part: Blob | null, signal: AbortSignal): Promise<{ upload?: string; received?: number; dataset?: string }> {
    const body = part && (await part.arrayBuffer()); // an error here is the file's
    for (let attempt = 1; ; attempt++) {
      try {
        return await (await this.api.send("upload", fields, body, signal)).json();
      } catch (error) {
        if (error instanceof ApiError || signal.aborted) throw error;
        if (attempt === ATTEMPTS) throw new Error("the gateway does not answer");
        await new Promise(resolve => setTimeout(resolve, PAUSE_MS));
      }
    }
  }

  private tell(file: File, sent: number): void {
    this.bar.value = sent / file.size || 0;
    putText(this.text, sent < file.size ? `Sending ${file.name}: ${bytes(sent)} of ${bytes(file.size)}` : `${file.name} is sent.`);
  }
}
