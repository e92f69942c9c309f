// Headers of PNG and EXR files, and the records in them.
//
// input: u8 kind, a picture's file or a record
#include "client/pictures/picture_header.h"
#include "client/request/picture_record.h"
#include "common/files/files.h"
#include "tests/fuzz/decoders.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

const TemporaryDirectory& PictureFolder() {
  static const TemporaryDirectory folder(PlaceOfFuzzFiles());
  return folder;
}

bool DecodeRecord(std::string_view text) {
  const Result<PictureRecord> record = ParseRecord(text);
  if (!record.ok()) {
    CheckRefusal(record.status());
    return false;
  }
  CHECK(RenderArguments(*record, "a.png").size() >= 4);
  const Result<PictureRecord> again = ParseRecord(RecordText(record->source, record->request, record->format, {}));
  CHECK(again.ok()) << again.status().message();
  CHECK(again->request == record->request);
  CHECK(again->format.annotations == record->format.annotations);
  return true;
}

}  // namespace

bool DecodePicture(std::span<const std::byte> bytes) {
  FuzzInput input(bytes);
  if (input.Take<std::uint8_t>() % 2 == 0) return DecodeRecord(input.Text());
  const std::string path = PictureFolder() / "picture.png";
  CHECK(WriteTextFile(path, std::string(input.Text())).ok());
  const Result<PictureHeader> header = ReadPictureHeader(path);
  if (!header.ok()) {
    CheckRefusal(header.status());
    return false;
  }
  CHECK(header->width > 0 && header->height > 0 && !header->channels.empty());
  return true;
}

std::vector<FuzzBytes> PictureSeeds() {
  FrameRequest request;
  request.dataset = "brain";
  request.view = {Projection::kPerspective, 30, 20};
  request.transfer.choice = TransferFunction{.colors = {{0, {1, 0.5F, 0}}}, .opacities = {{0, 0}, {1, 0.5}}};
  const PictureFormat format{.png_bits = 16, .annotations = {.scale_bar = true, .title = "A title"}};
  PictureNotes notes;
  notes.geometry.unit = LengthUnit::kMillimetre;
  notes.record = RecordText("brain.nii.gz", request, format, notes.geometry);
  std::vector<FuzzBytes> seeds = {FuzzSeed().Put(std::uint8_t{0}).Put(std::string_view(notes.record)).bytes()};
  const TemporaryDirectory folder(PlaceOfFuzzFiles());
  for (const std::string name : {"a.png", "a.exr"}) {
    CHECK(WritePicture(MakeLocalImage(PixelFormat::kDepth, {0, 0, 3, 2}), {3, 2}, folder / name, {}, notes).ok());
    seeds.push_back(FuzzSeed().Put(std::uint8_t{1}).Put(ReadTextFile(folder / name, 1 << 20).value()).bytes());
  }
  return seeds;
}

}  // namespace slabstream
