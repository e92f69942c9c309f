// The files of a dataset beside that of its volume, as users name them: labels, and an overlay.
#pragma once

#include <string>

namespace slabstream {

// "": there is none. Volumes may have options for reading behind a question mark (read_options.h).
struct LayerFiles {
  std::string labels;
  std::string label_colors;  // a table of their colours (label_table.h); "": what lies beside the labels, or what they say themselves
  std::string overlay;

  bool any() const { return !labels.empty() || !overlay.empty(); }
  friend bool operator==(const LayerFiles&, const LayerFiles&) = default;
};

// FILE or FILE:COLOURS, as --labels takes it. A text that is a file's name as a whole is that file. Does not check that the files exist.
void SetLabelFiles(const std::string& text, LayerFiles& files);
// The other way round.
std::string LabelText(const LayerFiles& files);

}  // namespace slabstream
