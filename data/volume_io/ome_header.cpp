#include "data/volume_io/ome_header.h"

#include <fmt/format.h>

#include <string_view>
#include <utility>

#include "common/text/parse_number.h"
#include "data/volume_io/chosen_channel.h"
#include "data/volume_io/read_options.h"
#include "data/volume_io/stated_field.h"

namespace slabstream {
namespace {

// A tag's name may have the prefix of its namespace.
std::string_view NameOf(const XmlTag& tag) { return std::string_view(tag.name).substr(tag.name.find(':') + 1); }

class OmeReader {
 public:
  OmeReader(const std::string& description, std::size_t image) : description_(description), image_(image) {}

  Result<OmeHeader> Read(const std::string& path) {
    const XmlEvents events{[this](const XmlTag& tag) {
                             OnStart(tag);
                             return true;
                           },
                           [this](const XmlTag& tag) { OnEnd(tag); }};
    Status status = ReadXml(description_, events);
    if (status.ok() && !wrong_.empty()) status = Status::InvalidArgument(wrong_);
    if (!status.ok()) return Status::InvalidArgument(path + ": its OME description: " + status.message());
    return std::move(ome_);
  }

 private:
  void OnStart(const XmlTag& tag) {
    const std::string_view name = NameOf(tag);
    if (name == "OME") ome_.uuid = tag.Attribute("UUID");
    if (name == "BinaryOnly") ome_.metadata_file = tag.Attribute("MetadataFile");
    if (name == "Image") ome_.images.push_back(tag.Attribute("Name"));
    if (name.starts_with("ModuloAlong")) ome_.modulo = true;
    if (ome_.images.size() != image_ + 1) return;
    if (name == "Pixels") ome_.pixels = tag;
    if (name == "Channel" && ome_.channels.size() < kMostChannels) {
      ome_.channels.push_back({.name = tag.Attribute("Name")});
      // Red, green, blue and alpha of eight bits each.
      const std::optional<std::int32_t> color = ParseNumber<std::int32_t>(tag.Attribute("Color"));
      if (color) ome_.channels.back().color = ColorOfBits(std::uint32_t(*color) >> 8);
    }
    if (name == "TiffData") {
      // Without an IFD, all pages of a file.
      const std::int64_t count = Number(tag, "NumPlanes", tag.Attribute("IFD").empty() ? 0 : 1);
      ome_.tiff_data.push_back({.slice = Number(tag, "FirstZ", 0),
                                .channel = Number(tag, "FirstC", 0),
                                .time = Number(tag, "FirstT", 0),
                                .page = Number(tag, "IFD", 0),
                                .count = Number(tag, "PlaneCount", count)});
    }
    if (name == "UUID" && !ome_.tiff_data.empty()) {
      ome_.tiff_data.back().file_name = tag.Attribute("FileName");
      text_begin_ = tag.end;
    }
  }

  void OnEnd(const XmlTag& tag) {
    if (NameOf(tag) != "UUID" || text_begin_ == 0 || tag.begin < text_begin_) return;
    std::string text = description_.substr(std::size_t(text_begin_), std::size_t(tag.begin - text_begin_));
    std::erase_if(text, [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; });
    ome_.tiff_data.back().uuid = std::move(text);
    text_begin_ = 0;
  }

  std::int64_t Number(const XmlTag& tag, const std::string& key, std::int64_t if_absent) {
    const std::string text = tag.Attribute(key);
    if (text.empty()) return if_absent;
    const std::optional<std::int64_t> number = ParseNumber<std::int64_t>(text);
    if (number && *number >= 0 && *number <= kMaxVolumes) return *number;
    if (wrong_.empty()) wrong_ = fmt::format("{} of a TiffData is '{}', must be in [0, {}]", key, text, kMaxVolumes);
    return if_absent;
  }

  const std::string& description_;
  const std::size_t image_;
  OmeHeader ome_;
  std::int64_t text_begin_ = 0;  // of a UUID that has not ended; 0: there is none
  std::string wrong_;
};

}  // namespace

bool IsOmeHeader(const std::string& description) {
  return description.find("<OME") != std::string::npos || description.find(":OME ") != std::string::npos;
}

Result<OmeHeader> ReadOmeHeader(const std::string& path, const std::string& description, std::size_t image) {
  return OmeReader(description, image).Read(path);
}

}  // namespace slabstream
