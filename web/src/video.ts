// Decodes pictures that come as VP9. Each chunk is one picture, and can be decoded after all chunks before it. Browsers have a decoder for pages
// over https and on localhost (WebCodecs). A connection whose decoder has failed once has no video any more.
// Profile 0, level 5.1, 8 bits.
const CONFIG = { codec: "vp09.00.51.08", optimizeForLatency: true };

let supported = false;
if ("VideoDecoder" in globalThis) VideoDecoder.isConfigSupported(CONFIG).then(answer => { supported = answer.supported === true; }).catch(() => undefined);

export class VideoPictures {
  private decoder: VideoDecoder | null = null;
  private waiting: { keep(picture: ImageBitmap): void; fail(error: Error): void }[] = [];
  private chunks = 0;
  private failed = false;

  get works(): boolean { return supported && !this.failed; }

  decode(data: Uint8Array, key: boolean): Promise<ImageBitmap> {
    return new Promise((keep, fail) => {
      this.waiting.push({ keep, fail });
      try {
        if (!this.decoder) {
          this.decoder = new VideoDecoder({ output: picture => this.keep(picture), error: error => this.fail(error) });
          this.decoder.configure(CONFIG);
        }
        this.decoder.decode(new EncodedVideoChunk({ type: key ? "key" : "delta", timestamp: this.chunks++ /* only their order counts */, data }));
      } catch (error) {
        this.fail(error as Error);
      }
    });
  }

  close(): void {
    if (this.decoder && this.decoder.state !== "closed") this.decoder.close();
    this.fail(new Error("the connection has ended"));
  }

  private keep(picture: ImageBitmap): void {
    const one = this.waiting.shift();
    if (one) one.keep(picture);
    else picture.close();
  }

  private fail(error: Error): void {
    this.failed = true;
    for (const one of this.waiting.splice(0)) one.fail(error);
  }
}
