// A component that shows a volume. `state` moves the view; what the visitor does comes back by onState and onPick.
import { type CSSProperties, useEffect, useRef } from "react";
import "slabstream-view";
import type { SlabViewElement, SlabViewPick, SlabViewSettings, SlabViewState } from "slabstream-view";
import type {} from "slabstream-view/react";

interface VolumeProps {
  src: string; // the gateway's address
  token: string;
  state: SlabViewSettings;
  onState(state: SlabViewState): void;
  onPick(pick: SlabViewPick): void;
  style?: CSSProperties;
}

export function Volume({ src, token, state, onState, onPick, style }: VolumeProps) {
  const element = useRef<SlabViewElement>(null), told = useRef<SlabViewSettings | null>(null);

  // What the element told is what it shows. Set again, it would take back what the visitor has done since.
  useEffect(() => {
    if (element.current && state !== told.current) element.current.state = state;
  }, [state]);

  useEffect(() => {
    const volume = element.current, heard = new AbortController(), { signal } = heard;
    volume?.addEventListener("slab-state", ({ detail }) => onState((told.current = detail)), { signal });
    volume?.addEventListener("slab-pick", ({ detail }) => onPick(detail), { signal });
    return () => heard.abort();
  }, [onState, onPick]);

  return <slab-view ref={element} src={src} token={token} style={style} />;
}
