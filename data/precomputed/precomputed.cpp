// Neuroglancer's precomputed volumes in folders as sources: the volume that an info file describes.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "common/base/printable.h"
#include "data/metadata/json_fields.h"
#include "data/metadata/open_store_for.h"
#include "data/precomputed/precomputed_array.h"
#include "data/volume_io/chosen_channel.h"
#include "data/volume_io/formats.h"

namespace slabstream {
namespace precomputed {
namespace {

using metadata::Field;

constexpr std::uint64_t kMostScales = 64, kMostChannels = 4096;
constexpr const char* kInfo = "info";

// A folder with an info file that names scales, or says that it is such a volume.
bool Recognises(const std::string& path, const ReadOptions&) {
  std::error_code error;
  const std::string info = (std::filesystem::path(path) / kInfo).string();
  if (!std::filesystem::is_regular_file(info, error)) return false;
  constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 20;
  const Result<Bytes> bytes = ReadNow(*FolderStore(path, Links::kMayLeadOut), kInfo, kMostBytes);
  if (!bytes.ok()) return false;
  const std::string_view text(reinterpret_cast<const char*>(bytes->span().data()), bytes->size());
  return text.find("\"scales\"") != std::string_view::npos || text.find("neuroglancer_multiscale_volume") != std::string_view::npos;
}

// A list of three numbers, which `Take` reads one by one.
template <class T, class Take>
Status TakeTriple(const Field& list, std::array<T, 3>& triple, Take&& take) {
  if (!list.is_array() || list.size() != 3) return list.Wrong("a list of 3 numbers");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (Status status = take(list[axis], triple[axis]); !status.ok()) return status;
  }
  return Status::Ok();
}

Status TakeCount(const Field& field, std::uint64_t& count) {
  const Result<std::uint64_t> whole = field.Whole(1, metadata::kMostElements);
  if (whole.ok()) count = *whole;
  return whole.status();
}

Status TakeOffset(const Field& field, std::int64_t& offset) {
  const Result<double> number = field.Number();
  if (!number.ok()) return number.status();
  if (*number != std::floor(*number) || std::abs(*number) > double(metadata::kMostElements)) return field.Wrong("a whole number");
  offset = std::int64_t(*number);
  return Status::Ok();
}

Status TakeResolution(const Field& field, double& resolution) {
  const Result<double> number = field.Number();
  if (!number.ok()) return number.status();
  if (!(*number > 0)) return field.Wrong("above 0");
  resolution = *number;
  return Status::Ok();
}

Status TakeEncoding(const Field& field, SampleType type, std::uint64_t channels, Scale& scale) {
  const Field encoding = field["encoding"], block = field["compressed_segmentation_block_size"];
  const Result<std::string> name = encoding.Text();
  if (!name.ok()) return name.status();
  if (*name == "raw") {
    scale.encoding = Encoding::kRaw;
  } else if (*name == "jpeg") {
    scale.encoding = Encoding::kJpeg;
    if (type != SampleType::kUint8 || (channels != 1 && channels != 3))
      return encoding.Wrong("raw, since jpeg holds 1 or 3 channels of uint8");
  } else if (*name == "compressed_segmentation") {
    scale.encoding = Encoding::kSegmentation;
    if (type != SampleType::kUint32 && type != SampleType::kUint64) return encoding.Wrong("raw or jpeg, since labels are uint32 or uint64");
    if (Status status = TakeTriple(block, scale.block, TakeCount); !status.ok()) return status;
  } else {
    return encoding.Wrong("a supported encoding: raw, jpeg or compressed_segmentation");
  }
  return Status::Ok();
}

Result<Scale> ParseScale(const Field& field, SampleType type, std::uint64_t channels) {
  Scale scale;
  const Result<std::string> key = field["key"].Text();
  if (!key.ok()) return key.status();
  scale.key = *key;
  if (Status status = TakeTriple(field["size"], scale.size, TakeCount); !status.ok()) return status;
  if (Status status = TakeTriple(field["chunk_sizes"][std::size_t{0}], scale.chunk, TakeCount); !status.ok()) return status;
  if (Status status = TakeTriple(field["resolution"], scale.resolution, TakeResolution); !status.ok()) return status;
  if (field["voxel_offset"].given()) {
    if (Status status = TakeTriple(field["voxel_offset"], scale.offset, TakeOffset); !status.ok()) return status;
  }
  if (field["sharding"].given()) {
    const Result<Sharding> sharding = ParseSharding(field["sharding"]);
    if (!sharding.ok()) return sharding.status();
    scale.sharding = *sharding;
  }
  if (Status status = TakeEncoding(field, type, channels, scale); !status.ok()) return status;
  std::uint64_t bytes = BytesPerSample(type) * channels;
  for (const std::uint64_t along : scale.chunk) {
    if (along > kMostChunkBytes / bytes) {
      return Printable(Status::ResourceExhausted(
          fmt::format("{}: scale '{}' has chunks of more than {} bytes", field.object(), scale.key, kMostChunkBytes)));
    }
    bytes *= along;
  }
  return scale;
}

// Errors of VolumeFormat::open.
Result<Pyramid> OpenPyramid(const std::shared_ptr<Store>& store, const ReadOptions& options, const SourceContext& context) {
  const std::string object = store->name() + "/" + kInfo;
  const Result<std::optional<Json>> json = metadata::ReadJson(*store, kInfo);
  if (!json.ok()) return json.status();
  if (!json->has_value()) return Status::NotFound(object + ": does not exist");
  const Field info(object, **json);
  if (!info.is_object()) return info.Wrong("an object");
  if (info["@type"].given() && info["@type"].value() != "neuroglancer_multiscale_volume") {
    return info["@type"].Wrong("\"neuroglancer_multiscale_volume\"");
  }
  const Result<std::string> type_name = info["data_type"].Text();
  if (!type_name.ok()) return type_name.status();
  const std::optional<SampleType> type = SampleTypeNamed(*type_name);
  if (!type) return info["data_type"].Wrong("one of " + SampleTypeNames());
  const Result<std::uint64_t> channels = info["num_channels"].Whole(1, kMostChannels);
  if (!channels.ok()) return channels.status();
  const std::vector<FieldInfo> fields(*channels);
  const Result<int> channel = ChosenChannel(store->name(), fields, options);
  if (!channel.ok()) return channel.status();
  const Field scales = info["scales"];
  if (!scales.is_array() || scales.size() < 1 || scales.size() > kMostScales) {
    return scales.Wrong(fmt::format("a list of 1 to {} scales", kMostScales));
  }

  Pyramid pyramid{.info = {.format = "Neuroglancer precomputed", .files = {object}, .folder = store->name()}};
  pyramid.info.labels = info["type"].given() && info["type"].value() == "segmentation";
  if (*channels > 1) pyramid.info.channels = fields;
  pyramid.info.channel = *channel;
  pyramid.orientation.world = World::kScene;
  pyramid.orientation.unit = LengthUnit::kNanometre;
  for (std::size_t i = 0; i < scales.size(); ++i) {
    const Result<Scale> scale = ParseScale(scales[i], *type, *channels);
    if (!scale.ok()) return scale.status();
    PyramidLevel level{.array = MakeArray(store, *scale, *type, *channels, context),
                       .axes = {3, 2, 1},
                       .at = {std::uint64_t(*channel), 0, 0, 0},
                       .channel_axis = 0};
    for (int axis = 0; axis < 3; ++axis) {
      const auto at = std::size_t(axis);
      level.spacing[axis] = scale->resolution[at];
      // A voxel fills the space from its number to the next one.
      level.origin[axis] = (double(scale->offset[at]) + 0.5) * scale->resolution[at];
    }
    pyramid.levels.push_back(std::move(level));
  }
  return pyramid;
}

}  // namespace
}  // namespace precomputed

VolumeFormat Precomputed() {
  return {.name = "Neuroglancer precomputed",
          .recognises = precomputed::Recognises,
          .options = {"channel", "follow-links"},
          .markers = {precomputed::kInfo},
          .open = OpenInStore<precomputed::OpenPyramid>};
}

}  // namespace slabstream
