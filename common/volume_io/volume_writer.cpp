#include <itkMetaImageIO.h>
#include <itkNrrdImageIO.h>

#include <filesystem>
#include <fstream>

#include "common/volume_io/itk_header.h"
#include "common/volume_io/text_header.h"
#include "common/volume_io/volume_reader.h"

namespace slabstream {
namespace {

// Samples as a file without a value mapping can hold them: the data values themselves.
struct FileSamples {
  itk::IOComponentEnum type = itk::IOComponentEnum::UCHAR;
  AlignedVector<std::byte> converted;  // empty: the volume's own bytes
};

template <class Stored, class Value>
AlignedVector<std::byte> DataValues(const Volume& volume) {
  const std::int64_t count = volume.block.box.voxel_count();
  AlignedVector<std::byte> bytes(std::size_t(count) * sizeof(Value));
  const Stored* in = volume.block.samples<Stored>();
  Value* out = reinterpret_cast<Value*>(bytes.data());
  for (std::int64_t i = 0; i < count; ++i) out[i] = Value(volume.description.mapping.FromStored(double(in[i])));
  return bytes;
}

FileSamples ToFileSamples(const Volume& volume) {
  const ValueMapping& mapping = volume.description.mapping;
  const ScalarType type = volume.description.type;
  if (mapping == ValueMapping{}) {
    switch (type) {
      case ScalarType::kUint8: return {itk::IOComponentEnum::UCHAR, {}};
      case ScalarType::kUint16: return {itk::IOComponentEnum::USHORT, {}};
      case ScalarType::kFloat32: return {itk::IOComponentEnum::FLOAT, {}};
    }
  }
  // What was read from signed integers is signed again.
  if (type == ScalarType::kUint8 && mapping == ValueMapping{1, -128}) {
    return {itk::IOComponentEnum::CHAR, DataValues<std::uint8_t, std::int8_t>(volume)};
  }
  if (type == ScalarType::kUint16 && mapping == ValueMapping{1, -32768}) {
    return {itk::IOComponentEnum::SHORT, DataValues<std::uint16_t, std::int16_t>(volume)};
  }
  return VisitScalarType(type, [&]<class T>(const T*) { return FileSamples{itk::IOComponentEnum::FLOAT, DataValues<T, float>(volume)}; });
}

itk::ImageIOBase::Pointer MakeWriter(const std::string& path) {
  const std::string lower = ToLower(path);
  if (lower.ends_with(".nrrd")) {
    const itk::ImageIOBase::Pointer io = itk::NrrdImageIO::New().GetPointer();
    io->SetUseCompression(true);
    return io;
  }
  if (lower.ends_with(".mha") || lower.ends_with(".mhd")) return itk::MetaImageIO::New().GetPointer();
  return nullptr;
}

}  // namespace

Status WriteVolume(const Volume& volume, const std::string& path) {
  itk::Object::GlobalWarningDisplayOff();
  const itk::ImageIOBase::Pointer io = MakeWriter(path);
  if (io.IsNull()) return Status::InvalidArgument(path + ": volumes are written as .nrrd, .mha or .mhd");
  // ITK's writers differ in how they report this.
  if (!std::ofstream(path, std::ios::binary)) return Status::InvalidArgument(path + ": cannot be opened for writing");

  constexpr unsigned kDimensions = 3;
  const FileSamples samples = ToFileSamples(volume);
  io->SetFileName(path);
  io->SetNumberOfDimensions(kDimensions);
  io->SetNumberOfComponents(1);
  io->SetPixelType(itk::IOPixelEnum::SCALAR);
  io->SetComponentType(samples.type);
  itk::ImageIORegion region(kDimensions);
  for (unsigned i = 0; i < kDimensions; ++i) {
    const std::int32_t size = volume.description.geometry.size[int(i)];
    io->SetDimensions(i, itk::SizeValueType(size));
    io->SetSpacing(i, volume.description.geometry.spacing[int(i)]);
    io->SetOrigin(i, 0);
    std::vector<double> direction(kDimensions);
    direction[i] = 1;
    io->SetDirection(i, direction);
    region.SetSize(i, itk::SizeValueType(size));
  }
  io->SetIORegion(region);
  try {
    io->WriteImageInformation();
    io->Write(samples.converted.empty() ? volume.block.bytes.data() : samples.converted.data());
  } catch (const itk::ExceptionObject& error) {
    return Status::Internal(path + ": cannot be written: " + CauseOf(error.GetDescription()));
  } catch (const std::exception& error) {
    return Status::Internal(path + ": cannot be written: " + CauseOf(error.what()));
  }
  return Status::Ok();
}

}  // namespace slabstream
