// VTK image data in XML (.vti): one piece (vtk_xml.h).
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "data/volume_io/formats.h"
#include "data/volume_io/output.h"
#include "data/volume_io/vtk_xml.h"

namespace slabstream {
namespace {

Result<RawHeader> HeaderOf(const VtkXmlFile& file, const std::string& path, const ReadOptions& options) {
  if (file.pieces() != 1) return file.Wrong(fmt::format("has {} pieces, must have 1", file.pieces()));
  const auto whole = file.Numbers(file.dataset(), "WholeExtent", 6, {}), extent = file.Numbers(file.piece(), "Extent", 6, {});
  const auto origin = file.Numbers(file.dataset(), "Origin", 3, {0, 0, 0}), spacing = file.Numbers(file.dataset(), "Spacing", 3, {1, 1, 1});
  const auto direction = file.Numbers(file.dataset(), "Direction", 9, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  for (const auto* numbers : {&whole, &extent, &origin, &spacing, &direction}) {
    if (!numbers->ok()) return numbers->status();
  }
  if (*whole != *extent) {
    return file.Wrong(fmt::format("its piece has the extent {}, must have all of it: {}", file.piece().Attribute("Extent"),
                                  file.dataset().Attribute("WholeExtent")));
  }
  const auto& e = *extent;
  RawHeader header;
  if (Status status = SetSize(header, path, {e[1] - e[0] + 1, e[3] - e[2] + 1, e[5] - e[4] + 1}, options); !status.ok()) return status;
  header.world = World::kScene;
  header.matrix = "Direction";
  header.origin = {(*origin)[0], (*origin)[1], (*origin)[2]};
  for (std::size_t i = 0; i < 3; ++i) {
    header.steps[i] = (*spacing)[i] * Vec3{(*direction)[i], (*direction)[3 + i], (*direction)[6 + i]};
    header.origin = header.origin + e[2 * i] * header.steps[i];
  }
  return header;
}

Result<VtkArray> ChooseArray(const VtkXmlFile& file) {
  std::vector<const VtkArray*> arrays;
  for (const VtkArray& array : file.arrays()) {
    if (array.section == "PointData") arrays.push_back(&array);
  }
  if (arrays.size() == 1) return *arrays.front();
  const std::string& scalars = file.ActiveScalars("PointData");
  const auto active = std::ranges::find_if(arrays, [&](const VtkArray* array) { return array->name() == scalars; });
  if (active != arrays.end() && !scalars.empty()) return **active;
  std::string names;
  for (const VtkArray* array : arrays) names.append(names.empty() ? "" : ", ").append(array->name());
  if (!names.empty()) return file.Wrong("has several arrays and none is the active scalars, must have one: " + names);
  const bool of_cells = std::ranges::any_of(file.arrays(), [](const VtkArray& array) { return array.section == "CellData"; });
  return file.Wrong(of_cells ? "its samples belong to cells (CellData), must belong to points; ParaView's filter Cell Data to Point "
                               "Data makes them so"
                             : "has no samples of points (PointData)");
}

struct ImageFile {
  VtkXmlFile file;
  VtkArray array;
  RawHeader header;

  std::int64_t samples() const { return header.sample_bytes() / std::int64_t(BytesPerSample(header.type)); }
};

Result<ImageFile> OpenImage(const std::string& path, const ReadOptions& options) {
  Result<VtkXmlFile> file = VtkXmlFile::Open(path, "ImageData");
  if (!file.ok()) return file.status();
  Result<RawHeader> header = HeaderOf(*file, path, options);
  if (!header.ok()) return header.status();
  Result<VtkArray> array = ChooseArray(*file);
  if (!array.ok()) return array.status();
  const Result<VtkArrayType> type = file->TypeOf(*array, kMaxComponents);
  if (!type.ok()) return type.status();
  header->type = type->type;
  header->components = type->components;
  return ImageFile{*std::move(file), *std::move(array), *std::move(header)};
}

Result<LocatedSamples> Locate(const std::string& path, const ReadOptions& options) {
  Result<ImageFile> image = OpenImage(path, options);
  if (!image.ok()) return image.status();
  const auto plain = image->file.FindPlainSamples(image->array, image->header.type, image->samples());
  if (!plain.ok()) return plain.status();
  return LocatedSamples{std::move(image->header), {.file = path, .offset = plain->begin, .big_endian = plain->big_endian}};
}

// Samples of any encoding, also those that `Locate` finds.
Result<RawVolume> Read(const std::string& path, const ReadOptions& options) {
  const Result<ImageFile> image = OpenImage(path, options);
  if (!image.ok()) return image.status();
  const auto& [file, array, header] = *image;
  if (Status status = file.CheckHolds(array, header.type, image->samples()); !status.ok()) return status;
  Result<RawVolume> raw = TakeMemory(path, header, options);
  if (!raw.ok() || options.headers_only) return raw;
  if (Status status = file.ReadSamples(array, header.type, raw->bytes); !status.ok()) return status;
  return raw;
}

// Appended raw and not compressed: what every reader takes, and the quickest to write.
Status Write(const FileSamples& samples, const std::string& path) {
  const auto& [size, spacing, orientation] = samples.geometry();
  const auto& axes = orientation.axes;
  const std::string extent = fmt::format("0 {} 0 {} 0 {}", size.x - 1, size.y - 1, size.z - 1);
  std::string header = fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
      "  <ImageData WholeExtent=\"{0}\" Origin=\"{1}\" Spacing=\"{2}\" Direction=\"{3} {4} {5}\">\n"
      "    <Piece Extent=\"{0}\">\n"
      "      <PointData Scalars=\"values\">\n"
      "        <DataArray type=\"{6}\" Name=\"values\" format=\"appended\" offset=\"0\"/>\n"
      "      </PointData>\n"
      "    </Piece>\n"
      "  </ImageData>\n"
      "  <AppendedData encoding=\"raw\">\n"
      "_",
      extent, slabstream::Numbers(orientation.origin), slabstream::Numbers(spacing), slabstream::Numbers({axes[0].x, axes[1].x, axes[2].x}),
      slabstream::Numbers({axes[0].y, axes[1].y, axes[2].y}), slabstream::Numbers({axes[0].z, axes[1].z, axes[2].z}),
      VtkTypeName(samples.type()));
  const auto bytes = std::uint64_t(samples.bytes());
  header.append(reinterpret_cast<const char*>(&bytes), sizeof bytes);
  Result<OutputFile> file = OutputFile::Create(path);
  if (!file.ok()) return file.status();
  file->Append(header);
  AppendSamples(*file, samples);
  file->Append(std::string("\n  </AppendedData>\n</VTKFile>\n"));
  return file->Finish();
}

}  // namespace

VolumeFormat VtkImage() {
  return {.name = "VTK image",
          .endings = {".vti"},
          .options = {"channel"},
          .locate = Locate,
          .read = Read,
          .written_endings = {".vti"},
          .write = Write,
          .keeps = {.patient = false, .units = {}}};
}

}  // namespace slabstream
