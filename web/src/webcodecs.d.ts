// What the page uses of WebCodecs (W3C), which older compilers do not know.
interface VideoDecoderConfig { codec: string; optimizeForLatency?: boolean }
declare class EncodedVideoChunk {
  constructor(init: { type: "key" | "delta"; timestamp: number; data: Uint8Array });
}
declare class ImageDecoder {
  constructor(init: { data: Uint8Array; type: string; colorSpaceConversion?: "none" });
  decode(): Promise<{ image: ImageBitmap }>; // as that of VideoDecoder
  close(): void;
}
declare class VideoDecoder {
  static isConfigSupported(config: VideoDecoderConfig): Promise<{ supported?: boolean }>;
  // A frame of a video is drawn and closed like an ImageBitmap.
  constructor(init: { output(frame: ImageBitmap): void; error(error: Error): void });
  readonly state: "unconfigured" | "configured" | "closed";
  configure(config: VideoDecoderConfig): void;
  decode(chunk: EncodedVideoChunk): void;
  close(): void;
}
