// Fingers are wider than marks: which mark a touch means.
const FINGER_PIXELS = 22; // half a target

// The mark below the pointer, or of a touch beside all of them the nearest one.
export function markNear(marks: Iterable<SVGElement>, event: PointerEvent): SVGElement | null {
  let nearest: SVGElement | null = null, least = event.pointerType === "touch" ? FINGER_PIXELS : 0;
  for (const mark of marks) {
    if (mark === event.target) return mark;
    const box = mark.getBoundingClientRect(), away = Math.hypot(event.clientX - (box.left + box.width / 2), event.clientY - (box.top + box.height / 2));
    if (box.width > 0 && away < least) { nearest = mark; least = away; }
  }
  return nearest;
}
