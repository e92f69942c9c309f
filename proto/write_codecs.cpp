// Writes the structs and codecs of messages, the tables of a request's fields and the walk over them, as the schema says:
// write_codecs SCHEMA FOLDER
//
// SCHEMA is what `protoc --include_imports --include_source_info --descriptor_set_out` writes. For each file of messages FOLDER gets
// NAME_codec.cpp, with
//   void Write(const Ping& in, v1::Ping& out);
//   void Read(const v1::Ping& in, Ping& out, Checker& check);
// of each message, out of the parts in common/wire/codec.h; codecs.h, which declares them; and request_walk.h with request_fields.cpp
// (common/wire/field_about.h). A file with the option `structs` also gets NAME_structs.h: the structs of its messages, with the schema's
// comments. Structs and members have the names of messages and fields, unless the schema says otherwise (about.proto). A file whose text
// stays the same is not touched.
#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/reflection.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "slabstream/v1/about.pb.h"

namespace slabstream {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::DescriptorPool;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptor;

const v1::Wire& WireOf(const FieldDescriptor& field) { return field.options().GetExtension(v1::wire); }
const v1::About& AboutOf(const FieldDescriptor& field) { return field.options().GetExtension(v1::about); }

[[noreturn]] void Reject(const FieldDescriptor& field, const std::string& what) {
  std::fputs(fmt::format("{}: {}\n", field.full_name(), what).c_str(), stderr);
  std::exit(1);
}

// ---- names

// "CUT_AWAY" of CLIP_MODE_CUT_AWAY.
std::string BareName(const EnumDescriptor& choices, int number) {
  constexpr std::string_view kFirst = "UNSPECIFIED";
  return choices.FindValueByNumber(number)->name().substr(choices.value(0)->name().size() - kFirst.size());
}
// "cut-away"
std::string WordOf(const EnumDescriptor& choices, int number) {
  std::string word = BareName(choices, number);
  for (char& c : word) c = c == '_' ? '-' : char(std::tolower(static_cast<unsigned char>(c)));
  return word;
}
std::vector<std::string> WordsOf(const EnumDescriptor& choices) {
  std::vector<std::string> words;
  for (int number = 1; number < choices.value_count(); ++number) words.push_back(WordOf(choices, number));
  return words;
}
// "ClipMode::kCutAway"
std::string Enumerator(const EnumDescriptor& choices, int number) {
  std::string name = choices.name() + "::k";
  bool begins = true;
  for (const char c : BareName(choices, number)) {
    if (c != '_') name += begins ? c : char(std::tolower(static_cast<unsigned char>(c)));
    begins = c == '_';
  }
  return name;
}

std::string StructOf(const Descriptor& message) {
  const std::string& name = message.options().GetExtension(v1::struct_name);
  return name.empty() ? message.name() : name;
}
std::string MemberOf(const FieldDescriptor& field) {
  if (const auto* choice = field.real_containing_oneof()) return choice->name();
  return WireOf(field).member().empty() ? field.name() : WireOf(field).member();
}

// ---- values

bool HasStruct(const Descriptor& message) { return StructOf(message) != "none"; }
bool IsOwn(const Descriptor& message) { return message.options().GetExtension(v1::own_codec) || !HasStruct(message); }
bool IsReal(const FieldDescriptor& field) {
  return field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE || field.cpp_type() == FieldDescriptor::CPPTYPE_FLOAT;
}
std::string TypeOf(const FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_UINT32: return "std::uint32_t";
    case FieldDescriptor::CPPTYPE_UINT64: return "std::uint64_t";
    case FieldDescriptor::CPPTYPE_INT64: return "std::int64_t";
    default: return field.cpp_type_name();
  }
}

// ", least, most" of a text's bytes or a number; "": a number without limits. Validate checks the real numbers of requests.
std::string LimitsOf(const FieldDescriptor& field) {
  const v1::Wire& wire = WireOf(field);
  const v1::About& about = AboutOf(field);
  const bool text = field.cpp_type() == FieldDescriptor::CPPTYPE_STRING;
  if (about.most() > 0 && !IsReal(field)) return fmt::format(", {}, {}", about.least(), about.most());
  if (!text && !wire.has_least() && !wire.has_most()) return "";
  const std::string greatest = text ? "256" : fmt::format("std::numeric_limits<{}>::max()", TypeOf(field));
  const auto shown = [&](double limit) { return IsReal(field) ? fmt::format("{}", limit) : fmt::format("{:.0f}", limit); };
  return fmt::format(", {}, {}", shown(wire.has_least() ? wire.least() : double(text)), wire.has_most() ? shown(wire.most()) : greatest);
}

// The checked value of a singular field.
std::string Checked(const FieldDescriptor& field) {
  const std::string& name = field.name();
  const std::string limits = LimitsOf(field);
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_STRING) return fmt::format(R"(check.Text("{0}", in.{0}(){1}))", name, limits);
  if (IsReal(field)) return fmt::format(R"(check.{}("{}", in.{}(){}))", limits.empty() ? "Finite" : "Between", name, name, limits);
  return limits.empty() ? fmt::format("in.{}()", name) : fmt::format(R"(check.Range("{0}", in.{0}(){1}))", name, limits);
}

// The number of the enumerator that is called so by `name_of`.
int NumberOf(const FieldDescriptor& field, const EnumDescriptor& choices, const std::string& name, const auto& name_of) {
  for (int number = 1; number < choices.value_count(); ++number) {
    if (name_of(choices, number) == name) return number;
  }
  Reject(field, fmt::format("{} has no '{}'", choices.name(), name));
}

// Whether the field travels, from what the schema says of that: of a struct ("in.state == ...") or of a message ("in.state() == ...").
std::string Condition(const FieldDescriptor& field, bool of_message) {
  const std::string& only = WireOf(field).only();
  if (only.empty()) return "";
  if (only.front() == '!') return fmt::format("if (!in.{}{}{}) ", of_message ? "has_" : "", only.substr(1), of_message ? "()" : "");
  const std::string name = only.substr(0, only.find('='));
  const FieldDescriptor* const decides = field.containing_type()->FindFieldByName(name);
  if (decides == nullptr || decides->enum_type() == nullptr) Reject(field, fmt::format("'{}' is no enum", name));
  std::istringstream words(only.substr(std::min(name.size() + 1, only.size())));
  std::string condition, word;
  while (std::getline(words, word, '|')) {
    const int number = NumberOf(field, *decides->enum_type(), word, BareName);
    condition += condition.empty() ? "" : " || ";
    condition += of_message ? fmt::format("in.{}() == {}", name, number)
                            : fmt::format("in.{} == {}", MemberOf(*decides), Enumerator(*decides->enum_type(), number));
  }
  return fmt::format("if ({}) ", condition);
}

// ---- statements

std::string WriteOf(const FieldDescriptor& field) {
  const std::string& name = field.name();
  const std::string in = "in." + MemberOf(field);
  if (field.real_containing_oneof() != nullptr) {
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_STRING)
      return fmt::format("if (const auto* text = std::get_if<std::string>(&{})) out.set_{}(WireText(*text, 256));", in, name);
    return fmt::format("if (const auto* part = std::get_if<{}>(&{})) Write(*part, *out.mutable_{}());", StructOf(*field.message_type()), in,
                       name);
  }
  if (field.is_repeated()) {
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) return fmt::format("WriteItems({}, *out.mutable_{}());", in, name);
    return fmt::format("out.mutable_{1}()->Add({0}.begin(), {0}.end());", in, name);
  }
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return fmt::format("if (const auto* part = PartOf({})) Write(*part, *out.mutable_{}());", in, name);
    case FieldDescriptor::CPPTYPE_ENUM:
      return fmt::format("out.set_{}(v1::{}(NumberOf({}, {})));", name, field.enum_type()->name(), in, Enumerator(*field.enum_type(), 1));
    case FieldDescriptor::CPPTYPE_STRING: {
      if (field.type() == FieldDescriptor::TYPE_BYTES) return fmt::format("out.set_{}({});", name, in);
      const std::string limits = LimitsOf(field);
      return fmt::format("out.set_{}(WireText({}{}));", name, in, limits.substr(limits.rfind(',')));
    }
    default: break;
  }
  if (field.has_presence())
    return fmt::format("if (const auto* value = PartOf({})) out.set_{}(static_cast<{}>(*value));", in, name, TypeOf(field));
  return fmt::format("out.set_{}(static_cast<{}>({}));", name, TypeOf(field), in);
}

std::string ReadOf(const FieldDescriptor& field) {
  const std::string& name = field.name();
  const std::string out = "out." + MemberOf(field);
  const std::string& standard = AboutOf(field).standard();
  if (field.real_containing_oneof() != nullptr && field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
    return fmt::format(R"(if (in.has_{0}()) ReadPart("{0}", true, in.{0}(), {1}.emplace<{2}>(), check);)", name, out,
                       StructOf(*field.message_type()));
  }
  if (field.is_repeated()) {
    const std::uint32_t items = WireOf(field).items();
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE)
      return fmt::format(R"(ReadItems("{0}", in.{0}(), {1}, {2}, check);)", name, out, items);
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_STRING)
      return fmt::format(R"(ReadTexts("{0}", in.{0}(), {1}, {2}{3}, check);)", name, out, items, LimitsOf(field));
    return fmt::format(R"(ReadNumbers("{0}", in.{0}(), {1}, {2}, check);)", name, out, items);
  }
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE: return fmt::format(R"(ReadPart("{0}", in.has_{0}(), in.{0}(), {1}, check);)", name, out);
    case FieldDescriptor::CPPTYPE_ENUM: {
      const EnumDescriptor& choices = *field.enum_type();
      const int last = WireOf(field).has_most() ? int(WireOf(field).most()) : choices.value_count() - 1;
      std::string read =
          fmt::format(R"(ReadEnum("{0}", in.{0}(), {1}, {2}, {3}, check);)", name, out, Enumerator(choices, 1), Enumerator(choices, last));
      if (standard.empty()) return read;
      const int number = NumberOf(field, choices, standard, WordOf);
      return fmt::format("if (in.{}() == 0 && check.fills()) {} = {}; else {}", name, out, Enumerator(choices, number), read);
    }
    case FieldDescriptor::CPPTYPE_STRING: {
      if (standard.empty()) return fmt::format("{} = {};", out, Checked(field));
      const std::string absent = field.has_presence() ? fmt::format("!in.has_{}()", name) : fmt::format("in.{}().empty()", name);
      const auto* choice = field.real_containing_oneof();
      const std::string unless = choice != nullptr ? fmt::format("if (!in.has_{}()) ", choice->field(1)->name()) : "";
      return fmt::format(R"({}{} = {} && check.fills() ? "{}" : {};)", unless, out, absent, standard, Checked(field));
    }
    default: break;
  }
  if (!field.has_presence()) return fmt::format("Set({}, {});", out, Checked(field));
  if (standard.empty()) return fmt::format("if (in.has_{}()) Set({}, {}); else {} = {{}};", name, out, Checked(field), out);
  return fmt::format("Set({}, !in.has_{}() && check.fills() ? {}({}) : {});", out, name, TypeOf(field), standard, Checked(field));
}

// ---- files

class Output {
 public:
  template <class... T>
  void Line(fmt::format_string<T...> format, T&&... values) {
    text_ += fmt::format(format, std::forward<T>(values)...) + '\n';
  }
  bool Save(const std::string& path) const {
    std::ifstream before(path, std::ios::binary);
    if (before && std::string(std::istreambuf_iterator<char>(before), {}) == text_) return true;
    return bool(std::ofstream(path, std::ios::binary) << text_ << std::flush);
  }

 private:
  std::string text_ = "// Made by proto/write_codecs.cpp.\n";
};

// Fields whose codec is made here; of a message with a codec of its own none, unless it says which fields that leaves.
std::vector<const FieldDescriptor*> FieldsOf(const Descriptor& message) {
  std::vector<const FieldDescriptor*> fields;
  for (int i = 0; i < message.field_count(); ++i) {
    if (!WireOf(*message.field(i)).by_hand()) fields.push_back(message.field(i));
  }
  if (IsOwn(message) && int(fields.size()) == message.field_count()) fields.clear();
  return fields;
}

// The messages that a message has in it, however deep, and itself at the end.
void Collect(const Descriptor& message, std::vector<const Descriptor*>& found) {
  if (std::ranges::count(found, &message) > 0) return;
  for (const FieldDescriptor* field : FieldsOf(message)) {
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) Collect(*field->message_type(), found);
  }
  if (!FieldsOf(message).empty()) found.push_back(&message);
}

// ---- structs

// Lines of a comment in the schema.
std::vector<std::string> CommentOf(const auto& element) {
  google::protobuf::SourceLocation place;
  element.GetSourceLocation(&place);
  std::istringstream text(place.leading_comments + place.trailing_comments);
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back("//" + line);
  return lines;
}

// A line of code with its comment: one line of it stands behind the code.
void AddWithComment(const auto& element, const std::string& code, Output& file) {
  const std::vector<std::string> comment = CommentOf(element);
  if (comment.size() == 1) return file.Line("  {}  {}", code, comment.front());
  for (const std::string& line : comment) file.Line("  {}", line);
  file.Line("  {}", code);
}

std::string MemberTypeOf(const FieldDescriptor& field) {
  if (!WireOf(field).type().empty()) return WireOf(field).type();
  if (field.real_containing_oneof() != nullptr || MemberOf(field).find_first_of(".[") != std::string::npos) Reject(field, "needs a type");
  const auto* message = field.message_type();
  const auto* choices = field.enum_type();
  const bool text = field.cpp_type() == FieldDescriptor::CPPTYPE_STRING;
  const std::string type = message != nullptr   ? StructOf(*message)
                           : choices != nullptr ? choices->name()
                           : text               ? "std::string"
                                                : TypeOf(field);
  if (field.is_repeated()) return fmt::format("std::vector<{}>", type);
  return field.has_optional_keyword() ? fmt::format("std::optional<{}>", type) : type;
}

// The least value that may travel, or nothing.
std::string InitialOf(const FieldDescriptor& field) {
  const v1::Wire& wire = WireOf(field);
  if (!wire.initial().empty()) return wire.initial();
  if (!wire.type().empty() || field.is_repeated() || field.has_optional_keyword()) return "{}";
  if (field.enum_type() != nullptr) return Enumerator(*field.enum_type(), 1);
  if (field.message_type() != nullptr || field.cpp_type() == FieldDescriptor::CPPTYPE_STRING) return "{}";
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_BOOL) return "false";
  return fmt::format("{}", std::max(wire.least(), 0.0));
}

void AddStruct(const Descriptor& message, Output& file) {
  for (const std::string& line : CommentOf(message)) file.Line("{}", line);
  file.Line("struct {} {{", StructOf(message));
  std::string before;
  for (int i = 0; i < message.field_count(); ++i) {
    const FieldDescriptor& field = *message.field(i);
    const std::string member = MemberOf(field).substr(0, MemberOf(field).find_first_of(".["));
    if (member != before) AddWithComment(field, fmt::format("{} {} = {};", MemberTypeOf(field), member, InitialOf(field)), file);
    before = member;
  }
  file.Line("  friend bool operator==(const {0}&, const {0}&) = default;\n}};\n", StructOf(message));
}

void AddEnumClass(const EnumDescriptor& choices, Output& file) {
  for (const std::string& line : CommentOf(choices)) file.Line("{}", line);
  file.Line("enum class {} : std::uint8_t {{", choices.name());
  for (int number = 1; number < choices.value_count(); ++number) {
    const std::string name = Enumerator(choices, number).substr(choices.name().size() + 2);
    AddWithComment(*choices.value(number), fmt::format("{} = {},", name, number), file);
  }
  file.Line("}};\n");
}

Output StructsOf(const FileDescriptor& schema) {
  const v1::Structs& structs = schema.options().GetExtension(v1::structs);
  const auto made = [&](const std::string& name) { return std::ranges::count(structs.by_hand(), name) == 0; };
  Output file;
  file.Line("#pragma once\n#include <cstdint>\n#include <optional>\n#include <string>\n#include <vector>\n");
  for (const std::string& header : structs.include()) file.Line("#include \"{}\"", header);
  file.Line("\nnamespace slabstream {{\n");
  for (int i = 0; i < schema.enum_type_count(); ++i) {
    if (made(schema.enum_type(i)->name())) AddEnumClass(*schema.enum_type(i), file);
  }
  std::vector<const Descriptor*> messages;
  for (int i = 0; i < schema.message_type_count(); ++i) Collect(*schema.message_type(i), messages);
  for (const Descriptor* message : messages) {
    if (message->file() == &schema && made(message->name())) AddStruct(*message, file);
  }
  file.Line("}}  // namespace slabstream");
  return file;
}

// ---- codecs

void AddCodec(const Descriptor& message, Output& file) {
  const std::vector<const FieldDescriptor*> fields = FieldsOf(message);
  if (fields.empty()) return;
  const std::string name = IsOwn(message) ? "Fields" : "";
  file.Line("void Write{}(const {}& in, v1::{}& out) {{", name, StructOf(message), message.name());
  for (const FieldDescriptor* field : fields) file.Line("  {}{}", Condition(*field, false), WriteOf(*field));
  file.Line("}}\nvoid Read{}(const v1::{}& in, {}& out, Checker& check) {{", name, message.name(), StructOf(message));
  if (message.options().GetExtension(v1::has_standards)) file.Line("  const auto standards = check.Fill();");
  for (const FieldDescriptor* field : fields) file.Line("  {}{}", Condition(*field, true), ReadOf(*field));
  if (!IsOwn(message)) file.Line("  if (check.ok()) Rules(out, check);");
  file.Line("}}");
}

void AddEnum(const EnumDescriptor& choices, Output& file) {
  file.Line("static_assert(int({}) - int({}) == {});", Enumerator(choices, choices.value_count() - 1), Enumerator(choices, 1),
            choices.value_count() - 2);
}

Output CodecsOf(const FileDescriptor& schema) {
  Output file;
  file.Line("#include <limits>\n#include <variant>\n");
  file.Line("#include \"common/wire/codec.h\"\n#include \"common/wire/codecs.h\"\n#include \"common/wire/rules.h\"");
  for (int i = 0; i < schema.dependency_count(); ++i) {
    std::string name = schema.dependency(i)->name();
    file.Line("#include \"{}.pb.h\"", name.substr(0, name.rfind('.')));
  }
  file.Line("#include \"{}.pb.h\"\n\nnamespace slabstream {{", schema.name().substr(0, schema.name().rfind('.')));
  for (int i = 0; i < schema.enum_type_count(); ++i) AddEnum(*schema.enum_type(i), file);
  for (int i = 0; i < schema.message_type_count(); ++i) AddCodec(*schema.message_type(i), file);
  file.Line("}}  // namespace slabstream");
  return file;
}

Output Declarations(const std::vector<const Descriptor*>& messages, const Descriptor& envelope) {
  Output file;
  file.Line("#pragma once\n#include \"common/wire/any_message.h\"\n#include \"common/wire/checker.h\"\nnamespace slabstream::v1 {{");
  for (const Descriptor* message : messages) file.Line("class {};", message->name());
  file.Line("}}\nnamespace slabstream {{");
  const auto declare = [&](const char* name, const Descriptor& message) {
    file.Line("void Write{0}(const {1}&, v1::{2}&);\nvoid Read{0}(const v1::{2}&, {1}&, Checker&);", name, StructOf(message),
              message.name());
  };
  for (const Descriptor* message : messages) {
    if (HasStruct(*message)) declare("", *message);
    if (IsOwn(*message) && !FieldsOf(*message).empty()) declare("Fields", *message);
  }
  // The Protobuf message of each message of the envelope.
  for (int i = 0; i < envelope.field_count(); ++i) {
    if (const Descriptor* message = envelope.field(i)->message_type()) file.Line("v1::{0} ProtoOf(const {0}&);", message->name());
  }
  file.Line("}}  // namespace slabstream");
  return file;
}

std::string Quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c == '\n' ? "\\n" : std::string(1, c);
  }
  return quoted + '"';
}
std::string List(const auto& texts) {
  std::string list;
  for (const std::string& text : texts) list += Quoted(text) + ", ";
  return "{" + list + "}";
}

// What the schema says of a field, as initialisers of a FieldAbout, which has the members of an About.
std::string Initialisers(const FieldDescriptor& field) {
  const v1::About& about = AboutOf(field);
  const auto& access = *about.GetReflection();
  std::string text = ".field = " + Quoted(field.name());
  std::vector<const FieldDescriptor*> given;
  access.ListFields(about, &given);
  for (const FieldDescriptor* said : given) {
    text += fmt::format(", .{} = ", said->name());
    switch (said->cpp_type()) {
      case FieldDescriptor::CPPTYPE_DOUBLE: text += fmt::format("{}", access.GetDouble(about, said)); break;
      case FieldDescriptor::CPPTYPE_BOOL: text += "true"; break;
      default:
        text += said->is_repeated() ? List(access.GetRepeatedFieldRef<std::string>(about, said)) : Quoted(access.GetString(about, said));
    }
  }
  if (const auto* choices = field.enum_type()) text += ", .words = " + List(WordsOf(*choices));
  return text;
}

Output RequestFields(const std::vector<const Descriptor*>& messages) {
  Output file;
  file.Line("#include \"common/wire/request_walk.h\"\n\nnamespace slabstream {{");
  for (const Descriptor* message : messages) {
    file.Line("const std::vector<FieldAbout>& FieldsOf{}() {{\n  static const std::vector<FieldAbout> kFields = {{", message->name());
    for (const FieldDescriptor* field : FieldsOf(*message)) file.Line("    {{{}}},", Initialisers(*field));
    file.Line("  }};\n  return kFields;\n}}");
  }
  file.Line("}}  // namespace slabstream");
  return file;
}

Output RequestWalk(const std::vector<const Descriptor*>& messages) {
  Output file;
  file.Line("#pragma once\n#include \"common/frame/frame_request.h\"\n#include \"common/wire/field_about.h\"\n\nnamespace slabstream {{");
  for (const Descriptor* message : messages) {
    file.Line("const std::vector<FieldAbout>& FieldsOf{}();", message->name());
    file.Line("template <class Visit>\nvoid Walk(Is<{}> auto& m, const Visit& visit) {{", StructOf(*message));
    file.Line("  const std::vector<FieldAbout>& fields = FieldsOf{}();", message->name());
    const std::vector<const FieldDescriptor*> fields = FieldsOf(*message);
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const FieldDescriptor& field = *fields[i];
      if (field.real_containing_oneof() != nullptr && field.index_in_oneof() > 0) continue;  // the first one stands for it
      if (const auto* choices = field.enum_type()) {
        file.Line("  EnumMember {}{{m.{}, int({})}};", field.name(), MemberOf(field), Enumerator(*choices, 1));
        file.Line("  visit(fields[{}], {}, 0);", i, field.name());
      } else {
        file.Line("  visit(fields[{}], m.{}, {});", i, MemberOf(field), WireOf(field).items());
      }
    }
    file.Line("}}");
  }
  file.Line("}}  // namespace slabstream");
  return file;
}

bool WriteAll(const std::string& schema_file, const std::string& folder) {
  google::protobuf::FileDescriptorSet files;
  std::ifstream in(schema_file, std::ios::binary);
  if (!files.ParseFromIstream(&in)) return false;
  DescriptorPool pool;
  for (const auto& file : files.file()) {
    if (pool.BuildFile(file) == nullptr) return false;
  }
  const Descriptor& envelope = *pool.FindMessageTypeByName("slabstream.v1.Envelope");
  std::vector<const Descriptor*> messages, request;
  for (const auto& file : files.file()) {
    const std::string name = file.name().substr(file.name().rfind('/') + 1);
    if (file.package() != "slabstream.v1" || name == "about.proto" || name == "envelope.proto") continue;
    const FileDescriptor& schema = *pool.FindFileByName(file.name());
    for (int i = 0; i < schema.message_type_count(); ++i) messages.push_back(schema.message_type(i));
    const std::string path = fmt::format("{}/{}", folder, name.substr(0, name.find('.')));
    if (!CodecsOf(schema).Save(path + "_codec.cpp")) return false;
    if (schema.options().HasExtension(v1::structs) && !StructsOf(schema).Save(path + "_structs.h")) return false;
  }
  Collect(*pool.FindMessageTypeByName("slabstream.v1.FrameRequest"), request);
  return Declarations(messages, envelope).Save(folder + "/codecs.h") && RequestWalk(request).Save(folder + "/request_walk.h") &&
         RequestFields(request).Save(folder + "/request_fields.cpp");
}

}  // namespace
}  // namespace slabstream

int main(int argc, char** argv) {
  if (argc == 3 && slabstream::WriteAll(argv[1], argv[2])) return 0;
  std::fputs("write_codecs SCHEMA FOLDER: cannot read the schema or write to the folder\n", stderr);
  return 1;
}
