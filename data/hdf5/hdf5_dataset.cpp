#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "common/base/printable.h"
#include "data/hdf5/hdf5_driver.h"
#include "data/hdf5/hdf5_file.h"
#include "data/hdf5/hdf5_library.h"

namespace slabstream {
namespace {

std::string NameOf(H5T_class_t kind) {
  switch (kind) {
    case H5T_INTEGER: return "integers";
    case H5T_FLOAT: return "floats";
    case H5T_TIME: return "times";
    case H5T_STRING: return "texts";
    case H5T_BITFIELD: return "bit fields";
    case H5T_OPAQUE: return "opaque bytes";
    case H5T_COMPOUND: return "compounds";
    case H5T_REFERENCE: return "references";
    case H5T_ENUM: return "enumerations";
    case H5T_VLEN: return "sequences of any length";
    case H5T_ARRAY: return "arrays";
    default: return "elements of an unknown type";
  }
}

// Names of the members of a compound or of an enumeration, the first ones if there are many.
std::vector<std::string> MembersOf(hid_t type) {
  constexpr int kMost = 8;
  std::vector<std::string> members;
  for (int i = 0; i < std::min(H5Tget_nmembers(type), kMost); ++i) {
    char* const name = H5Tget_member_name(type, unsigned(i));
    members.emplace_back(name == nullptr ? "" : Printable(std::string(name)).substr(0, 64));
    (void)H5free_memory(name);
  }
  return members;
}

std::string NamesOfMembers(hid_t type) {
  const std::vector<std::string> members = MembersOf(type);
  const bool complex = members == std::vector<std::string>{"r", "i"} || members == std::vector<std::string>{"real", "imag"};
  return fmt::format("{} (members {})", complex ? "complex numbers" : "compounds", fmt::join(members, ", "));
}

// Of truth values, as h5py writes them.
bool IsTruth(hid_t enumeration) { return MembersOf(enumeration) == std::vector<std::string>{"FALSE", "TRUE"}; }

// Whether a type of two bytes is the half float of IEEE 754.
bool IsHalf(hid_t type) {
  std::size_t sign = 0, exponent = 0, exponent_bits = 0, mantissa = 0, mantissa_bits = 0;
  return H5Tget_fields(type, &sign, &exponent, &exponent_bits, &mantissa, &mantissa_bits) >= 0 && H5Tget_size(type) == 2 && sign == 15 &&
         exponent == 10 && exponent_bits == 5 && mantissa == 0 && mantissa_bits == 10 && H5Tget_ebias(type) == 15 &&
         H5Tget_norm(type) == H5T_NORM_IMPLIED;
}

std::optional<SampleType> IntegerType(std::size_t bytes, bool is_signed) {
  switch (bytes) {
    case 1: return is_signed ? SampleType::kInt8 : SampleType::kUint8;
    case 2: return is_signed ? SampleType::kInt16 : SampleType::kUint16;
    case 4: return is_signed ? SampleType::kInt32 : SampleType::kUint32;
    case 8: return is_signed ? SampleType::kInt64 : SampleType::kUint64;
    default: return std::nullopt;
  }
}

}  // namespace

Hdf5Dataset::~Hdf5Dataset() {
  const Hdf5Lock lock;
  (void)H5Dclose(id_);
}

Status Hdf5Dataset::DescribeType(hid_t stored) {
  const bool enumerated = H5Tget_class(stored) == H5T_ENUM, truth = enumerated && IsTruth(stored);
  const Hdf5Id type(enumerated ? H5Tget_super(stored) : H5Tcopy(stored), H5Tclose);  // of its numbers
  if (!type.ok()) return Refused("has no type: " + Hdf5Complaint());
  const H5T_class_t kind = H5Tget_class(type.id());
  const std::size_t bytes = H5Tget_size(type.id());
  const auto is = [&](hid_t other) { return H5Tequal(type.id(), other) > 0; };
  const bool whole = kind == H5T_INTEGER || kind == H5T_BITFIELD;
  const std::size_t used = whole || kind == H5T_FLOAT ? H5Tget_precision(type.id()) : 8 * bytes;
  std::optional<SampleType> found;
  if (whole && used == 8 * bytes) found = IntegerType(bytes, !truth && kind == H5T_INTEGER && H5Tget_sign(type.id()) == H5T_SGN_2);
  if (is(H5T_IEEE_F32LE) || is(H5T_IEEE_F32BE)) found = SampleType::kFloat32;
  if (is(H5T_IEEE_F64LE) || is(H5T_IEEE_F64BE)) found = SampleType::kFloat64;
  if (kind == H5T_FLOAT && IsHalf(type.id())) found = SampleType::kFloat16;
  if (!found) {
    return Refused(
        fmt::format("holds {} of {} bits{}; supported: integers, enumerations and bit fields of 8, 16, 32 and 64 bits and floats "
                    "of 16, 32 and 64",
                    kind == H5T_COMPOUND ? NamesOfMembers(type.id()) : NameOf(kind), 8 * bytes,
                    used == 8 * bytes ? "" : fmt::format(", of which {} are used", used)));
  }
  facts_.type = *found;
  big_endian_ = H5Tget_order(type.id()) == H5T_ORDER_BE;
  facts_.enumeration = enumerated && !truth;
  return Status::Ok();
}

Status Hdf5Dataset::DescribeLayout(hid_t creation) {
  switch (H5Pget_layout(creation)) {
    case H5D_COMPACT: layout_ = Layout::kCompact; return Status::Ok();
    case H5D_CONTIGUOUS: {
      layout_ = Layout::kContiguous;
      if (H5Pget_external_count(creation) != 0) return Refused("keeps its samples in other files (external storage), which are not read");
      if (const haddr_t begin = H5Dget_offset(id_); begin != HADDR_UNDEF) begin_ = begin;
      return Status::Ok();
    }
    case H5D_CHUNKED: break;
    case H5D_VIRTUAL: return Refused("is a virtual dataset, made of parts of others, which is not supported");
    default: return Refused("has a layout that is not known");
  }
  layout_ = Layout::kChunked;
  std::array<hsize_t, H5S_MAX_RANK> chunk{};
  if (H5Pget_chunk(creation, int(chunk.size()), chunk.data()) != int(facts_.size.size()))
    return Refused("has chunks with other axes than it has");
  chunk_.assign(chunk.begin(), chunk.begin() + std::ptrdiff_t(facts_.size.size()));
  std::uint64_t bytes = BytesPerSample(facts_.type);
  for (const std::uint64_t along : chunk_) {
    if (along < 1 || along > kMostChunkBytes / bytes) {
      return Status::ResourceExhausted(named() + fmt::format(" has chunks of more than {} bytes", kMostChunkBytes));
    }
    bytes *= along;
  }
  unsigned options = 0;
  filters_cut_chunks_ = H5Pget_chunk_opts(creation, &options) < 0 || (options & H5D_CHUNK_DONT_FILTER_PARTIAL_CHUNKS) == 0;

  const int filters = H5Pget_nfilters(creation);
  for (int i = 0; i < filters; ++i) {
    unsigned flags = 0, configuration = 0;
    std::array<unsigned, 32> values{};
    std::size_t count = values.size();
    std::array<char, 64> name{};
    const H5Z_filter_t id = H5Pget_filter2(creation, unsigned(i), &flags, &count, values.data(), name.size(), name.data(), &configuration);
    if (id < 0) return Refused("has a filter that cannot be read: " + Hdf5Complaint());
    name.back() = '\0';
    filters_.push_back({id, Printable(name.data()), {values.begin(), values.begin() + std::ptrdiff_t(std::min(count, values.size()))}});
  }
  return Status::Ok();
}

Status Hdf5Dataset::Describe() {
  const Hdf5Id creation(H5Dget_create_plist(id_), H5Pclose);
  if (!creation.ok()) return Refused("has no layout: " + Hdf5Complaint());
  if (H5Pget_layout(creation.id()) == H5D_VIRTUAL) return DescribeLayout(creation.id());  // its size would open other files

  const Hdf5Id space(H5Dget_space(id_), H5Sclose);
  std::array<hsize_t, H5S_MAX_RANK> size{};
  const int axes = space.ok() ? H5Sget_simple_extent_dims(space.id(), size.data(), nullptr) : 0;
  facts_.size.assign(size.begin(), size.begin() + std::max(axes, 0));
  if (Status status = file_->CheckSize(facts_.path, facts_.size); !status.ok()) return status;

  const Hdf5Id type(H5Dget_type(id_), H5Tclose);
  if (!type.ok()) return Refused("has no type: " + Hdf5Complaint());
  if (Status status = DescribeType(type.id()); !status.ok()) return status;
  if (Status status = DescribeLayout(creation.id()); !status.ok()) return status;

  fill_.assign(BytesPerSample(facts_.type), std::byte{0});
  H5D_fill_value_t fill{};
  if (H5Pfill_value_defined(creation.id(), &fill) >= 0 && fill == H5D_FILL_VALUE_USER_DEFINED) {
    if (H5Pget_fill_value(creation.id(), type.id(), fill_.data()) >= 0 && big_endian_) SwapByteOrder(facts_.type, fill_);
  }
  return Status::Ok();
}

Result<std::optional<Hdf5StoredChunk>> Hdf5Dataset::Find(std::span<const std::uint64_t> index) const {
  std::array<hsize_t, kMaxArrayAxes> offset{};
  for (std::size_t axis = 0; axis < facts_.size.size(); ++axis) offset[axis] = index[axis] * chunk_[axis];
  const Hdf5Lock lock;
  std::uint32_t left_out = 0;
  if (const auto place = FindHdf5Chunk(file_->id_, id_, offset.data(), left_out)) {
    return std::optional(Hdf5StoredChunk{place->begin, place->bytes, left_out});
  }
  // The index answered, and has no address. If it is damaged, the first failure is one of the index.
  if (Hdf5FailedFirst(H5E_DATASET, H5E_CANTGET)) return std::optional<Hdf5StoredChunk>();
  return Status::DataLoss(named() + " has a damaged index of chunks: " + Hdf5Complaint());
}

Result<Bytes> Hdf5Dataset::ReadCompact() const {
  constexpr std::uint64_t kMost = 64 << 10;  // as the format allows
  std::uint64_t bytes = BytesPerSample(facts_.type);
  for (const std::uint64_t along : facts_.size) {
    if (along > kMost / bytes) return Status::DataLoss(named() + " is compact, and has more than 64 KiB");
    bytes *= along;
  }
  AlignedVector<std::byte> samples(bytes);
  const Hdf5Lock lock;
  const Hdf5Id type(H5Dget_type(id_), H5Tclose);  // as it is stored
  if (H5Dread(id_, type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, samples.data()) < 0) {
    return Status::DataLoss(named() + " cannot be read: " + Hdf5Complaint());
  }
  if (big_endian_) SwapByteOrder(facts_.type, samples);
  return Bytes(std::move(samples));
}

}  // namespace slabstream
