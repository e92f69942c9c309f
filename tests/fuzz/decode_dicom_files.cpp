// DICOM files, as far as they are read without their pixels: elements, images, series, stacks. Compressed pixels are GDCM's business, in
// processes of their own.
//
// input: the file
#include <algorithm>
#include <cmath>

#include "data/volume_io/dicom_series.h"
#include "tests/data/volume_io/dicom_files.h"
#include "tests/fuzz/decoders.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

std::string DicomPath() {
  static const TemporaryDirectory directory{PlaceOfFuzzFiles()};
  return directory / "image";
}

void CheckSound(const DicomSeries& series, std::int64_t file_bytes) {
  for (const DicomImage& image : series.images) {
    CHECK(!image.frames.empty() && image.frames.size() <= std::size_t{kMaxVolumeSide});
    CHECK(image.pixels.offset >= 0 && image.pixels.bytes >= 0);
    CHECK(image.pixels.deflated_at > 0 || image.pixels.offset + image.pixels.bytes <= file_bytes);
    for (const DicomFrame& frame : image.frames) CHECK_EQ(frame.distinctions.size(), DistinctionCount());
    if (!series.trouble.ok() || !image.pixels.encapsulated) continue;
    const auto fragments = ListFragments(image.path, image.pixels);
    if (!fragments.ok()) {
      CheckRefusal(fragments.status());
      continue;
    }
    for (const auto& [offset, bytes] : *fragments) CHECK(offset > 0 && bytes >= 0 && offset + bytes <= file_bytes);
  }
  if (!series.trouble.ok()) return CheckRefusal(series.trouble);
  const DicomStack& stack = series.stack;
  if (stack.places.empty()) {
    CHECK_EQ(std::size_t(stack.size.z) * std::size_t(stack.times.count), series.frame_count());
    std::vector<std::size_t> order = stack.order;
    std::ranges::sort(order);
    for (std::size_t i = 0; i < order.size(); ++i) CHECK_EQ(order[i], i);
  } else {
    CHECK_EQ(stack.places.size(), series.frame_count());
    for (const std::int32_t z : stack.places) CHECK(z >= 0 && z < stack.size.z);
  }
  for (const Vec3& step : stack.steps) CHECK(std::isfinite(Length(step)));
}

}  // namespace

bool DecodeDicomFile(std::span<const std::byte> bytes) {
  WriteFile(DicomPath(), FileBytes(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  const Result<std::vector<DicomSeries>> all = ListDicomSeries(DicomPath());
  if (!all.ok()) {
    CheckRefusal(all.status());
    return false;
  }
  for (const DicomSeries& series : *all) CheckSound(series, std::int64_t(bytes.size()));
  const Result<const DicomSeries*> chosen = ChooseSeries(*all, "", DicomPath());
  if (!chosen.ok()) CheckRefusal(chosen.status());
  return chosen.ok() && (*chosen)->trouble.ok();
}

std::vector<FuzzBytes> DicomFileSeeds() {
  std::vector<FuzzBytes> seeds;
  for (const DicomSyntax syntax : {DicomSyntax::kImplicit, DicomSyntax::kExplicit, DicomSyntax::kBigEndian, DicomSyntax::kRle}) {
    DicomSpec spec{.pixels = FileBytes(3 * 24, 'x'), .syntax = syntax};
    spec.values.erase(kTagPosition);
    spec.values[kTagFrames] = "3";
    for (int z = 0; z < 3; ++z) {
      spec.per_frame.push_back({{0x00209113, {{kTagPosition, "0\\0\\" + std::to_string(z)}}}, {0x00289145, {{kTagSlope, "2"}}}});
    }
    WriteDicom(DicomPath(), spec);
    seeds.push_back(FuzzSeed().Put(std::string_view(ReadFile(DicomPath()))).bytes());
  }
  // Without a preamble; and as a segmentation.
  DicomSpec spec{.pixels = FileBytes(2 * 24, 'x')};
  spec.values.erase(kTagPosition);
  spec.values[kTagFrames] = "2";
  spec.per_frame = {{{0x00209113, {{kTagPosition, "0\\0\\0"}}}, {0x0062000a, {{0x0062000b, "1"}}}},
                    {{0x00209113, {{kTagPosition, "0\\0\\6"}}}, {0x0062000a, {{0x0062000b, "1"}}}}};
  WriteDicom(DicomPath(), spec);
  seeds.push_back(FuzzSeed().Put(std::string_view(ReadFile(DicomPath())).substr(132)).bytes());
  spec.values.merge(DicomValues{{0x00620001, "BINARY"}, {0x00180088, "2"}});
  for (const auto& [tag, value] : PixelValues(SampleType::kUint8)) spec.values[tag] = value;
  spec.sequences = {{0x00620002, {{{0x00620004, "1"}}}}};
  spec.pixels.resize(24);
  WriteDicom(DicomPath(), spec);
  seeds.push_back(FuzzSeed().Put(std::string_view(ReadFile(DicomPath()))).bytes());
  return seeds;
}

}  // namespace slabstream
