// Metadata, shards and chunks of Zarr, from a store in memory.
//
// input: u8 kind (0: an array of version 2, 1: of 3, 2: an image of version 2, 3: of 3), u16 length, the metadata of the root; of an image
// also u16 length, the metadata of every array below it; the bytes of every other object
#include <algorithm>

#include "data/zarr/zarr_pyramid.h"
#include "tests/data/volume_io/volume_files.h"
#include "tests/data/zarr/read_zarr.h"
#include "tests/data/zarr/zarr_files.h"
#include "tests/fuzz/decoders.h"
#include "tests/support/temporary_directory.h"

namespace slabstream {
namespace {

class FuzzStore : public Store {
 public:
  FuzzStore(bool version2, bool image, std::string root, std::string below, std::string other)
      : root_key_(version2 ? image ? ".zattrs" : ".zarray" : "zarr.json"),
        below_key_(version2 ? "/.zarray" : "/zarr.json"),
        root_(std::move(root)),
        below_(std::move(below)),
        other_(std::move(other)) {}

  void Read(const std::string& key, const ByteRange& range, std::uint64_t most, Done done, StillWanted /*wanted*/) override {
    const std::string* object = key == root_key_ ? &root_ : key.ends_with(below_key_) && !below_.empty() ? &below_ : &other_;
    const bool metadata = key.ends_with("json") || key.find(".z") != std::string::npos;
    if (metadata && object == &other_) return done(Status::NotFound(key + ": does not exist"));
    std::string bytes = *object;
    if (range.from_end) {
      bytes = bytes.substr(bytes.size() - std::min<std::uint64_t>(bytes.size(), range.bytes));
    } else {
      bytes = range.begin >= bytes.size() ? "" : bytes.substr(range.begin, range.bytes);
    }
    if (bytes.size() > most) return done(Status::ResourceExhausted(key + ": too long"));
    const auto view = std::as_bytes(std::span(bytes));
    done(Bytes(std::vector<std::byte>(view.begin(), view.end())));
  }
  Result<std::vector<std::string>> List(const std::string&) override { return std::vector<std::string>{"0/", "c"}; }
  const std::string& name() const override { return name_; }

 private:
  const std::string name_ = "store", root_key_, below_key_, root_, below_, other_;
};

void CheckLevel(const PyramidLevel& level) {
  const ArrayShape& shape = level.array->shape();
  const std::size_t axes = shape.size.size();
  CHECK(axes >= 1 && axes <= kMaxArrayAxes);
  CHECK_EQ(shape.chunk.size(), axes);
  CHECK_EQ(level.at.size(), axes);
  CHECK_EQ(shape.fill.size(), BytesPerSample(shape.type));
  std::uint64_t bytes = BytesPerSample(shape.type);
  for (std::size_t i = 0; i < axes; ++i) {
    CHECK(shape.size[i] >= 1 && shape.chunk[i] >= 1);
    CHECK_LE(shape.chunk[i], kMostChunkBytes / bytes);
    bytes *= shape.chunk[i];
    CHECK(level.at[i] < shape.size[i]);
  }
  for (const int axis : level.axes) CHECK(axis >= -1 && axis < int(axes));
  constexpr std::uint64_t kMostRead = 1 << 20;  // so that a run takes no longer
  if (bytes > kMostRead) return;
  for (const bool last : {false, true}) {
    std::vector<std::uint64_t> index(axes);
    for (std::size_t i = 0; i < axes; ++i) index[i] = last ? (shape.size[i] - 1) / shape.chunk[i] : 0;
    const auto chunk = ReadChunkNow(*level.array, index);
    if (!chunk.ok()) CheckRefusal(chunk.status());
    CHECK(!chunk.ok() || !chunk->has_value() || (*chunk)->elements.size() == bytes);
  }
}

}  // namespace

bool DecodeZarr(std::span<const std::byte> bytes) {
  FuzzInput input(bytes);
  const int kind = input.Take<std::uint8_t>() % 4;
  const bool image = kind >= 2;
  const auto take = [&] {
    const std::size_t length = input.Take<std::uint16_t>();
    std::string text(input.Text().substr(0, length));
    input = FuzzInput(input.rest().subspan(text.size()));
    return text;
  };
  std::string root = take(), below = image ? take() : "";
  const auto store = std::make_shared<FuzzStore>(kind % 2 == 0, image, std::move(root), std::move(below), std::string(input.Text()));
  const Result<Pyramid> pyramid = zarr::OpenPyramid(store, {}, TestContext());
  if (!pyramid.ok()) {
    CheckRefusal(pyramid.status());
    return false;
  }
  CHECK(!pyramid->levels.empty());
  for (const PyramidLevel& level : pyramid->levels) CheckLevel(level);
  return true;
}

std::vector<FuzzBytes> ZarrSeeds() {
  const TemporaryDirectory folder(PlaceOfFuzzFiles());
  std::vector<FuzzBytes> seeds;
  const auto text = [](FuzzSeed& seed, const std::string& metadata) {
    seed.Put(std::uint16_t(metadata.size())).Put(std::string_view(metadata));
  };
  const auto zeros = [](std::span<const std::uint64_t> at) { return double(at[0]); };
  int number = 0;
  const auto write = [&](const ZarrSpec& spec) {
    const std::string path = folder / std::to_string(number++);
    WriteZarrArray(path, spec, zeros);
    return ReadFile(path + (spec.version == 2 ? "/0.0.0" : "/c.0.0.0"));
  };
  for (const char* const codec : {"", "zlib", "zstd", "blosc", "lz4"}) {
    const ZarrSpec two{.shape = {4, 4, 4}, .chunk = {4, 4, 2}, .fortran = number % 2 == 0, .codec = codec, .shuffled = number % 2 == 0};
    ZarrSpec three{.version = 3, .shape = {4, 4, 4}, .chunk = {2, 4, 2}, .big_endian = true, .transpose = {2, 0, 1}, .codec = codec};
    three.checked = true;
    three.names = {"y", "z", "x"};
    if (number % 2 == 0) three.shard = {4, 4, 4};
    three.index_at_end = number % 4 == 0;
    FuzzSeed a, b;
    text(a.Put(std::uint8_t{0}), MetadataOf(two).dump());
    text(b.Put(std::uint8_t{1}), MetadataOf(three).dump());
    seeds.push_back(a.Put(std::string_view(write(two))).bytes());
    seeds.push_back(b.Put(std::string_view(write(three))).bytes());
    for (const ZarrSpec& spec : {two, three}) {
      Json axes = Json::array({{{"name", "z"}, {"unit", "nanometer"}}, {{"name", "y"}, {"type", "space"}}, {{"name", "x"}}});
      const Json scale = {{"type", "scale"}, {"scale", {2, 1, 1}}};
      const Json level = {{"path", "0"}, {"coordinateTransformations", {scale}}};
      const Json image = {{"axes", axes}, {"datasets", {level, level}}, {"coordinateTransformations", Json::array({scale})}};
      const Json channel = {{"label", "a"}, {"color", "0000FF"}, {"window", {{"start", 1}, {"end", 9}}}, {"active", false}};
      Json attributes = {{"multiscales", Json::array({image})}, {"omero", {{"channels", Json::array({channel})}}}};
      if (spec.version == 3) {
        attributes = {{"zarr_format", 3}, {"node_type", "group"}, {"attributes", {{"ome", attributes}}}};
      }
      FuzzSeed seed;
      text(seed.Put(std::uint8_t(spec.version == 2 ? 2 : 3)), attributes.dump());
      text(seed, MetadataOf(spec).dump());
      seeds.push_back(seed.Put(std::string_view(write(spec))).bytes());
    }
  }
  return seeds;
}

}  // namespace slabstream
