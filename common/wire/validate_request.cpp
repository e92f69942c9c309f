#include "common/wire/validate_request.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "common/base/printable.h"
#include "common/base/range_status.h"
#include "common/renderers/renderer_choice.h"
#include "common/wire/request_walk.h"

namespace slabstream {
namespace {

// What the schema says of values, one by one. Only the first failure counts.
class SchemaCheck {
 public:
  explicit SchemaCheck(std::string path) : path_(std::move(path)) {}

  template <class Struct>
  Status Of(const Struct& value) {
    Members(value, {});
    return status_;
  }

 private:
  template <class Struct>
  void Members(const Struct& value, const FieldAbout& outer) {
    Walk(value, [&](const FieldAbout& field, const auto& member, std::size_t most) {
      const std::size_t length = path_.size();
      path_ += (path_.empty() ? "" : ".") + field.field;
      Member(field, member, most, field.least != 0 || field.most != 0 ? field : outer);
      path_.resize(length);
    });
  }

  template <class T>
  void Member(const FieldAbout& field, const T& value, std::size_t most, const FieldAbout& limits) {
    if constexpr (std::is_same_v<T, std::string>) {
      Text(value, field.most > 0 ? field.least : 1, field.most > 0 ? field.most : kMaxNameBytes);
    } else if constexpr (std::is_arithmetic_v<T>) {
      if (limits.least != 0 || limits.most != 0) Number(double(value), limits);
    } else if constexpr (requires { value.number(); }) {
      if (value.number() < 1 || std::size_t(value.number()) > field.words.size()) {
        Keep(Status::InvalidArgument(fmt::format("{} is {}, but must be one of: {}", path_, value.number(), fmt::join(field.words, ", "))));
      }
    } else if constexpr (requires { value.has_value(); }) {
      if (value.has_value()) Member(field, *value, most, limits);
    } else if constexpr (requires { value.index(); }) {
      if (const auto* name = std::get_if<std::string>(&value)) {
        Text(*name, 1, kMaxNameBytes);
      } else {
        Keep(Validate(std::get<TransferFunction>(value)));
      }
    } else if constexpr (requires { value.size(); }) {
      if (value.size() > most)
        Keep(Status::InvalidArgument(fmt::format("{} has {} items, at most {} are possible", path_, value.size(), most)));
      if constexpr (requires { value.data(); }) Items(value, limits);
    } else {
      Members(value, limits);
    }
  }

  template <class T>
  void Items(const std::vector<T>& items, const FieldAbout& limits) {
    const std::size_t length = path_.size();
    for (std::size_t i = 0; i < items.size() && status_.ok(); ++i) {
      path_ += fmt::format("[{}]", i);
      if constexpr (std::is_same_v<T, std::string>) {
        Text(items[i], 1, kMaxNameBytes);
      } else {
        Members(items[i], limits);
      }
      path_.resize(length);
    }
  }

  void Number(double value, const FieldAbout& limits) {
    if ((limits.above_least ? value > limits.least : value >= limits.least) && value <= limits.most) return;
    Keep(Status::InvalidArgument(fmt::format("{} is {}, but must lie in {}{}, {}]{}{}", path_, value, limits.above_least ? '(' : '[',
                                             limits.least, limits.most, limits.unit.empty() ? "" : " ", limits.unit)));
  }

  void Text(const std::string& text, double least, double most) {
    if (double(text.size()) >= least && double(text.size()) <= most) return;
    Keep(Status::InvalidArgument(fmt::format("{} has {} bytes, but must have {} to {}", path_, text.size(), least, most)));
  }

  void Keep(const Status& status) {
    if (status_.ok()) status_ = status;
  }

  std::string path_;
  Status status_;
};

template <class T>
Status CheckSchema(const char* path, const T& value) {
  return SchemaCheck(path).Of(value);
}

// ---- what holds between values

// The squared length must be usable, too: it normalises the direction.
Status CheckDirection(const std::string& field, const Vec3& v) {
  if (std::isnormal(Dot(v, v))) return Status::Ok();
  return Status::InvalidArgument(
      fmt::format("{} is {},{},{}, but must be a direction other than 0,0,0, with a length in [1e-150, 1e150]", field, v.x, v.y, v.z));
}

Status CheckRules(const ViewParameters& view) {
  if (view.fit.value_or(false) && view.look_at) return Status::InvalidArgument("view.fit and view.look_at cannot both be given");
  if (view.up && !view.eye) return Status::InvalidArgument("view.up needs view.eye; without an eye, view.roll_degrees turns the picture");
  if (view.distance > 0 && view.eye) return Status::InvalidArgument("view.distance and view.eye cannot both be given");
  if (view.distance > 0 && view.projection != Projection::kPerspective) {
    return Status::InvalidArgument("view.distance needs a perspective projection; view.zoom magnifies orthographic pictures");
  }
  return view.up ? CheckDirection("view.up", *view.up) : Status::Ok();
}

Status CheckRules(const ImageSize& size) {
  return InRange("size.width * size.height", double(size.width) * size.height, 1, double(kMaxImagePixels));
}

Status CheckRules(const ClipSlab& slab, const std::string& name) {
  if (slab.through && slab.index) return Status::InvalidArgument(name + " has both a point and an index, but one is enough");
  if (Status s = CheckDirection(name + ".normal", slab.normal); !s.ok()) return s;
  return InRange(name + ".slice", slab.index.value_or(0), 0, kMaxVolumeSide - 1);
}

Status CheckRules(const Clipping& clipping) {
  const auto& [box, slab, planes, mode] = clipping;
  for (const Axis axis : kAxes) {
    if (!box || box->low[axis] < box->high[axis]) continue;
    return Status::InvalidArgument(
        fmt::format("clipping.box is {}:{} along {}, but must rise", box->low[axis], box->high[axis], Letter(axis)));
  }
  if (slab) {
    if (Status s = CheckRules(*slab, "clipping.slab"); !s.ok()) return s;
  }
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (Status s = CheckDirection(fmt::format("clipping.clip_planes[{}].normal", i), planes[i].normal); !s.ok()) return s;
  }
  return Status::Ok();
}

Status CheckRules(const std::optional<ScalarRange>& range, const char* field) {
  if (!range) return Status::Ok();
  const double least = range->percentiles ? 0 : -kMaxScalar, most = range->percentiles ? 100 : kMaxScalar;
  if (Status s = InRange(fmt::format("{}.min", field), range->min, least, most); !s.ok()) return s;
  if (Status s = InRange(fmt::format("{}.max", field), range->max, least, most); !s.ok()) return s;
  if (range->min < range->max) return Status::Ok();
  return Status::InvalidArgument(fmt::format("{} is {:g} to {:g}, but must rise", field, range->min, range->max));
}

Status CheckRules(const TransferChoice& transfer) {
  if (Status s = CheckRules(transfer.scalar_range, "transfer.scalar_range"); !s.ok()) return s;
  if (Status s = Validate(transfer.isosurfaces); !s.ok()) return s;
  return Validate(transfer.gradient_opacities);
}

Status CheckRules(const Shading& shading) {
  for (std::size_t i = 0; i < shading.lights.size(); ++i) {
    if (Status s = CheckDirection(fmt::format("shading.lights[{}]", i), shading.lights[i]); !s.ok()) return s;
  }
  return Status::Ok();
}

Status CheckRules(const LabelChoice& labels) {
  std::set<std::uint64_t> named;
  for (const auto& [value, opacity] : labels.opacities) {
    if (!named.insert(value).second) return Status::InvalidArgument(fmt::format("labels.opacities names label {} twice", value));
  }
  for (const auto& [first, last, name] : labels.shown) {
    if (first > last) return Status::InvalidArgument(fmt::format("labels.shown has the range {} to {}, but must rise", first, last));
  }
  return Status::Ok();
}

Status CheckRules(const FieldChoice& choice, const std::string& name) {
  if (choice.labels) {
    if (choice == FieldChoice{.field = std::string(kLabelsField), .labels = choice.labels}) return CheckRules(*choice.labels);
    return Status::InvalidArgument(fmt::format("{} shows labels, which the field '{}' alone has, and no other look", name, kLabelsField));
  }
  const auto* function = std::get_if<TransferFunction>(&choice.choice);
  if (function != nullptr && !function->curves_alone()) {
    return Status::InvalidArgument(name +
                                   ".function has isosurfaces, gradient_opacities or regions, which only a dataset's first field has");
  }
  const auto* preset = std::get_if<std::string>(&choice.choice);
  const bool own = preset == nullptr || *preset != kAutomatic;
  if (own && (choice.color || choice.gamma != 1))
    return Status::InvalidArgument(
        fmt::format("{} has both a transfer function and a {}, which would be part of one", name, choice.color ? "color" : "gamma"));
  return CheckRules(choice.scalar_range, (name + ".scalar_range").c_str());
}

Status CheckRules(const std::vector<FieldChoice>& fields) {
  std::set<std::string> named;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (!named.insert(fields[i].field).second)
      return Status::InvalidArgument(fmt::format("fields names field '{}' twice", Printable(fields[i].field)));
    if (Status s = CheckRules(fields[i], fmt::format("fields['{}']", Printable(fields[i].field))); !s.ok()) return s;
  }
  return Status::Ok();
}

Status CheckRules(const std::vector<ShapeChoice>& shapes) {
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    if (Status s = CheckRules(shapes[i].range, fmt::format("shapes[{}].range", i).c_str()); !s.ok()) return s;
  }
  return Status::Ok();
}

Status CheckRules(const std::vector<PlaneChoice>& planes) {
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const std::string name = fmt::format("planes[{}]", i);
    if (Status s = CheckRules(planes[i].slab, name + ".slab"); !s.ok()) return s;
    if (Status s = InRange(name + ".slab.thickness", planes[i].slab.thickness, 0, 0); !s.ok()) return s;
    if (Status s = CheckRules(planes[i].range, (name + ".range").c_str()); !s.ok()) return s;
  }
  return Status::Ok();
}

template <class T>
Status ValidatePart(const char* name, const T& part) {
  if (Status s = CheckSchema(name, part); !s.ok()) return s;
  return CheckRules(part);
}

}  // namespace

Status Validate(const TransferChoice& transfer) { return ValidatePart("transfer", transfer); }
Status Validate(const ViewParameters& view) { return ValidatePart("view", view); }
Status Validate(const ImageSize& size) { return ValidatePart("size", size); }
Status Validate(const Clipping& clipping) { return ValidatePart("clipping", clipping); }
Status Validate(const Shading& shading) { return ValidatePart("shading", shading); }

Status Validate(const FrameRequest& request) {
  if (Status s = RenderersFor(request).status(); !s.ok()) return s;
  if (Status s = CheckSchema("", request); !s.ok()) return s;
  if (Status s = CheckRules(request.size); !s.ok()) return s;
  if (!IsLevel(request.level)) {
    return Status::InvalidArgument(
        fmt::format("level is '{}', but must be {} or a number from 0 to {}", Printable(request.level), kAutomatic, kMaxLevels - 1));
  }
  if (Status s = CheckRules(request.view); !s.ok()) return s;
  if (Status s = CheckRules(request.clipping); !s.ok()) return s;
  if (Status s = CheckRules(request.transfer); !s.ok()) return s;
  if (Status s = CheckRules(request.shading); !s.ok()) return s;
  if (Status s = CheckRules(request.shapes); !s.ok()) return s;
  if (Status s = CheckRules(request.planes); !s.ok()) return s;
  return CheckRules(request.fields);
}

}  // namespace slabstream
