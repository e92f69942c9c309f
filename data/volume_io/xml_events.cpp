#include "data/volume_io/xml_events.h"

#include <expat.h>
#include <fmt/format.h>

#include <fstream>
#include <memory>
#include <new>
#include <type_traits>

#include "common/files/files.h"

namespace slabstream {
namespace {

constexpr std::int64_t kMaxTag = std::int64_t{1} << 20;  // bytes

struct State {
  XML_Parser parser;
  const XmlEvents& events;
  bool stopped = false;
  std::string wrong;

  void Stop() { XML_StopParser(parser, XML_FALSE); }
  XmlTag TagNamed(const char* name) const {
    const std::int64_t begin = XML_GetCurrentByteIndex(parser);
    return {name, {}, begin, begin + XML_GetCurrentByteCount(parser)};
  }
};

// expat is C: no exception may pass through it.
template <class Function>
void Guarded(State& state, Function&& function) {
  try {
    function();
  } catch (const std::bad_alloc&) {
    state.wrong = "it does not fit the memory";
    state.Stop();
  }
}

void OnStart(void* data, const char* name, const char** attributes) {
  State& state = *static_cast<State*>(data);
  Guarded(state, [&] {
    XmlTag tag = state.TagNamed(name);
    for (; *attributes != nullptr; attributes += 2) tag.attributes.emplace(attributes[0], attributes[1]);
    if (state.stopped || state.events.start(tag)) return;
    state.stopped = true;
    state.Stop();
  });
}

void OnEnd(void* data, const char* name) {
  State& state = *static_cast<State*>(data);
  Guarded(state, [&] {
    if (!state.stopped) state.events.end(state.TagNamed(name));
  });
}

// Entities can grow without bounds, and so can attributes that elements have by default.
void OnDeclaration(State& state) {
  state.wrong = "its document type definition declares entities or attributes";
  state.Stop();
}
void OnEntity(void* data, const char*, int, const char*, int, const char*, const char*, const char*, const char*) {
  OnDeclaration(*static_cast<State*>(data));
}
void OnAttribute(void* data, const char*, const char*, const char*, const char*, int) { OnDeclaration(*static_cast<State*>(data)); }

}  // namespace

Status ReadXml(const std::function<std::size_t(std::span<char>)>& read, const XmlEvents& events) {
  const std::unique_ptr<std::remove_pointer_t<XML_Parser>, decltype(&XML_ParserFree)> parser(XML_ParserCreate(nullptr), XML_ParserFree);
  if (parser == nullptr) throw std::bad_alloc();
  State state{parser.get(), events, false, {}};
  XML_SetUserData(parser.get(), &state);
  XML_SetElementHandler(parser.get(), OnStart, OnEnd);
  XML_SetEntityDeclHandler(parser.get(), OnEntity);
  XML_SetAttlistDeclHandler(parser.get(), OnAttribute);
  constexpr int kBlock = 1 << 16;
  std::int64_t fed = 0;
  for (bool last = false; !last;) {
    char* const buffer = static_cast<char*>(XML_GetBuffer(parser.get(), kBlock));
    if (buffer == nullptr) throw std::bad_alloc();
    const std::size_t count = read({buffer, std::size_t{kBlock}});
    last = count == 0;
    fed += std::int64_t(count);
    const XML_Status status = XML_ParseBuffer(parser.get(), int(count), last ? 1 : 0);
    if (state.stopped) return Status::Ok();
    if (status != XML_STATUS_OK && state.wrong.empty()) state.wrong = XML_ErrorString(XML_GetErrorCode(parser.get()));
    // expat keeps a tag until it ends.
    if (state.wrong.empty() && fed - XML_GetCurrentByteIndex(parser.get()) > kMaxTag) state.wrong = "a tag is too long";
    if (state.wrong.empty()) continue;
    return Status::InvalidArgument(
        fmt::format("its XML cannot be read in line {}: {}", XML_GetCurrentLineNumber(parser.get()), state.wrong));
  }
  return Status::Ok();
}

Status ReadXml(std::string_view text, const XmlEvents& events) {
  std::size_t at = 0;
  const auto read = [&](std::span<char> out) {
    const std::size_t count = text.copy(out.data(), out.size(), at);
    at += count;
    return count;
  };
  return ReadXml(read, events);
}

Status ReadXmlFile(const std::string& path, std::string_view wrong, const XmlEvents& events) {
  if (Status status = CheckIsFile(path); !status.ok()) return status;
  std::ifstream file(path, std::ios::binary);
  if (!file) return Status::NotFound(path + ": cannot be opened for reading");
  const auto read = [&](std::span<char> out) {
    file.read(out.data(), std::streamsize(out.size()));
    return std::size_t(file.gcount());
  };
  const Status status = ReadXml(read, events);
  return status.ok() ? status : Status(status.code(), fmt::format("{}: {}{}", path, wrong, status.message()));
}

}  // namespace slabstream
