// Plotfiles of AMReX, folders that hold an adaptive mesh: boxes of cells at levels, each level finer than the one before by a whole factor.
// A level lies in Level_N: Cell_H says which boxes it has, and where in which file their values are. Each box is a part of a mosaic; cells
// of a level that lie in no box of it are interpolated between those of the coarser one. Sources: https://amrex-codes.github.io/amrex/
// docs_html/IO.html, and what AMReX writes (WriteGenericPlotfileHeader, VisMF and FArrayBox).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <utility>
#include <vector>

#include "common/files/files.h"
#include "data/mosaic/mosaic_source.h"
#include "data/positional/file_source.h"
#include "data/positional/located_volume.h"
#include "data/sources/part_source.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/grid_arrays.h"

namespace slabstream {
namespace {

namespace fs = std::filesystem;

constexpr int kMostLevels = 16, kMostVariables = 4096;
constexpr std::size_t kMostTextBytes = std::size_t{256} << 20;  // of a file that says what lies where

// Words and numbers of a text, one after the other. Brackets and commas count as blanks. What is not there, or no such number, is 0 or ""
// from then on, and `good` false.
class Scanner {
 public:
  explicit Scanner(std::string text) {
    std::ranges::replace_if(
        text, [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
    in_.str(std::move(text));
  }
  template <class T>
  T Next() {
    T value{};
    in_ >> value;
    return value;
  }
  std::string Line() {
    std::string line;
    std::getline(in_ >> std::ws, line);
    return line;
  }
  Index3 Triple() {
    const int x = Next<int>(), y = Next<int>();
    return {x, y, Next<int>()};
  }
  bool good() const { return !in_.fail(); }

 private:
  std::istringstream in_;
};

// A box of cells. Both ends are included in files, and followed by 0 along axes whose values lie in the middle of cells, else 1.
struct StoredBox {
  Box box;
  bool of_cells = false;
};
StoredBox NextBox(Scanner& text) {
  const Index3 low = text.Triple(), high = text.Triple(), nodes = text.Triple();
  const auto is_small = [](std::int32_t number) { return std::abs(std::int64_t{number}) < std::numeric_limits<std::int32_t>::max() / 4; };
  const bool small = is_small(low.x) && is_small(low.y) && is_small(low.z) && is_small(high.x) && is_small(high.y) && is_small(high.z);
  return {small ? Box{low, high + Uniform(1)} : Box{}, nodes == Index3{}};
}

struct Patch {
  Box box;  // of the level's cells, from the domain's first one on
  std::string file;
  std::int64_t offset = 0;  // of its header there
};

struct Level {
  Box domain;  // as the file counts cells
  std::vector<Patch> patches;
};

struct Plotfile {
  std::vector<std::string> variables;
  double time = 0;
  Vec3 low, high;             // the corners of the domain
  std::vector<Level> levels;  // coarsest first
  std::vector<std::string> files;
};

Status Wrong(const std::string& file, const std::string& why) { return Status::InvalidArgument(file + ": " + why); }

Result<Level> ReadLevel(const std::string& path, const std::string& name, const Box& domain, std::vector<std::string>& files) {
  const std::string file = (fs::path(path) / (name + "_H")).string(), folder = fs::path(file).parent_path().string();
  if (Status status = CheckIsFile(file); !status.ok()) return status;
  const Result<std::string> read = ReadTextFile(file, kMostTextBytes);
  if (!read.ok()) return read.status();
  files.push_back(file);
  Scanner text(*read);
  Level level{.domain = domain};
  // The version, how it was written, the number of components, and of layers of ghosts; of the latter there may be one for each axis.
  text.Line();
  text.Line();
  text.Line();
  text.Line();
  const auto count = text.Next<std::size_t>();
  text.Next<int>();
  if (!text.good() || count < 1 || count > kMaxMosaicParts) {
    return Wrong(file, fmt::format("has {} boxes, must have 1 to {}", count, kMaxMosaicParts));
  }
  for (std::size_t i = 0; i < count; ++i) {
    const auto [box, of_cells] = NextBox(text);
    if (!text.good() || box.empty() || !domain.Contains(box)) return Wrong(file, fmt::format("box {} is none, or not in the domain", i));
    if (!of_cells) return Wrong(file, fmt::format("box {} has values of nodes or faces, must have values of cells", i));
    level.patches.push_back({.box = {box.begin - domain.begin, box.end - domain.begin}});
  }
  if (text.Next<std::size_t>() != count) return Wrong(file, "says of other boxes where they are than it has");
  for (Patch& patch : level.patches) {
    const auto word = text.Next<std::string>(), data = text.Next<std::string>();
    patch.offset = text.Next<std::int64_t>();
    if (!text.good() || word != "FabOnDisk:" || data.empty() || patch.offset < 0) return Wrong(file, "a place FabOnDisk is none");
    patch.file = (fs::path(folder) / data).string();
  }
  return level;
}

Result<Plotfile> ReadPlotfile(const std::string& path) {
  const std::string file = (fs::path(path) / "Header").string();
  const Result<std::string> read = ReadTextFile(file, kMostTextBytes);
  if (!read.ok()) return read.status();
  Scanner text(*read);
  Plotfile plot{.files = {file}};
  text.Line();
  const auto variables = text.Next<int>();
  if (!text.good() || variables < 1 || variables > kMostVariables) {
    return Wrong(file, fmt::format("has {} variables, must have 1 to {}", variables, kMostVariables));
  }
  for (int i = 0; i < variables; ++i) plot.variables.push_back(text.Line());
  if (const auto axes = text.Next<int>(); axes != 3) return Wrong(file, fmt::format("has {} axes, must have 3", axes));
  plot.time = text.Next<double>();
  const auto finest = text.Next<int>();
  if (!text.good() || finest < 0 || finest >= kMostLevels) {
    return Wrong(file, fmt::format("has {} levels, must have 1 to {}", finest + 1, kMostLevels));
  }
  for (Vec3* const corner : {&plot.low, &plot.high}) {
    for (int axis = 0; axis < 3; ++axis) (*corner)[axis] = text.Next<double>();
  }
  for (int level = 0; level < finest; ++level) text.Next<int>();  // the ratios, which the domains tell
  for (int level = 0; level <= finest; ++level) {
    const auto [domain, of_cells] = NextBox(text);
    if (!text.good() || domain.empty() || !of_cells) return Wrong(file, fmt::format("the domain of level {} is none", level));
    const Index3 size = domain.size();
    if (std::max({size.x, size.y, size.z}) > kMaxVolumeSide) {
      return Wrong(file, fmt::format("level {} has {} x {} x {} cells, must have at most {} along an axis", level, size.x, size.y, size.z,
                                     kMaxVolumeSide));
    }
    plot.levels.push_back({.domain = domain});
  }
  for (int level = 0; level <= finest; ++level) text.Next<int>();  // steps that were made
  for (int i = 0; i < 3 * (finest + 1); ++i) text.Next<double>();  // sides of cells
  if (const auto kind = text.Next<int>(); kind != 0)
    return Wrong(file, fmt::format("has coordinates of kind {}, must be Cartesian (0)", kind));
  text.Next<int>();
  for (Level& level : plot.levels) {
    text.Next<int>();
    const auto boxes = text.Next<std::int64_t>();
    text.Next<double>();
    text.Next<int>();
    for (std::int64_t i = 0; i < 6 * boxes && text.good(); ++i) text.Next<double>();
    const auto name = text.Next<std::string>();
    if (!text.good()) return Wrong(file, "ends before all levels are named");
    Result<Level> of_file = ReadLevel(path, name, level.domain, plot.files);
    if (!of_file.ok()) return of_file.status();
    level = *std::move(of_file);
  }
  return plot;
}

// What stands before the values of a box: their type and byte order, the cells with their ghosts, and how many components there are.
struct FabHeader {
  SampleType type = SampleType::kFloat64;
  bool big_endian = false;
  Box box;
  int components = 0;
  std::int64_t bytes = 0;  // of the header
};

Result<FabHeader> ReadFabHeader(const Patch& patch) {
  constexpr std::size_t kMost = 1024;
  if (Status status = CheckIsFile(patch.file); !status.ok()) return status;
  std::ifstream file(patch.file, std::ios::binary);
  if (!file) return Status::NotFound(patch.file + ": cannot be opened for reading");
  std::string line(kMost, '\0');
  file.seekg(patch.offset);
  file.read(line.data(), std::streamsize(line.size()));
  line.resize(std::size_t(file.gcount()));
  const std::size_t end = line.find('\n');
  const auto wrong = [&](const std::string& why) {
    return Status::DataLoss(fmt::format("{}: at byte {} {}", patch.file, patch.offset, why));
  };
  if (end == std::string::npos || !line.starts_with("FAB")) return wrong("begins no box: FAB is missing");
  Scanner text(line.substr(3, end - 3));
  FabHeader header{.bytes = std::int64_t(end) + 1};
  const auto describing = text.Next<int>();
  for (int i = 0; i < describing && text.good(); ++i) text.Next<int>();
  const auto bytes = text.Next<int>();
  std::vector<int> order;
  for (int i = 0; i < bytes && text.good(); ++i) order.push_back(text.Next<int>());
  header.box = NextBox(text).box;
  header.components = text.Next<int>();
  if (!text.good() || (bytes != 4 && bytes != 8) || (order.front() != 1 && order.front() != bytes)) {
    return wrong("values are of a type that is not supported: it must be floats of 4 or 8 bytes");
  }
  header.type = bytes == 4 ? SampleType::kFloat32 : SampleType::kFloat64;
  header.big_endian = order.front() == 1;
  return header;
}

// The values of a variable in the cells of a patch.
Result<std::shared_ptr<VolumeSource>> OpenPatch(const Patch& patch, const Index3& first, int variable, const SourceContext& context) {
  const Result<FabHeader> found = ReadFabHeader(patch);
  if (!found.ok()) return found.status();
  const Box box = {found->box.begin - first, found->box.end - first};
  const auto wrong = [&](const std::string& why) {
    return Status::DataLoss(fmt::format("{}: at byte {} {}", patch.file, patch.offset, why));
  };
  if (variable >= found->components) return wrong(fmt::format("are {} variables, must be more than {}", found->components, variable));
  if (!box.Contains(patch.box)) return wrong("lies another box than Cell_H says");
  const std::int64_t cells = box.voxel_count();
  const Index3 size = box.size();
  if (std::max({size.x, size.y, size.z}) > kMaxVolumeSide) return wrong("lies a box that is too large");
  LocatedSamples located{.header = {.size = size, .type = found->type},
                         .payload = {.file = patch.file,
                                     .offset = patch.offset + found->bytes + variable * cells * std::int64_t(BytesPerSample(found->type)),
                                     .big_endian = found->big_endian}};
  Result<std::shared_ptr<VolumeSource>> source = OpenLocated("AMReX", patch.file, located, context);
  if (!source.ok() || box == patch.box) return source;
  return MakePartSource(*std::move(source), 0, {patch.box.begin - box.begin, patch.box.end - box.begin});
}

Result<int> ChosenVariable(const std::string& path, const Plotfile& plot, const ReadOptions& options, std::vector<std::string>& notes) {
  std::vector<GridArray> arrays;
  for (const std::string& name : plot.variables) arrays.push_back({.name = name, .at = ValuesAt::kCells});
  const Result<std::size_t> chosen = ChooseArray(path, arrays, options.array);
  if (!chosen.ok()) return chosen.status();
  notes = NotesOf(arrays, *chosen);
  return int(*chosen);
}

Result<VolumeGeometry> GeometryOf(const std::string& path, const Plotfile& plot, const Level& level) {
  RawHeader header{.size = level.domain.size(), .world = World::kScene, .matrix = "the corners of its domain"};
  Vec3 steps;
  for (int axis = 0; axis < 3; ++axis) steps[axis] = (plot.high[axis] - plot.low[axis]) / header.size[axis];
  header.steps = StepsOf(steps);
  header.origin = plot.low + 0.5 * steps;
  const Result<WorldPlacement> placed = PlaceInWorld(header, path);
  if (!placed.ok()) return placed.status();
  if (placed->turn == AxisTurn{}) return placed->geometry;
  return Wrong(path, "its domain has corners in another order than from low to high");
}

Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options, const SourceContext& context) {
  const Result<Plotfile> plot = ReadPlotfile(path);
  if (!plot.ok()) return plot.status();
  SourceInfo info{.format = "AMReX plotfile"};
  const Result<int> variable = ChosenVariable(path, *plot, options, info.notes);
  if (!variable.ok()) return variable.status();
  const Result<FabHeader> first = ReadFabHeader(plot->levels.front().patches.front());
  if (!first.ok()) return first.status();
  info.file_type = ToString(first->type);
  info.exact = {first->type, {}};
  info.notes.push_back(fmt::format("time {} of the simulation; {} levels of cells", plot->time, plot->levels.size()));
  info.files = plot->files;
  info.folder = path;
  std::vector<std::vector<MosaicPart>> levels;
  for (auto level = plot->levels.rbegin(); level != plot->levels.rend(); ++level) {
    const Result<VolumeGeometry> geometry = GeometryOf(path, *plot, *level);
    if (!geometry.ok()) return geometry.status();
    info.levels.push_back({{*geometry, ScalarType::kFloat32, {}}, Uniform(1)});
    std::vector<MosaicPart>& parts = levels.emplace_back();
    for (const Patch& patch : level->patches) {
      const auto open = [patch, begin = level->domain.begin, variable = *variable, context] {
        return OpenPatch(patch, begin, variable, context);
      };
      parts.push_back({fmt::format("{} at byte {}", patch.file, patch.offset), patch.box, open});
    }
  }
  return MakeMosaic(path, std::move(info), std::move(levels));
}

bool IsPlotfile(const std::string& path, const ReadOptions&) {
  std::error_code error;
  return fs::is_regular_file(fs::path(path) / "Header", error) && fs::is_regular_file(fs::path(path) / "Level_0" / "Cell_H", error);
}

}  // namespace

VolumeFormat Amrex() {
  return {.name = "AMReX plotfile", .also = "a plotfile of AMReX", .recognises = IsPlotfile, .options = {"array"}, .open = Open};
}

}  // namespace slabstream
