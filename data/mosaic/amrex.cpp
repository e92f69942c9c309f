// Plotfiles of AMReX, folders that hold an adaptive mesh: boxes of cells at levels, each level finer than the one before by a whole factor.
// A level lies in Level_N: Cell_H says which boxes it has, and where in which file their values are. Each box is a part of a mosaic (a
// patch); cells of a level that lie in no box of it are interpolated between those of the coarser one. Sources:
// https://amrex-codes.github.io/amrex/ docs_html/IO.html, and what AMReX writes (WriteGenericPlotfileHeader, VisMF and FArrayBox).
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <filesystem>
#include <limits>
#include <map>
#include <mutex>
#include <numeric>
#include <span>
#include <sstream>
#include <system_error>
#include <utility>
#include <vector>

#include "common/base/lru_map.h"
#include "common/base/printable.h"
#include "common/files/file_descriptor.h"
#include "common/files/files.h"
#include "data/mosaic/mosaic_source.h"
#include "data/positional/stored_samples.h"
#include "data/sources/read_context.h"
#include "data/volume_io/formats.h"
#include "data/volume_io/grid_arrays.h"
#include "data/volume_io/world_placement.h"

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
  Box box;                  // of the level's cells, from the domain's first one on
  std::uint32_t file = 0;   // of Plotfile::data
  std::int64_t offset = 0;  // of its header there
};

struct Level {
  Box domain;                  // as the file counts cells
  std::vector<Patch> patches;  // in the order of their bytes, so that those that are read together lie together
};

struct Plotfile {
  std::vector<std::string> variables;
  double time = 0;
  Vec3 low, high;                  // the corners of the domain
  std::vector<Level> levels;       // coarsest first
  std::vector<std::string> files;  // that say what lies where
  std::vector<std::string> data;   // that hold values
};

Status Wrong(const std::string& file, const std::string& why) { return Status::InvalidArgument(file + ": " + why); }

Result<Level> ReadLevel(const std::string& path, const std::string& name, const Box& domain, Plotfile& plot) {
  const std::string file = (fs::path(path) / (name + "_H")).string(), folder = fs::path(file).parent_path().string();
  if (Status status = CheckIsFile(file); !status.ok()) return status;
  const Result<std::string> read = ReadTextFile(file, kMostTextBytes);
  if (!read.ok()) return read.status();
  plot.files.push_back(file);
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
  std::map<std::string, std::uint32_t> numbers;
  for (Patch& patch : level.patches) {
    const auto word = text.Next<std::string>(), data = text.Next<std::string>();
    patch.offset = text.Next<std::int64_t>();
    if (!text.good() || word != "FabOnDisk:" || data.empty() || patch.offset < 0) return Wrong(file, "a place FabOnDisk is none");
    const auto [found, is_new] = numbers.try_emplace(data, std::uint32_t(plot.data.size()));
    if (is_new) plot.data.push_back((fs::path(folder) / data).string());
    patch.file = found->second;
  }
  std::ranges::sort(level.patches, {}, [](const Patch& patch) { return std::pair(patch.file, patch.offset); });
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
    Result<Level> of_file = ReadLevel(path, name, level.domain, plot);
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

// An open file of values.
struct DataFile {
  std::string name;
  FileDescriptor file;
  std::int64_t bytes = 0;

  Status Wrong(std::int64_t offset, const std::string& why) const {
    return Status::DataLoss(fmt::format("{}: at byte {} {}", name, offset, why));
  }
};

Result<std::shared_ptr<const DataFile>> OpenData(const std::string& name) {
  if (Status status = CheckIsFile(name); !status.ok()) return status;
  FileDescriptor file(::open(name.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat about {};
  if (file.number() < 0 || ::fstat(file.number(), &about) != 0) {
    return Status::NotFound(fmt::format("{}: cannot be opened for reading: {}", name, std::generic_category().message(errno)));
  }
  return std::make_shared<const DataFile>(DataFile{name, std::move(file), about.st_size});
}

Result<FabHeader> ReadFabHeader(const DataFile& file, std::int64_t offset) {
  constexpr std::size_t kMost = 1024;
  std::string line(kMost, '\0');
  line.resize(ReadBytesAt(file.file.number(), std::uint64_t(offset), std::as_writable_bytes(std::span(line))));
  const std::size_t end = line.find('\n');
  if (end == std::string::npos || !line.starts_with("FAB")) return file.Wrong(offset, "begins no box: FAB is missing");
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
    return file.Wrong(offset, "values are of a type that is not supported: it must be floats of 4 or 8 bytes");
  }
  header.type = bytes == 4 ? SampleType::kFloat32 : SampleType::kFloat64;
  header.big_endian = order.front() == 1;
  return header;
}

// The values of a variable. There may be very many patches, in few files.
class PatchReader : public PartReader {
 public:
  // `levels`: finest first.
  PatchReader(std::vector<Level> levels, std::vector<std::string> data, int variable, SampleType type)
      : levels_(std::move(levels)), data_(std::move(data)), variable_(variable), type_(type) {}

  void Read(int level, std::size_t part, const Box& box, const BoxRoom& out, std::stop_token, VolumeSource::ReadDone done) override {
    const Level& of = levels_[std::size_t(level)];
    done(Printable(ReadPatch(of.patches[part], of.domain.begin, box, out)));
  }
  VolumeSource::Counts counts() override { return {.stored_bytes = read_bytes_}; }

 private:
  Status ReadPatch(const Patch& patch, const Index3& first, const Box& box, const BoxRoom& out) {
    const Result<std::shared_ptr<const DataFile>> file = File(patch.file);
    if (!file.ok()) return file.status();
    const Result<FabHeader> header = ReadFabHeader(**file, patch.offset);
    if (!header.ok()) return header.status();
    const auto wrong = [&](const std::string& why) { return (*file)->Wrong(patch.offset, why); };
    if (variable_ >= header->components) {
      return wrong(fmt::format("are {} variables, must be more than {}", header->components, variable_));
    }
    if (header->type != type_) return wrong(fmt::format("values are of {}, must be of {}", ToString(header->type), ToString(type_)));
    const Box stored = {header->box.begin - first, header->box.end - first};
    if (!stored.Contains(patch.box)) return wrong("lies another box than Cell_H says");
    const Index3 size = stored.size();
    if (std::max({size.x, size.y, size.z}) > kMaxVolumeSide) return wrong("lies a box that is too large");
    const std::int64_t begin = patch.offset + header->bytes, bytes = stored.voxel_count() * std::int64_t(BytesPerSample(type_));
    if (bytes > ((*file)->bytes - begin) / (variable_ + 1)) return wrong("lies a box that is truncated: the file ends before it does");
    StoredSamples samples({.size = size, .type = type_},
                          {.file = (*file)->name, .offset = begin + variable_ * bytes, .big_endian = header->big_endian}, 0,
                          {*file, &(*file)->file});
    const Box there = {box.begin - stored.begin, box.end - stored.begin};
    for (const Box& some : samples.Parts(there)) {
      if (Status status = samples.Read(some, {{}, size, there, out}); !status.ok()) return status;
    }
    read_bytes_ += samples.read_bytes();
    return Status::Ok();
  }

  Result<std::shared_ptr<const DataFile>> File(std::uint32_t number) {
    constexpr std::size_t kMostOpen = 64;
    const std::lock_guard lock(mutex_);
    if (const auto* const found = open_.Find(number)) return *found;
    Result<std::shared_ptr<const DataFile>> file = OpenData(data_[number]);
    if (!file.ok()) return file;
    open_.Put(number, *file);
    open_.DropBeyond(kMostOpen);
    return file;
  }

  const std::vector<Level> levels_;
  const std::vector<std::string> data_;
  const int variable_;
  const SampleType type_;
  std::atomic<std::uint64_t> read_bytes_ = 0;
  std::mutex mutex_;                                             // guards what follows
  LruMap<std::uint32_t, std::shared_ptr<const DataFile>> open_;  // by number
};

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

// The largest blocks, of at most 32 cells a side, at whose multiples all patches begin and end: who reads whole ones reads each row once.
Index3 BlockOf(const std::vector<Box>& boxes, const Index3& size) {
  Index3 block = Uniform(32);
  for (const Axis axis : kAxes) {
    for (const Box& box : boxes) {
      block[axis] = std::gcd(block[axis], box.begin[axis]);
      if (box.end[axis] != size[axis]) block[axis] = std::gcd(block[axis], box.end[axis]);
    }
  }
  return Min(block, size);
}

Result<std::shared_ptr<VolumeSource>> Open(const std::string& path, const ReadOptions& options, const SourceContext&) {
  Result<Plotfile> plot = ReadPlotfile(path);
  if (!plot.ok()) return plot.status();
  SourceInfo info{.format = "AMReX plotfile"};
  const Result<int> variable = ChosenVariable(path, *plot, options, info.notes);
  if (!variable.ok()) return variable.status();
  const Patch& first = plot->levels.front().patches.front();
  const Result<std::shared_ptr<const DataFile>> file = OpenData(plot->data[first.file]);
  if (!file.ok()) return file.status();
  const Result<FabHeader> header = ReadFabHeader(**file, first.offset);
  if (!header.ok()) return header.status();
  info.file_type = ToString(header->type);
  info.exact = {header->type, {}};
  info.notes.push_back(fmt::format("time {} of the simulation; {} levels of cells", plot->time, plot->levels.size()));
  info.files = plot->files;
  info.folder = path;
  std::ranges::reverse(plot->levels);
  PartBoxes boxes;
  for (const Level& level : plot->levels) {
    const Result<VolumeGeometry> geometry = GeometryOf(path, *plot, level);
    if (!geometry.ok()) return geometry.status();
    auto of_level = std::make_shared<std::vector<Box>>();
    for (const Patch& patch : level.patches) of_level->push_back(patch.box);
    info.levels.push_back({{*geometry, ScalarType::kFloat32, {}}, BlockOf(*of_level, level.domain.size())});
    boxes.push_back(std::move(of_level));
  }
  return MakeMosaic(path, std::move(info), boxes,
                    std::make_shared<PatchReader>(std::move(plot->levels), std::move(plot->data), *variable, header->type));
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
