// <slab-view> in JSX: import type {} from "slabstream-view/react". From version 19 on React looks in its own module, before in a global name.
import type { DetailedHTMLProps, HTMLAttributes } from "react";
import type { SlabViewAttributes, SlabViewElement } from "./slab-view.js";

interface Elements { "slab-view": DetailedHTMLProps<HTMLAttributes<SlabViewElement>, SlabViewElement> & SlabViewAttributes }

declare module "react" { namespace JSX { interface IntrinsicElements extends Elements {} } }
declare global { namespace JSX { interface IntrinsicElements extends Elements {} } }
