// How a picture shows the fields of a dataset (common/volume/field_info.h): as a client asks for it (FieldChoice), and as it is resolved
// (FieldLook). docs/rendering.md defines what blends mean for a picture.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "common/classification/transfer_function.h"
#include "common/frame/label_look.h"
#include "common/volume/summary.h"

namespace slabstream {

// How a field is mixed with those before it in a sample.
// kAdd: densities add, and so does light. kOver: it covers those before it where it shows. kMax: of projections, each field's own value is
// kept and their colours add. kAuto: kMax in projections; else kAdd for channels, and kOver for fields with a grid of their own.
enum class Blend : std::uint8_t { kAuto = 1, kAdd = 2, kOver = 3, kMax = 4 };

// What a request says of one field. A field of values that it does not name has its standard look; labels are not shown.
struct FieldChoice {
  std::string field;               // its name, or its number; 1 ... kMaxNameBytes
  std::optional<bool> shown = {};  // none: as the dataset says
  // A preset's name, or the function itself. "auto": `color`, from clear to opaque along the range; without one, what the dataset says.
  std::variant<std::string, TransferFunction> choice = std::string("auto");
  std::optional<Rgb> color = {};                 // only with "auto"
  std::optional<ScalarRange> scalar_range = {};  // as TransferChoice::scalar_range
  double gamma = 1;                              // [0.01, 100]: the exponent of the opacity along the range; only with "auto"
  double weight = 1;                             // [0, 1]: a factor of its density
  std::optional<LabelChoice> labels = {};        // of kLabelsField, of which nothing else is said; none: it is a field of values
  friend bool operator==(const FieldChoice&, const FieldChoice&) = default;
};

// ---- resolved

struct FieldLook {
  // Without isosurfaces, opacity by gradient and regions. Its opacity_distance counts voxel lengths of the picture's volume.
  TransferFunction transfer;
  ValueRange range;           // data values that the classification table is made for
  double weight = 1;          // [0, 1]
  Blend blend = Blend::kAdd;  // kAdd or kOver
  friend bool operator==(const FieldLook&, const FieldLook&) = default;
};

}  // namespace slabstream
