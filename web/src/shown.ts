// A picture as the page shows it: a frame of a session, and how large it lies on the page.
import type { Frame, Geometry } from "./session";

export interface Shown { frame: Frame; cssWidth: number; cssHeight: number } // the picture's size in pixels of the page

// The picture's geometry in pixels of the page.
export function pageGeometry({ frame: { header }, cssWidth }: Shown): Geometry {
  return { ...header.geometry, pixel_size: (header.geometry.pixel_size * header.size[0]) / cssWidth };
}
