// Values of the command line: every parser takes every text.
#include <fmt/format.h>

#include "client/cli/turntable_values.h"
#include "client/request/values.h"
#include "client/request/volume_argument.h"
#include "common/cli/parse.h"
#include "common/transport/endpoint.h"
#include "common/wire/validate_request.h"
#include "simulator/model/link_model.h"
#include "tests/fuzz/decoders.h"

namespace slabstream {
namespace {

// The value, if there is one. Texts of a command line may hold line feeds, and messages repeat them.
template <class T>
const T* Taken(const Result<T>& value) {
  if (value.ok()) return &value.value();
  CHECK(value.status().code() == StatusCode::kInvalidArgument || value.status().code() == StatusCode::kNotFound)
      << value.status().message();
  CHECK(!value.status().message().empty());
  return nullptr;
}

bool DecodeSize(const std::string& text) {
  const Result<ImageSize> size = ParseImageSize("--size", text);
  if (Taken(size) == nullptr) return false;
  CHECK(Validate(*size).ok());
  CHECK(*ParseImageSize("--size", fmt::format("{}x{}", size->width, size->height)) == *size);
  return true;
}

bool DecodeDirection(const std::string& text) {
  const Result<Vec3> direction = ParseDirection("--light", text);
  if (Taken(direction) == nullptr) return false;
  CHECK(*ParseDirection("--light", fmt::format("{},{},{}", direction->x, direction->y, direction->z)) == *direction);
  return true;
}

bool DecodeColor(const std::string& text) {
  const Result<StraightColor> color = ParseColor("--background", text);
  if (Taken(color) == nullptr) return false;
  CHECK(*ParseColor("--background", fmt::format("{},{},{},{}", color->r, color->g, color->b, color->a)) == *color);
  return true;
}

bool DecodeNames(const std::string& text) {
  const Result<std::vector<std::string>> names = ParseNames("--channel", text);
  if (Taken(names) != nullptr) CHECK(*ParseNames("--channel", slabstream::TextOf(*names)) == *names);
  const Result<std::vector<NamedText>> named = ParseNamedTexts("--channel-color", text);
  if (Taken(named) != nullptr) {
    for (const auto& [name, value] : *named) CHECK(!name.empty());
  }
  return names.ok() || named.ok();
}

bool DecodePattern(const std::string& text) {
  const Result<FramePattern> pattern = FramePattern::Parse("-o", text);
  if (Taken(pattern) == nullptr) return false;
  CHECK(pattern->Name(3) != pattern->Name(4));
  CHECK_LE(pattern->Name(0).size(), text.size() + 20);
  return true;
}

bool DecodeNumbers(const std::string& text) {
  const Result<double> number = ParseNumber("--zoom", text, {-2, 1e6});
  if (Taken(number) != nullptr) CHECK(*number >= -2 && *number <= 1e6);
  const Result<int> integer = ParseInteger("--groups", text, -3, 1000);
  if (Taken(integer) != nullptr) CHECK(*integer >= -3 && *integer <= 1000);
  return number.ok() || integer.ok();
}

bool DecodeEndpoint(const std::string& text) {
  bool taken = false;
  for (const bool to_bind : {false, true}) {
    const Result<Endpoint> endpoint = ParseEndpoint(text, to_bind);
    if (Taken(endpoint) == nullptr) continue;
    taken = true;
    const Result<Endpoint> again = ParseEndpoint(endpoint->ToString(), to_bind);
    CHECK(again.ok()) << again.status().message();
    CHECK(again->ToString() == endpoint->ToString()) << text;
    CHECK_EQ(again->remote(), endpoint->remote());
  }
  return taken;
}

bool DecodeLink(const std::string& text) {
  const Result<LinkModel> link = ParseLink("--link", text);
  if (Taken(link) == nullptr) return false;
  CHECK(link->bytes_per_second > 0 && link->latency_seconds >= 0);
  return true;
}

bool DecodeVolumeArgument(const std::string& text) {
  const Result<VolumeArgument> volume = ParseVolumeArgument("SOURCE", text, false);
  if (Taken(volume) == nullptr) return false;
  CHECK(text == volume->volume + (volume->transfer ? ":" + volume->transfer_text : ""));
  return volume->transfer.has_value();
}

}  // namespace

bool DecodeValue(std::span<const std::byte> bytes) {
  const std::string text(FuzzInput(bytes).Text());
  bool taken = false;
  // A path of the input would be a file of this machine.
  const bool names_file = text.find_first_of("/.") != std::string::npos;
  for (const auto decode :
       {DecodeSize, DecodeDirection, DecodeColor, DecodeNames, DecodePattern, DecodeNumbers, DecodeEndpoint, DecodeLink})
    taken = decode(text) || taken;
  return (!names_file && DecodeVolumeArgument(text)) || taken;
}

std::vector<FuzzBytes> ValueSeeds() {
  std::vector<FuzzBytes> seeds;
  for (const char* text : {"640x480",
                           "512",
                           "1,-2,0.5",
                           "0,0.5,1",
                           "0,0,0,0.25",
                           "frame_%04d.png",
                           "100%%_%3i.exr",
                           "2.5e1",
                           "+0.001",
                           "tcp://127.0.0.1:7420",
                           "tcp://[::1]:*",
                           "tcp://node7.cluster:80",
                           "ipc:///run/a.sock",
                           "inproc://name",
                           "0=green,Actin=1,0.5,0",
                           "a\\\\,b,c\\\\=d",
                           "0={\"a\": [\",]\"]},1=[2]",
                           "10gbit",
                           "1gbit:30,1",
                           "brain:opaque"})
    seeds.push_back(SeedOf(text));
  return seeds;
}

}  // namespace slabstream
