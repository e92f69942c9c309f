// XDMF, versions 2 and 3: XML that says where the samples of grids are, in HDF5 or binary files, and how they make volumes. Grids lie in
// collections: of times, or of pieces in space, which become a mosaic.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/printable.h"
#include "common/text/parse_number.h"
#include "common/text/trimmed.h"
#include "data/mosaic/mosaic_source.h"
#include "data/positional/located_volume.h"
#include "data/positional/turned_box.h"
#include "data/sources/chunked_source.h"
#include "data/sources/part_source.h"
#include "data/volume_io/chosen_channel.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/grid_volume.h"
#include "data/volume_io/stated_field.h"
#include "data/xdmf/xdmf_grid.h"
#include "data/xdmf/xdmf_mesh.h"

namespace slabstream {

namespace {

constexpr int kMostCollections = 16;  // collections in collections

enum class GridKind : std::uint8_t { kUniform, kTimes, kPieces };

Result<GridKind> KindOf(const XdmfDocument& document, const XdmfElement& grid) {
  const std::string type = grid.Word({"GridType", "Type"}), of = grid.Word({"CollectionType"});
  if (type.empty() || type == "uniform") return GridKind::kUniform;
  if (type == "collection" && of == "temporal") return GridKind::kTimes;
  if (type == "tree" || (type == "collection" && (of.empty() || of == "spatial"))) return GridKind::kPieces;
  return document.Wrong(grid, fmt::format("GridType '{}'{} is not supported; supported: Uniform, Tree, and Collection of CollectionType "
                                          "Temporal or Spatial",
                                          Printable(type), of.empty() ? "" : " of CollectionType '" + Printable(of) + "'"));
}

// The grid of one time, and what is known of all times.
struct GridAtTime {
  const XdmfElement* grid = nullptr;
  TimeAxis times = TimeAxis();
  int time = 0;
};

// The values of the times of a collection: of each grid, or of the collection. Empty: they are not known.
std::vector<double> TimesOf(const XdmfElement& collection, const std::vector<const XdmfElement*>& grids) {
  std::vector<double> values;
  for (const XdmfElement* grid : grids) {
    const std::vector<const XdmfElement*> times = XdmfDocument::Children(*grid, "Time");
    const auto value = times.empty() ? std::nullopt : ParseNumber<double>(Trimmed(times.front()->Attribute({"Value"})));
    if (!value) break;
    values.push_back(*value);
  }
  const std::vector<const XdmfElement*> times = XdmfDocument::Children(collection, "Time");
  if (values.size() == grids.size() || times.empty()) return values;
  const std::vector<const XdmfElement*> items = XdmfDocument::Children(*times.front(), "DataItem");
  const auto numbers = items.empty() ? std::nullopt : NumbersInText(items.front()->text, grids.size() + 3);
  if (!numbers) return {};
  const std::string type = times.front()->Word({"TimeType", "Type"});
  if (type == "list") return *numbers;
  if (type != "hyperslab" || numbers->size() != 3) return {};
  values.clear();
  for (std::size_t i = 0; i < grids.size(); ++i) values.push_back((*numbers)[0] + double(i) * (*numbers)[1]);
  return values;
}

// Goes into a collection of times, and into those of one grid.
Result<GridAtTime> FindGrid(XdmfDocument& document, const ReadOptions& options) {
  std::vector<const XdmfElement*> grids;
  for (const XdmfElement* domain : XdmfDocument::Children(document.root(), "Domain")) {
    const std::vector<const XdmfElement*> more = XdmfDocument::Children(*domain, "Grid");
    grids.insert(grids.end(), more.begin(), more.end());
  }
  // Finite element programs put a grid before those of the times whose topology they share.
  if (grids.size() > 1) {
    std::erase_if(grids, [](const XdmfElement* grid) {
      return XdmfDocument::Children(*grid, "Attribute").empty() && XdmfDocument::Children(*grid, "Grid").empty();
    });
  }
  if (grids.size() != 1) {
    return Status::InvalidArgument(
        fmt::format("{}: has {} grids, must have 1, which may be a collection of others", document.path(), grids.size()));
  }
  GridAtTime found{.grid = grids.front()};
  bool in_times = false;
  for (int depth = 0; depth < kMostCollections; ++depth) {
    const Result<const XdmfElement*> grid = document.Resolved(*found.grid);
    if (!grid.ok()) return grid.status();
    found.grid = *grid;
    const Result<GridKind> kind = KindOf(document, **grid);
    if (!kind.ok()) return kind.status();
    grids = XdmfDocument::Children(**grid, "Grid");
    if (*kind == GridKind::kTimes && !in_times && !grids.empty()) {
      in_times = true;
      found.times = StatedTimes(std::int64_t(grids.size()), TimesOf(**grid, grids), "");
      const Result<std::int64_t> time = ChosenVolume(document.path(), found.times.count, options);
      if (!time.ok()) return time.status();
      found.time = int(*time);
    } else if (*kind != GridKind::kPieces || grids.size() != 1) {
      break;
    }
    found.grid = grids[*kind == GridKind::kTimes ? std::size_t(found.time) : 0];
  }
  const Result<std::int64_t> time = in_times ? Result<std::int64_t>(0) : ChosenVolume(document.path(), 1, options);
  return time.ok() ? Result(found) : time.status();
}

// The uniform grids in it. Cycles of references end by XdmfDocument::Spend.
Status AddPieces(XdmfDocument& document, const XdmfElement& element, int depth, std::vector<const XdmfElement*>& pieces) {
  const Result<const XdmfElement*> grid = document.Resolved(element);
  if (!grid.ok()) return grid.status();
  const Result<GridKind> kind = KindOf(document, **grid);
  if (!kind.ok()) return kind.status();
  std::vector<const XdmfElement*> inner;
  if (*kind == GridKind::kUniform) {
    pieces.push_back(*grid);
  } else {
    inner = XdmfDocument::Children(**grid, "Grid");
    if (inner.empty()) return document.Wrong(**grid, "is a collection of no grids");
  }
  if (*kind == GridKind::kTimes) return document.Wrong(**grid, "is a collection of times in another collection, which is not supported");
  if (depth == kMostCollections || pieces.size() > kMaxMosaicParts) {
    return document.Wrong(**grid,
                          fmt::format("has more than {} grids, or they lie in more than {} others", kMaxMosaicParts, kMostCollections));
  }
  if (Status status = document.Spend(inner.size()); !status.ok()) return status;
  for (const XdmfElement* each : inner) {
    if (Status status = AddPieces(document, *each, depth + 1, pieces); !status.ok()) return status;
  }
  return Status::Ok();
}

// A volume of grids, with what is the same for all of its sources.
class GridOpener {
 public:
  GridOpener(std::shared_ptr<const XdmfDocument> document, ReadOptions options, std::shared_ptr<XdmfArrays> arrays)
      : document_(std::move(document)), options_(std::move(options)), arrays_(std::move(arrays)) {}

  // `header`: that of the grid or, of one that is a piece, that of the volume but for size and place. Errors of VolumeFormat::open.
  Result<std::shared_ptr<VolumeSource>> Open(const XdmfGrid& grid, RawHeader header, const std::vector<std::string>& files) const {
    Result<std::shared_ptr<ChunkedArray>> array = arrays_->Open(grid.item);
    if (!array.ok()) return array.status();
    header.type = (*array)->shape().type;
    const Result<WorldPlacement> placed = PlaceInWorld(header, grid.named);
    if (!placed.ok()) return placed.status();
    Result<SourceInfo> info = InfoOf(header, *placed, files);
    if (!info.ok()) return info.status();
    const XdmfItem& item = grid.item;
    const Index3& size = header.size;
    std::vector<std::uint64_t> wanted = {std::uint64_t(size.z), std::uint64_t(size.y), std::uint64_t(size.x)};
    if (header.components > 1) wanted.push_back(std::uint64_t(header.components));
    const auto matched = MatchAxes(item.count, wanted);
    if (!matched) {
      return Status::InvalidArgument(fmt::format("{}: is of {}, but its grid has {} {}", item.named, fmt::join(item.count, " x "),
                                                 fmt::join(wanted, " x "), NameOf(grid.at)));
    }
    // Which axis of the array one of the item is.
    const std::vector<int> of_item = *MatchAxes((*array)->shape().size, item.size);
    PyramidLevel level{.array = *array,
                       .axes = {-1, -1, -1},
                       .mirrored = placed->turn.flipped,
                       .at = std::vector<std::uint64_t>((*array)->shape().size.size(), 0),
                       .spacing = placed->geometry.spacing};
    for (std::size_t i = 0; i < of_item.size(); ++i) {
      if (of_item[i] >= 0) level.at[std::size_t(of_item[i])] = item.begin[i];
    }
    if (header.components > 1) {
      level.channel_axis = of_item[std::size_t(matched->back())];
      level.at[std::size_t(level.channel_axis)] += std::uint64_t(info->channel);
    }
    // The item may be a box of the array.
    Box box{{0, 0, 0}, {1, 1, 1}};
    for (int i = 0; i < 3; ++i) {
      const int stored = placed->turn.from[std::size_t(i)], axis = (*matched)[std::size_t(2 - stored)];
      if (axis < 0 || of_item[std::size_t(axis)] < 0) continue;
      const auto number = std::size_t(axis);
      level.axes[std::size_t(i)] = of_item[number];
      const std::uint64_t before = item.begin[number], behind = item.size[number] - before - item.count[number];
      box.begin[i] = std::int32_t(placed->turn.flipped[std::size_t(i)] ? behind : before);
      box.end[i] = box.begin[i] + size[stored];
    }
    level.origin = placed->geometry.ToWorld(-1.0 * ToVec3(box.begin));
    Pyramid pyramid{.levels = {level}, .orientation = placed->geometry.orientation, .info = *std::move(info)};
    Result<std::shared_ptr<VolumeSource>> source = MakeChunkedSource(item.named, std::move(pyramid), arrays_->context());
    if (!source.ok() || (*source)->info().finest().geometry.bounds() == box) return source;
    return MakePartSource(*std::move(source), 0, box);
  }

  // `grids`: pieces of a volume, at least two.
  Result<std::shared_ptr<VolumeSource>> OpenMosaic(std::vector<XdmfGrid> grids, RawHeader header,
                                                   const std::vector<std::string>& files) const {
    Result<std::vector<Box>> boxes = PlacePieces(grids, header);
    if (!boxes.ok()) return boxes.status();
    RawHeader of_first = header;
    of_first.size = grids.front().header.size;
    // The type of its samples is that of all.
    const Result<std::shared_ptr<VolumeSource>> first = Open(grids.front(), of_first, {});
    if (!first.ok()) return first.status();
    header.type = (*first)->info().exact.type;
    const Result<WorldPlacement> placed = PlaceInWorld(header, document_->path());
    if (!placed.ok()) return placed.status();
    Result<SourceInfo> info = InfoOf(header, *placed, files);
    if (!info.ok()) return info.status();
    std::vector<MosaicPart> parts;
    for (std::size_t i = 0; i < grids.size(); ++i) {
      RawHeader of_piece = header;
      of_piece.size = grids[i].header.size;
      const Box box = TurnedBox{placed->turn, placed->geometry.size, {}, {}}.Turned((*boxes)[i]);
      parts.push_back({grids[i].named, box, [self = *this, grid = grids[i], of_piece] { return self.Open(grid, of_piece, {}); }});
    }
    return MakeMosaic(document_->path(), *std::move(info), {std::move(parts)});
  }

 private:
  // The components of a voxel are channels.
  Result<SourceInfo> InfoOf(RawHeader header, const WorldPlacement& placed, const std::vector<std::string>& files) const {
    const std::string& path = document_->path();
    std::vector<FieldInfo> channels(std::size_t(std::exchange(header.components, 1)));
    const Result<int> channel = ChosenChannel(path, channels, options_);
    if (!channel.ok()) return channel.status();
    header.channel = *channel;
    if (channels.size() > 1) header.channels = std::move(channels);
    return InfoOfFile("XDMF", path, header, placed, {files.begin(), files.end()}, Uniform(1), options_);
  }

  // Where the pieces lie in the volume, by the axes of the file; sets its size and its place.
  static Result<std::vector<Box>> PlacePieces(const std::vector<XdmfGrid>& grids, RawHeader& header) {
    constexpr double kMostOff = 0.05;  // of a voxel
    std::vector<Box> boxes;
    Box bounds;
    for (const XdmfGrid& grid : grids) {
      const RawHeader& piece = grid.header;
      const auto off = [&](Axis axis, const char* why) {
        return Status::InvalidArgument(fmt::format("{}: {} along {}", grid.named, why, Letter(axis)));
      };
      for (const Axis axis : kAxes) {
        if (!piece.uneven[std::size_t(Number(axis))].centres.empty())
          return off(axis, "is one of several pieces, and its coordinates are not even");
      }
      if (piece.components != header.components) {
        return Status::InvalidArgument(fmt::format("{}: has {} components, must have {} as {} has", grid.named, piece.components,
                                                   header.components, grids.front().named));
      }
      Box box;
      for (const Axis axis : kAxes) {
        const auto number = std::size_t(Number(axis));
        const double step = header.steps[number][axis], places = (piece.origin[axis] - header.origin[axis]) / step;
        if (!(std::abs(piece.steps[number][axis] - step) * piece.size[axis] <= kMostOff * std::abs(step))) {
          return off(axis, "has another spacing than the first piece");
        }
        if (!(std::abs(places) <= kMaxVolumeSide)) return off(axis, "lies too far from the first piece");
        if (std::abs(places - std::round(places)) > kMostOff) return off(axis, "has its voxels between those of the first piece");
        box.begin[axis] = std::int32_t(std::round(places));
        box.end[axis] = box.begin[axis] + piece.size[axis];
      }
      bounds = boxes.empty() ? box : Box{Min(bounds.begin, box.begin), Max(bounds.end, box.end)};
      boxes.push_back(box);
    }
    for (Box& box : boxes) box = {box.begin - bounds.begin, box.end - bounds.begin};
    for (const Axis axis : kAxes) {
      header.origin[axis] += bounds.begin[axis] * header.steps[std::size_t(Number(axis))][axis];
      if (bounds.size()[axis] > kMaxVolumeSide) {
        return Status::InvalidArgument(fmt::format("{}: its pieces reach over {} voxels along {}, must be at most {}", grids.front().named,
                                                   bounds.size()[axis], Letter(axis), kMaxVolumeSide));
      }
    }
    header.size = bounds.size();
    return boxes;
  }

  const std::shared_ptr<const XdmfDocument> document_;  // which texts of items are part of
  const ReadOptions options_;
  const std::shared_ptr<XdmfArrays> arrays_;
};

// The grid of a file that the options choose.
struct ChosenGrid {
  std::shared_ptr<XdmfDocument> document;
  GridAtTime at_time;
  std::vector<const XdmfElement*> pieces;  // at least one
  bool is_mesh = false;                    // its pieces have cells, not straight axes
};
Result<ChosenGrid> ChooseGrid(const std::string& path, const ReadOptions& options) {
  Result<std::shared_ptr<XdmfDocument>> document = XdmfDocument::Read(path);
  if (!document.ok()) return document.status();
  ChosenGrid chosen{.document = *std::move(document), .at_time = {}, .pieces = {}};
  Result<GridAtTime> found = FindGrid(*chosen.document, options);
  if (!found.ok()) return found.status();
  chosen.at_time = *std::move(found);
  if (Status status = AddPieces(*chosen.document, *chosen.at_time.grid, 0, chosen.pieces); !status.ok()) return status;
  const Result<bool> is_mesh = IsXdmfMesh(*chosen.document, *chosen.pieces.front());
  if (!is_mesh.ok()) return is_mesh.status();
  chosen.is_mesh = *is_mesh;
  return chosen;
}

Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  const Result<ChosenGrid> chosen = ChooseGrid(path, options);
  if (!chosen.ok()) return chosen.status();
  if (chosen->is_mesh) return std::shared_ptr<VolumeSource>();
  if (options.lattice) return Status::InvalidArgument(path + ": has straight axes, so it takes no option lattice");
  const auto arrays = std::make_shared<XdmfArrays>(context);
  std::vector<XdmfGrid> grids;
  std::vector<std::string> files;
  for (const XdmfElement* piece : chosen->pieces) {
    Result<XdmfGrid> grid = ReadXdmfGrid(*chosen->document, *piece, options, *arrays, grids.empty() ? nullptr : grids.data());
    if (!grid.ok()) return grid.status();
    files.insert(files.end(), grid->files.begin(), grid->files.end());
    grids.push_back(*std::move(grid));
  }
  std::ranges::sort(files);
  files.erase(std::unique(files.begin(), files.end()), files.end());
  RawHeader header = grids.front().header;
  header.times = chosen->at_time.times;
  header.number = chosen->at_time.time;
  const GridOpener opener(chosen->document, options, arrays);
  return grids.size() == 1 ? opener.Open(grids.front(), header, files) : opener.OpenMosaic(std::move(grids), header, files);
}

// A grid with cells.
Result<RawVolume> Read(const std::string& path, const ReadOptions& options) {
  const Result<ChosenGrid> chosen = ChooseGrid(path, options);
  if (!chosen.ok()) return chosen.status();
  XdmfArrays arrays(std::make_shared<ReadContext>(ReadContext::Limits{}));
  Result<RawVolume> raw =
      GridVolume(path, options,
                 {.files = [&] { return FilesOfXdmfMesh(*chosen->document, chosen->pieces, arrays); },
                  .read = [&](const MeshOptions& of) { return ReadXdmfMesh(*chosen->document, chosen->pieces, of, arrays); }});
  if (!raw.ok()) return raw;
  raw->header.times = chosen->at_time.times;
  raw->header.number = chosen->at_time.time;
  return raw;
}

}  // namespace

VolumeFormat Xdmf() {
  return {.name = "XDMF",
          .endings = {".xmf", ".xdmf"},
          .options = {"time", "channel", "array", "lattice", "resample"},
          .open = Open,
          .read = Read};
}

}  // namespace slabstream
