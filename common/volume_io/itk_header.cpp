#include "common/volume_io/itk_header.h"

#include <itkImageIOBase.h>

#include <optional>

namespace slabstream {
namespace {

template <class Signed>
SampleType IntegerOfSize(std::size_t bytes) {
  constexpr bool kSigned = std::is_signed_v<Signed>;
  return bytes == 4 ? (kSigned ? SampleType::kInt32 : SampleType::kUint32) : (kSigned ? SampleType::kInt64 : SampleType::kUint64);
}

std::optional<SampleType> ToSampleType(itk::IOComponentEnum component) {
  switch (component) {
    case itk::IOComponentEnum::CHAR: return SampleType::kInt8;
    case itk::IOComponentEnum::UCHAR: return SampleType::kUint8;
    case itk::IOComponentEnum::SHORT: return SampleType::kInt16;
    case itk::IOComponentEnum::USHORT: return SampleType::kUint16;
    case itk::IOComponentEnum::INT: return SampleType::kInt32;
    case itk::IOComponentEnum::UINT: return SampleType::kUint32;
    case itk::IOComponentEnum::LONG: return IntegerOfSize<long>(sizeof(long));
    case itk::IOComponentEnum::ULONG: return IntegerOfSize<unsigned long>(sizeof(long));
    case itk::IOComponentEnum::LONGLONG: return SampleType::kInt64;
    case itk::IOComponentEnum::ULONGLONG: return SampleType::kUint64;
    case itk::IOComponentEnum::FLOAT: return SampleType::kFloat32;
    case itk::IOComponentEnum::DOUBLE: return SampleType::kFloat64;
    default: return std::nullopt;
  }
}

Result<RawHeader> HeaderOf(const itk::ImageIOBase& io, const std::string& path) {
  constexpr unsigned kDimensions = 3;
  const unsigned dimensions = io.GetNumberOfDimensions();
  unsigned significant = dimensions;
  while (significant > kDimensions && io.GetDimensions(significant - 1) == 1) --significant;
  if (significant != kDimensions) {
    return Status::InvalidArgument(path + ": has " + std::to_string(significant) + " dimensions, must have 3");
  }
  if (io.GetNumberOfComponents() != 1) {
    return Status::InvalidArgument(path + ": has " + std::to_string(io.GetNumberOfComponents()) + " components a voxel, must have 1");
  }
  const std::optional<SampleType> type = ToSampleType(io.GetComponentType());
  if (!type) {
    return Status::InvalidArgument(path + ": samples of type " + itk::ImageIOBase::GetComponentTypeAsString(io.GetComponentType()) +
                                   " are not supported, integers of 8 to 64 bits and floats of 32 and 64 bits are");
  }
  std::array<std::int64_t, 3> size{};
  for (unsigned i = 0; i < kDimensions; ++i) size[i] = std::int64_t(std::min<std::uint64_t>(io.GetDimensions(i), INT64_MAX));
  if (Status status = CheckSize(path, size); !status.ok()) return status;

  RawHeader header;
  header.type = *type;
  header.size = {std::int32_t(size[0]), std::int32_t(size[1]), std::int32_t(size[2])};
  for (unsigned i = 0; i < kDimensions; ++i) {
    header.spacing[int(i)] = io.GetSpacing(i);
    header.origin[int(i)] = io.GetOrigin(i);
    const std::vector<double> direction = io.GetDirection(i);
    for (unsigned j = 0; j < kDimensions && j < direction.size(); ++j) header.directions[i][int(j)] = direction[j];
  }
  return header;
}

}  // namespace

std::string CauseOf(const std::string& description) {
  const std::size_t end = description.find_last_not_of(" \n\r\t");
  if (end == std::string::npos) return "unknown error";
  std::string line = description.substr(0, end + 1);
  line.erase(0, line.find_last_of('\n') + 1);  // npos + 1 is 0
  // "ITK ERROR: NiftiImageIO(0x559b6a608880): what it is about"
  if (const std::size_t object = line.find("(0x"); object != std::string::npos) {
    if (const std::size_t after = line.find("): ", object); after != std::string::npos) line.erase(0, after + 3);
  }
  return line;
}

Result<RawHeader> ReadItkHeader(itk::ImageIOBase& io, const std::string& path, const std::string& format) {
  itk::Object::GlobalWarningDisplayOff();  // what is wrong is reported as a Status
  const auto failed = [&](const std::string& why) { return Status::InvalidArgument(path + ": not a " + format + " volume: " + why); };
  try {
    if (!io.CanReadFile(path.c_str())) return failed("the header is not one");
    io.SetFileName(path);
    io.ReadImageInformation();
    return HeaderOf(io, path);
  } catch (const itk::ExceptionObject& error) {
    return failed(CauseOf(error.GetDescription()));
  } catch (const std::exception& error) {
    return failed(CauseOf(error.what()));
  }
}

}  // namespace slabstream
