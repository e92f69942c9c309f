// `annotate`, for the Python package: puts pixels over a background and draws annotations onto them, or makes a file of them, so that its
// pictures are those of the command line.
//
// stdin: a line of JSON, and behind it the pixels: width * height * 4 floats of this machine, premultiplied, row 0 first.
//   {"size": [W, H], "panes": [the "geometry" of a picture's record, ...], "title", "scale_bar", "orientation_marker", "sides_only",
//    "axes", "color_bar", "legend", "font_size", "dpi", "background": [R, G, B, A],
//    "file": "jpg" or another ending, "depth", "quality",
//    "key": {"bars": [{"name", "colors": [[value, r, g, b], ...]}, ...], "entries": [{"name", "color": [r, g, b]}, ...]}}
// Only size and panes must be there. stdout: the file; without "file" the pixels that it would show.
#pragma once

#include "common/base/status.h"

namespace slabstream {

inline constexpr const char* kAnnotateCommand = "annotate";  // not shown in help texts
Status RunAnnotate();

}  // namespace slabstream
