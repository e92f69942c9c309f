#include "data/hdf5/netcdf_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <span>

#include "common/base/printable.h"
#include "common/files/file_descriptor.h"
#include "data/hdf5/attributed_file.h"

namespace slabstream {
namespace {

constexpr std::uint64_t kMostHeaderBytes = 16 << 20, kMostDimensions = 1024;  // of a variable, as the library has it
enum Tag : std::uint64_t { kDimensions = 10, kVariables = 11, kAttributes = 12 };

// Types by their numbers, from 1 on; nullopt: characters.
constexpr std::array<std::optional<SampleType>, 11> kTypes = {
    SampleType::kInt8,  std::nullopt,        SampleType::kInt16,  SampleType::kInt32, SampleType::kFloat32, SampleType::kFloat64,
    SampleType::kUint8, SampleType::kUint16, SampleType::kUint32, SampleType::kInt64, SampleType::kUint64};

std::size_t BytesOf(std::optional<SampleType> type) { return type ? BytesPerSample(*type) : 1; }
std::uint64_t Padded(std::uint64_t bytes) { return BoundedSum(bytes, 3) / 4 * 4; }

// Reads on and on. After the first failure it gives zeros and empty texts, and the status says what failed.
class HeaderReader {
 public:
  HeaderReader(int file, std::uint64_t file_bytes, const std::string& path) : file_(file), file_bytes_(file_bytes), path_(path) {}

  Result<NetcdfHeader> Read() {
    constexpr std::uint64_t kMagic = 0x434446;  // "CDF"
    const std::uint64_t magic = Number(4);
    header_.version = int(magic & 0xff);
    if (ok() && (magic >> 8 != kMagic || (header_.version != 1 && header_.version != 2 && header_.version != 5))) {
      return Status::InvalidArgument(
          fmt::format("{}: is a classic netCDF file of version {}, must be 1, 2 or 5", Printable(path_), header_.version));
    }
    const std::uint64_t records = Count();
    for (std::uint64_t left = List(kDimensions, "dimensions"); left > 0 && ok(); --left) {
      std::string name = Name();
      dimensions_.push_back({std::move(name), Count()});
    }
    if (std::ranges::count(dimensions_, 0U, &Dimension::size) > 1) Fail("has several unlimited dimensions, must have at most one");
    header_.attributes = Attributes();
    std::vector<std::pair<std::string, NetcdfVariable>> variables;
    for (std::uint64_t left = List(kVariables, "variables"); left > 0 && ok(); --left) {
      std::string name = Name();
      NetcdfVariable variable = Variable(name);
      variables.emplace_back(std::move(name), std::move(variable));
    }
    if (!ok()) return status_;
    CountRecords(records, variables);
    for (auto& [name, variable] : variables) {
      if (!header_.variables.emplace(name, std::move(variable)).second) Fail(fmt::format("has two variables '{}'", name));
    }
    if (!ok()) return status_;
    return std::move(header_);
  }

 private:
  struct Dimension {
    std::string name;
    std::uint64_t size = 0;  // 0: it is the unlimited one
  };

  bool ok() const { return status_.ok(); }
  void Fail(const std::string& why, StatusCode code = StatusCode::kDataLoss) {
    if (ok()) status_ = Status(code, Printable(fmt::format("{}: the netCDF header {}", path_, why)));
  }

  // The next bytes, of which the file has that many. They stay until the next call. Empty after a failure.
  std::span<const std::byte> Take(std::uint64_t bytes) {
    constexpr std::uint64_t kBlock = 64 << 10;
    if (bytes > file_bytes_ - at_) Fail(fmt::format("needs {} bytes from byte {} on, but the file has {}", bytes, at_, file_bytes_));
    if (bytes > kMostHeaderBytes - at_) Fail(fmt::format("has more than {} bytes", kMostHeaderBytes), StatusCode::kResourceExhausted);
    if (!ok()) return {};
    if (at_ < block_begin_ || at_ + bytes > block_begin_ + block_.size()) {
      block_.resize(std::min(std::max(bytes, kBlock), file_bytes_ - at_));
      block_begin_ = at_;
      if (ReadBytesAt(file_, at_, block_) != block_.size()) Fail(fmt::format("cannot be read at byte {}", at_));
      if (!ok()) return {};
    }
    const std::span<const std::byte> taken = std::span(block_).subspan(at_ - block_begin_, bytes);
    at_ += bytes;
    return taken;
  }

  std::uint64_t Number(std::size_t bytes) {
    std::uint64_t number = 0;
    for (const std::byte each : Take(bytes)) number = number << 8 | std::to_integer<std::uint64_t>(each);
    return number;
  }
  std::uint64_t Count() { return Number(header_.version == 5 ? 8 : 4); }

  std::string Text(std::uint64_t bytes) {
    const std::span<const std::byte> taken = Take(Padded(bytes));
    return taken.empty() ? "" : std::string(reinterpret_cast<const char*>(taken.data()), bytes);
  }
  std::string Name() { return Text(Count()); }

  // How many elements a list has. One that is absent has the tag 0.
  std::uint64_t List(Tag tag, const char* what) {
    const std::uint64_t found = Number(4), count = Count();
    if (found != tag && (found != 0 || count != 0))
      Fail(fmt::format("has the tag {} before its {}, must be {} or 0", found, what, int(tag)));
    if (count > AttributedFile::kMostNames) Fail(fmt::format("states {} {}, must be at most {}", count, what, AttributedFile::kMostNames));
    return ok() ? count : 0;
  }

  std::optional<SampleType> Type(const std::string& name) {
    const std::uint64_t number = Number(4);
    if (ok() && number - 1 < kTypes.size()) return kTypes[number - 1];
    Fail(fmt::format("states the type {} of '{}', must be from 1 to {}", number, name, kTypes.size()));
    return std::nullopt;
  }

  NetcdfAttributes Attributes() {
    NetcdfAttributes attributes;
    for (std::uint64_t left = List(kAttributes, "attributes"); left > 0 && ok(); --left) {
      const std::string name = Name();
      const std::optional<SampleType> type = Type(name);
      const std::uint64_t bytes = BoundedProduct(Count(), BytesOf(type));
      const std::span<const std::byte> stored = Take(Padded(bytes)).first(ok() ? bytes : 0);
      NetcdfAttribute& attribute = attributes[name];
      if (stored.empty() || bytes > AttributedFile::kMostAttributeBytes) continue;
      if (type) {
        attribute.numbers = NetcdfNumbers(*type, {stored.begin(), stored.end()});
      } else {
        attribute.text.emplace(reinterpret_cast<const char*>(stored.data()), bytes);
      }
    }
    return attributes;
  }

  NetcdfVariable Variable(const std::string& name) {
    NetcdfVariable variable;
    const std::uint64_t count = Count();
    if (count > kMostDimensions) Fail(fmt::format("states {} dimensions of '{}', must be at most {}", count, name, kMostDimensions));
    for (std::uint64_t i = 0; i < count && ok(); ++i) {
      const std::uint64_t number = Count();
      if (number >= dimensions_.size()) {
        Fail(fmt::format("states the dimension {} of '{}', must be below {}", number, name, dimensions_.size()));
        break;
      }
      const auto& [dimension, size] = dimensions_[number];
      if (size == 0 && i > 0) Fail(fmt::format("has the unlimited dimension as number {} of '{}', must be number 0", i, name));
      variable.records = variable.records || size == 0;
      variable.dimensions.push_back(dimension);
      variable.size.push_back(size);
    }
    variable.attributes = Attributes();
    variable.type = Type(name);
    (void)Count();  // its bytes, which follow from the rest and have too few bits for large variables
    variable.begin = Number(header_.version == 1 ? 4 : 8);
    return variable;
  }

  // How many bytes lie next to each other, how far records lie apart, and how many there are: what the header states, or, while a program
  // writes, as many as the file has room for.
  void CountRecords(std::uint64_t stated, std::vector<std::pair<std::string, NetcdfVariable>>& variables) {
    std::uint64_t padded = 0, first = file_bytes_, last_bytes = 0;
    int with_records = 0;
    for (auto& [name, variable] : variables) {
      variable.piece_bytes = BytesOf(variable.type);
      for (std::size_t axis = variable.records ? 1 : 0; axis < variable.size.size(); ++axis)
        variable.piece_bytes = BoundedProduct(variable.piece_bytes, variable.size[axis]);
      if (!variable.records) continue;
      last_bytes = variable.piece_bytes;
      padded = BoundedSum(padded, Padded(last_bytes));
      first = std::min(first, variable.begin);
      ++with_records;
    }
    if (with_records == 0) return;
    header_.record_bytes = with_records == 1 ? last_bytes : padded;  // the records of an only variable lie next to each other
    const bool streaming = stated == (header_.version == 5 ? std::numeric_limits<std::uint64_t>::max() : 0xffffffff);
    for (auto& [name, variable] : variables) {
      if (variable.records) variable.size.front() = streaming ? (file_bytes_ - first) / header_.record_bytes : stated;
    }
  }

  const int file_;
  const std::uint64_t file_bytes_;
  const std::string& path_;
  std::uint64_t at_ = 0, block_begin_ = 0;
  std::vector<std::byte> block_;
  std::vector<Dimension> dimensions_;
  NetcdfHeader header_;
  Status status_ = Status::Ok();
};

}  // namespace

Result<NetcdfHeader> ReadNetcdfHeader(int file, std::uint64_t file_bytes, const std::string& path) {
  return HeaderReader(file, file_bytes, path).Read();
}

std::vector<double> NetcdfNumbers(SampleType type, std::vector<std::byte> stored) {
  SwapByteOrder(type, stored);
  std::vector<double> numbers(stored.size() / BytesPerSample(type));
  VisitSampleType(type, [&](const auto* null) {
    std::remove_cvref_t<decltype(*null)> element;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      std::memcpy(&element, stored.data() + i * sizeof element, sizeof element);
      numbers[i] = double(element);
    }
  });
  return numbers;
}

std::uint64_t BoundedProduct(std::uint64_t a, std::uint64_t b) {
  std::uint64_t product = 0;
  return __builtin_mul_overflow(a, b, &product) ? std::numeric_limits<std::uint64_t>::max() : product;
}

std::uint64_t BoundedSum(std::uint64_t a, std::uint64_t b) {
  std::uint64_t sum = 0;
  return __builtin_add_overflow(a, b, &sum) ? std::numeric_limits<std::uint64_t>::max() : sum;
}

}  // namespace slabstream
