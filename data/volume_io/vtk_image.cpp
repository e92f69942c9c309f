// Structured grids in VTK's XML files (vtk_xml.h): image data (.vti) and rectilinear grids (.vtr). Values belong to points or cells;
// pieces are put together.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "data/volume_io/formats.h"
#include "data/volume_io/output.h"
#include "data/volume_io/structured_grid.h"
#include "data/volume_io/text_header.h"
#include "data/volume_io/vtk_extent.h"
#include "data/volume_io/vtk_image.h"
#include "data/volume_io/vtk_xml.h"

namespace slabstream {
namespace {

constexpr std::string_view kImage = "ImageData", kRectilinear = "RectilinearGrid";
// Of the formats.
constexpr std::string_view kImageName = "VTK image", kRectilinearName = "VTK rectilinear grid";

using Extent = PointExtent;

struct Piece {
  std::size_t number = 0;  // in the file
  Extent extent;
};

// The pieces that hold anything.
Result<std::vector<Piece>> PiecesOf(const VtkXmlFile& file) {
  std::vector<Piece> pieces;
  for (std::size_t i = 0; i < file.pieces().size(); ++i) {
    const Result<Extent> extent = ExtentOf(file, file.pieces()[i], "Extent");
    if (!extent.ok()) return extent.status();
    if (!extent->empty()) pieces.push_back({i, *extent});
  }
  return pieces.empty() ? file.Wrong("has no piece with a point in it") : Result(std::move(pieces));
}

// The smallest that holds all pieces.
Extent BoundsOf(const std::vector<Piece>& pieces) {
  Extent bounds = pieces.front().extent;
  for (const Piece& piece : pieces) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      bounds.begin[axis] = std::min(bounds.begin[axis], piece.extent.begin[axis]);
      bounds.end[axis] = std::max(bounds.end[axis], piece.extent.end[axis]);
    }
  }
  return bounds;
}

Result<PointGrid> ImageGrid(const VtkXmlFile& file, const Extent& bounds) {
  const auto origin = file.Numbers(file.dataset(), "Origin", 3, {0, 0, 0}), spacing = file.Numbers(file.dataset(), "Spacing", 3, {1, 1, 1});
  const auto direction = file.Numbers(file.dataset(), "Direction", 9, {1, 0, 0, 0, 1, 0, 0, 0, 1});
  for (const auto* numbers : {&origin, &spacing, &direction}) {
    if (!numbers->ok()) return numbers->status();
  }
  PointGrid grid{.origin = {(*origin)[0], (*origin)[1], (*origin)[2]}, .matrix = "Direction"};
  for (std::size_t i = 0; i < 3; ++i) {
    grid.points[i] = double(bounds.Points(i));
    grid.steps[i] = (*spacing)[i] * Vec3{(*direction)[i], (*direction)[3 + i], (*direction)[6 + i]};
    grid.origin = grid.origin + double(bounds.begin[i]) * grid.steps[i];
  }
  return grid;
}

using Coordinates = std::array<std::vector<double>, 3>;

// Sets those of the points of a piece, which has them along x, y and z in this order.
Status AddCoordinates(const VtkXmlFile& file, const Piece& piece, const Extent& bounds, Coordinates& coordinates) {
  std::size_t axis = 0;
  for (const VtkArray& array : file.arrays()) {
    if (array.piece != piece.number || array.section != "Coordinates" || axis == 3) continue;
    const Result<VtkArrayType> type = file.TypeOf(array, 1);
    if (!type.ok()) return type.status();
    const auto numbers = file.ReadNumbers<double>(array, type->type, piece.extent.Points(axis));
    if (!numbers.ok()) return numbers.status();
    std::ranges::copy(*numbers, coordinates[axis].begin() + (piece.extent.begin[axis] - bounds.begin[axis]));
    ++axis;
  }
  return axis == 3 ? Status::Ok() : file.Wrong(fmt::format("has coordinates along {} axes, must have 3", axis));
}

// The same of a piece of a parallel file.
Status AddCoordinatesOfFile(const VtkXmlFile& file, const Piece& piece, const Extent& bounds, Coordinates& coordinates) {
  const Result<std::string> source = file.SourceOf(piece.number);
  if (!source.ok()) return source.status();
  const Result<VtkXmlFile> its_file = VtkXmlFile::Open(*source, kRectilinear, {.describe = true});
  if (!its_file.ok()) return its_file.status();
  const Result<std::vector<Piece>> pieces = PiecesOf(*its_file);
  if (!pieces.ok()) return pieces.status();
  if (BoundsOf(*pieces) != piece.extent) return its_file->Wrong("has another Extent than the file that names it says");
  for (const Piece& each : *pieces) {
    if (Status status = AddCoordinates(*its_file, each, bounds, coordinates); !status.ok()) return status;
  }
  return Status::Ok();
}

Result<PointGrid> RectilinearGrid(const VtkXmlFile& file, const std::vector<Piece>& pieces, const Extent& bounds) {
  Coordinates coordinates;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    constexpr std::int64_t kMost = kMaxVolumeSide + 1;  // around kMaxVolumeSide cells
    if (const std::int64_t points = bounds.Points(axis); points > kMost) {
      return file.Wrong(fmt::format("has {} points along an axis, must have at most {}", points, kMost));
    }
    coordinates[axis].resize(std::size_t(bounds.Points(axis)), std::numeric_limits<double>::quiet_NaN());
  }
  for (const Piece& piece : pieces) {
    const Status status = (file.parallel() ? AddCoordinatesOfFile : AddCoordinates)(file, piece, bounds, coordinates);
    if (!status.ok()) return status;
  }
  return GridOfCoordinates(coordinates);
}

// An array of each piece: that of pieces[i] is arrays[i].
struct ImageFile {
  VtkXmlFile file;
  std::vector<Piece> pieces;
  Extent bounds;
  std::string array;                    // its name
  std::vector<const VtkArray*> arrays;  // of a parallel file: none
  ValuesAt at = ValuesAt::kPoints;
  RawHeader header;

  // How many voxels of a piece lie along each axis. A piece that is flat where others are not has no cells.
  std::array<std::int64_t, 3> Voxels(const Piece& piece) const {
    std::array<std::int64_t, 3> voxels{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      voxels[axis] = piece.extent.Points(axis) - (at == ValuesAt::kCells && bounds.Points(axis) > 1 ? 1 : 0);
    }
    return voxels;
  }
  std::int64_t Samples(const Piece& piece) const {
    const auto [x, y, z] = Voxels(piece);
    return x * y * z * header.components;
  }
};

Status FindArrays(ImageFile& image, const std::string& path, const ReadOptions& options) {
  const VtkXmlFile& file = image.file;
  const OfferedArrays offered = file.Offered();
  const Result<std::size_t> chosen = ChooseArray(path, offered.arrays, options.array);
  if (!chosen.ok()) return chosen.status();
  const VtkArray& first = file.arrays()[offered.numbers[*chosen]];
  const Result<VtkArrayType> type = file.TypeOf(first, kMaxComponents);
  if (!type.ok()) return type.status();
  image.array = first.name();
  image.at = offered.arrays[*chosen].at;
  image.header.notes = NotesOf(offered.arrays, *chosen);
  image.header.type = type->type;
  image.header.components = type->components;
  if (file.parallel()) return Status::Ok();  // its pieces' files have the arrays
  for (const Piece& piece : image.pieces) {
    const Result<const VtkArray*> array = file.FindLike(piece.number, first);
    if (!array.ok()) return array.status();
    image.arrays.push_back(*array);
  }
  return Status::Ok();
}

Result<std::shared_ptr<ImageFile>> OpenImage(const std::string& path, std::string_view kind, const ReadOptions& options) {
  Result<VtkXmlFile> file = VtkXmlFile::Open(path, kind, options);
  if (!file.ok()) return file.status();
  Result<std::vector<Piece>> pieces = PiecesOf(*file);
  if (!pieces.ok()) return pieces.status();
  const auto image = std::make_shared<ImageFile>(ImageFile{*std::move(file), *std::move(pieces)});  // which arrays are part of
  image->bounds = BoundsOf(image->pieces);
  const Result<PointGrid> grid =
      kind.ends_with(kImage) ? ImageGrid(image->file, image->bounds) : RectilinearGrid(image->file, image->pieces, image->bounds);
  if (!grid.ok()) return grid.status();
  if (Status status = FindArrays(*image, path, options); !status.ok()) return status;
  if (Status status = SetGrid(image->header, path, *grid, image->at); !status.ok()) return status;
  image->header.times = image->file.times();
  image->header.number = image->file.time();
  return image;
}

// The voxels of pieces that meet at their points are the same ones.
Status ReadPieces(const ImageFile& image, const std::string& path, AlignedVector<std::byte>& out) {
  const RawHeader& header = image.header;
  const std::size_t voxel_bytes = BytesPerSample(header.type) * std::size_t(header.components);
  std::vector<bool> read(CountIn(header.size));
  for (std::size_t i = 0; i < image.pieces.size(); ++i) {
    const Extent& extent = image.pieces[i].extent;
    if (image.Samples(image.pieces[i]) == 0) continue;
    const std::size_t piece_bytes = std::size_t(image.Samples(image.pieces[i])) * BytesPerSample(header.type);
    if (Status status = CheckFitsMemory(std::int64_t(piece_bytes), path + ": a piece of it"); !status.ok()) return status;
    AlignedVector<std::byte> bytes(piece_bytes);
    if (Status status = image.file.ReadSamples(*image.arrays[i], header.type, bytes); !status.ok()) return status;
    const auto [row, columns, slices] = image.Voxels(image.pieces[i]);
    for (std::int64_t j = 0; j < columns * slices; ++j) {
      const std::int64_t x = extent.begin[0] - image.bounds.begin[0], y = extent.begin[1] - image.bounds.begin[1] + j % columns,
                         z = extent.begin[2] - image.bounds.begin[2] + j / columns;
      const std::int64_t to = (z * header.size.y + y) * header.size.x + x;
      std::memcpy(out.data() + std::size_t(to) * voxel_bytes, bytes.data() + std::size_t(j * row) * voxel_bytes,
                  std::size_t(row) * voxel_bytes);
      std::fill_n(read.begin() + to, row, true);
    }
  }
  const auto there = std::ranges::count(read, true);
  if (std::size_t(there) == read.size()) return Status::Ok();
  return image.file.Wrong(fmt::format("its pieces hold {} of the {} voxels between them", there, read.size()));
}

template <const std::string_view& kKind>
Result<LocatedSamples> Locate(const std::string& path, const ReadOptions& options) {
  const auto image = OpenImage(path, kKind, options);
  if (!image.ok()) return image.status();
  const auto& [file, pieces, bounds, array, arrays, at, header] = **image;
  if (pieces.size() > 1 || file.times().count > 1) return file.Wrong("its samples lie in several pieces, or are of several times");
  Result<LocatedSamples> located = file.Locate(*arrays[0], header.type, (*image)->Samples(pieces[0]));
  if (located.ok()) located->header = header;
  return located;
}

// Samples of any encoding, also those that `Locate` finds.
template <const std::string_view& kKind>
Result<RawVolume> Read(const std::string& path, const ReadOptions& options) {
  const auto image = OpenImage(path, kKind, options);
  if (!image.ok()) return image.status();
  const auto& [file, pieces, bounds, array, arrays, at, header] = **image;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (Status status = file.CheckHolds(*arrays[i], header.type, (*image)->Samples(pieces[i])); !status.ok()) return status;
  }
  Result<RawVolume> raw = TakeMemory(path, header, options);
  if (!raw.ok() || options.headers_only) return raw;
  const Status status = pieces.size() == 1 ? file.ReadSamples(*arrays[0], header.type, raw->bytes) : ReadPieces(**image, path, raw->bytes);
  return status.ok() ? std::move(raw) : status;
}

// Appended raw and not compressed: what every reader takes, and the quickest to write.
Status Write(const FileSamples& samples, const std::string& path) {
  const auto& [size, spacing, orientation, stretch] = samples.geometry();
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

Result<ParallelImage> ReadParallelImage(const std::string& path, std::string_view type, const ReadOptions& options) {
  const auto image = OpenImage(path, type, options);
  if (!image.ok()) return image.status();
  ParallelImage parallel{(*image)->header, (*image)->array, type.ends_with(kImage) ? kImageName : kRectilinearName, {}};
  if (!(*image)->file.parallel()) {
    parallel.pieces.push_back({path, {{}, parallel.header.size}});
    return parallel;
  }
  for (const Piece& piece : (*image)->pieces) {
    const auto size = (*image)->Voxels(piece);
    if (size[0] * size[1] * size[2] == 0) continue;
    Result<std::string> file = (*image)->file.SourceOf(piece.number);
    if (!file.ok()) return file.status();
    Box box;
    for (int axis = 0; axis < 3; ++axis) {
      box.begin[axis] = std::int32_t(piece.extent.begin[std::size_t(axis)] - (*image)->bounds.begin[std::size_t(axis)]);
      box.end[axis] = box.begin[axis] + std::int32_t(size[std::size_t(axis)]);
    }
    parallel.pieces.push_back({*std::move(file), box});
  }
  return parallel;
}

VolumeFormat VtkImage() {
  return {.name = kImageName,
          .endings = {".vti"},
          .options = {"time", "channel", "array"},
          .locate = Locate<kImage>,
          .read = Read<kImage>,
          .written_endings = {".vti"},
          .write = Write,
          .keeps = {.patient = false, .units = {}}};
}

VolumeFormat VtkRectilinear() {
  return {.name = kRectilinearName,
          .endings = {".vtr"},
          .options = {"time", "channel", "array", "resample"},
          .locate = Locate<kRectilinear>,
          .read = Read<kRectilinear>};
}

}  // namespace slabstream
