#include "data/hdf5/classic_netcdf.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "common/files/file_descriptor.h"
#include "common/text/natural_order.h"
#include "data/hdf5/netcdf_header.h"
#include "data/sources/file_array.h"
#include "data/stores/range_reader.h"

namespace slabstream {
namespace {

// Variables are datasets in the only group, "/". Each dimension has a scale, as in netCDF-4: the variable that is called like it, if any.
class ClassicNetcdf : public AttributedFile {
 public:
  ClassicNetcdf(std::string path, FileDescriptor file, std::uint64_t file_bytes, NetcdfHeader header)
      : AttributedFile(std::move(path)), file_(std::move(file)), file_bytes_(file_bytes), header_(std::move(header)) {}

  std::string format() override { return fmt::format("classic netCDF (CDF-{})", header_.version); }
  bool Has(const std::string& object) override { return AttributesOf(object) != nullptr; }

  Result<std::vector<std::string>> Names(const std::string& group) override {
    std::vector<std::string> names;
    if (group != "/") return names;
    for (const auto& [name, variable] : header_.variables) names.push_back(name);
    std::ranges::sort(names, {}, InNaturalOrder);
    return names;
  }

  std::optional<std::string> Text(const std::string& object, const std::string& attribute) override {
    const NetcdfAttribute* const found = Find(object, attribute);
    if (found == nullptr || !found->text) return std::nullopt;
    std::string text = *found->text;
    text.resize(std::min(text.find('\0'), text.size()));
    text.resize(text.find_last_not_of(' ') + 1);
    return text;
  }
  std::optional<std::vector<std::string>> Texts(const std::string& object, const std::string& attribute) override {
    std::optional<std::string> text = Text(object, attribute);
    return text ? std::optional(std::vector{*std::move(text)}) : std::nullopt;
  }
  std::optional<std::vector<double>> Numbers(const std::string& object, const std::string& attribute) override {
    const NetcdfAttribute* const found = Find(object, attribute);
    return found == nullptr ? std::nullopt : found->numbers;
  }

  std::vector<std::string> DimensionScales(const std::string& dataset) override {
    std::vector<std::string> scales;
    const NetcdfVariable* const variable = VariableAt(dataset);
    for (const std::string& name : variable == nullptr ? std::vector<std::string>{} : variable->dimensions) scales.push_back("/" + name);
    return scales;
  }

  Found Datasets(int axes) override {
    Found found;
    for (const auto& [name, variable] : header_.variables) {
      if (variable.type && variable.size.size() >= std::size_t(axes)) found.paths.push_back("/" + name);
    }
    std::ranges::sort(found.paths, {}, InNaturalOrder);
    return found;
  }

  Result<DatasetFacts> Describe(const std::string& dataset) override {
    if (Status status = CheckNumbers(dataset); !status.ok()) return status;
    const NetcdfVariable& variable = *VariableAt(dataset);
    if (Status status = CheckSize(dataset, variable.size); !status.ok()) return status;
    return DatasetFacts{.path = dataset, .size = variable.size, .type = *variable.type};
  }

  Result<std::shared_ptr<ChunkedArray>> Array(const std::string& dataset, const SourceContext& context,
                                              std::optional<SampleType> as) override {
    const Result<DatasetFacts> facts = Describe(dataset);
    if (!facts.ok()) return facts.status();
    const NetcdfVariable& variable = *VariableAt(dataset);
    ArrayShape shape{.size = facts->size, .type = as.value_or(facts->type)};
    shape.fill.resize(BytesPerSample(shape.type));
    return MakePlainArray(path(), Named(dataset), std::move(shape),
                          {.begin = variable.begin, .record_bytes = variable.records ? header_.record_bytes : 0, .big_endian = true},
                          context);
  }

  Result<std::vector<double>> SmallDataset(const std::string& dataset) override {
    if (Status status = CheckNumbers(dataset); !status.ok()) return status;
    const NetcdfVariable& variable = *VariableAt(dataset);
    const std::uint64_t pieces = variable.records ? variable.size.front() : 1, bytes = variable.piece_bytes;
    const std::uint64_t count = BoundedProduct(pieces, bytes / BytesPerSample(*variable.type));
    if (count < 1 || count > kMostSmallNumbers) {
      return Status::ResourceExhausted(Named(dataset) + fmt::format(" has {} numbers, must have from 1 to {}", count, kMostSmallNumbers));
    }
    std::vector<std::byte> stored(pieces * bytes);
    for (std::uint64_t i = 0; i < pieces; ++i) {
      const std::span<std::byte> piece = std::span(stored).subspan(i * bytes, bytes);
      if (ReadBytesAt(file_.number(), variable.begin + i * header_.record_bytes, piece) != bytes)
        return Status::DataLoss(Named(dataset) + " cannot be read");
    }
    return NetcdfNumbers(*variable.type, std::move(stored));
  }

 private:
  const NetcdfVariable* VariableAt(const std::string& dataset) const {
    const auto found = dataset.starts_with('/') ? header_.variables.find(dataset.substr(1)) : header_.variables.end();
    return found == header_.variables.end() ? nullptr : &found->second;
  }

  const NetcdfAttributes* AttributesOf(const std::string& object) const {
    const NetcdfVariable* const variable = VariableAt(object);
    return object == "/" ? &header_.attributes : variable == nullptr ? nullptr : &variable->attributes;
  }

  const NetcdfAttribute* Find(const std::string& object, const std::string& name) const {
    const NetcdfAttributes* const attributes = AttributesOf(object);
    const auto found = attributes == nullptr ? NetcdfAttributes::const_iterator() : attributes->find(name);
    return attributes == nullptr || found == attributes->end() ? nullptr : &found->second;
  }

  // It is a variable of numbers, and the file is long enough for it.
  Status CheckNumbers(const std::string& dataset) const {
    const NetcdfVariable* const variable = VariableAt(dataset);
    if (variable == nullptr) return Status::NotFound(Named(dataset) + " is not in the file");
    if (!variable->type) return Status::InvalidArgument(Named(dataset) + " holds texts, must hold numbers");
    const std::uint64_t pieces = variable->records ? variable->size.front() : 1;
    if (pieces == 0) return Status::Ok();
    const std::uint64_t last = BoundedSum(variable->begin, BoundedProduct(pieces - 1, header_.record_bytes));
    const std::uint64_t end = BoundedSum(last, variable->piece_bytes);
    if (end <= file_bytes_) return Status::Ok();
    return Status::DataLoss(Named(dataset) + fmt::format(" of {} ends at byte {}, but the file has {} bytes",
                                                         fmt::join(variable->size, " x "), end, file_bytes_));
  }

  const FileDescriptor file_;
  const std::uint64_t file_bytes_;
  const NetcdfHeader header_;
};

}  // namespace

Result<std::unique_ptr<AttributedFile>> OpenClassicNetcdf(const std::string& path) {
  FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.number() < 0) return OpenFailure(path, errno);
  struct stat found {};
  if (::fstat(file.number(), &found) != 0) return OpenFailure(path, errno);
  const auto file_bytes = std::uint64_t(found.st_size);
  Result<NetcdfHeader> header = ReadNetcdfHeader(file.number(), file_bytes, path);
  if (!header.ok()) return header.status();
  return std::unique_ptr<AttributedFile>(std::make_unique<ClassicNetcdf>(path, std::move(file), file_bytes, *std::move(header)));
}

}  // namespace slabstream
