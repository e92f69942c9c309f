#include "client/request/request_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <type_traits>
#include <variant>

#include "client/request/values.h"
#include "client/request/volume_argument.h"
#include "common/base/check.h"
#include "common/combining/schemes.h"
#include "common/decomposition/decomposition.h"
#include "common/planning/assignment.h"
#include "common/planning/balances.h"
#include "common/planning/policy_names.h"
#include "common/renderers/registry.h"
#include "common/view/default_view.h"
#include "common/wire/request_walk.h"

namespace slabstream {
namespace {

constexpr std::string_view kParameters = "parameters";
constexpr std::string_view kOfFields = "fields.";
constexpr std::string_view kOfLabels = "fields.labels.";  // of the one field that has such a look, so they need not name it

// Options of single channels, which they name, as in "0=green,Actin=#f0f".
bool IsOfChannels(std::string_view path) { return path.starts_with(kOfFields) && !path.starts_with(kOfLabels); }

constexpr char kColorMapFile[] = "color-map.json";
std::string ChannelMapFile(std::size_t look) { return fmt::format("channel-map-{}.json", look + 1); }

// Members of requests whose own members are fields with names.
template <class T>
concept Part = std::is_same_v<T, ViewParameters> || std::is_same_v<T, Clipping> || std::is_same_v<T, TransferChoice> ||
    std::is_same_v<T, Shading> || std::is_same_v<T, LabelChoice> || std::is_same_v<T, FieldChoice> || std::is_same_v<T, Policy>;

// Of options that are given once for each item.
template <class T>
concept Items = std::is_same_v<T, std::vector<Vec3>> || std::is_same_v<T, std::vector<ClipPlane>> ||
    std::is_same_v<T, std::vector<ShapeChoice>> || std::is_same_v<T, std::vector<PlaneChoice>>;

// ---- the table

struct Choices {
  std::vector<std::string> names;  // empty: other texts are possible, too
  std::string explained;

  void Add(std::string_view name, std::string_view purpose) {
    names.emplace_back(name);
    explained += fmt::format("\n  {}: {}", name, purpose);
  }
};

// Of a list that the schema names.
Choices ChoicesOf(const std::string& list) {
  Choices choices;
  const auto add_all = [&](const auto& entries) {
    for (const auto& entry : entries) choices.Add(entry.name, entry.purpose);
  };
  if (list == "decompositions") add_all(Decompositions());
  if (list == "assignments") add_all(Assignments());
  if (list == "loads") add_all(BalanceByChoices());
  if (list == "balances") add_all(Balances());
  if (list == "presets") add_all(TransferPresets());
  if (list == "renderers") {
    choices.Add(kAutomatic, fmt::format("{} for volumes, {} for unstructured grids, or the first of these that can do what is asked",
                                        DefaultRenderer(false).name(), DefaultRenderer(true).name()));
    for (const RendererKind* kind : Renderers()) choices.Add(kind->name(), kind->purpose());
  }
  if (list == "combining schemes") {
    for (const CombiningEntry& entry : CombiningSchemes()) {
      choices.Add(fmt::format("{}{}{}", entry.name, entry.arguments.empty() ? "" : ":", entry.arguments), entry.purpose);
    }
  }
  if (list == "combining schemes" || list == "presets") choices.names.clear();
  return choices;
}

template <class T>
RequestOption Describe(const FieldAbout& field, const T&, std::string path, const std::string& group) {
  RequestOption option{.name = field.name,
                       .path = std::move(path),
                       .group = group,
                       .help = field.help,
                       .value = field.value,
                       .standard = field.standard,
                       .unit = field.unit,
                       .ability = field.ability,
                       .same_picture = field.same_picture,
                       .excludes = field.excludes,
                       .needs = field.needs};
  if (!field.list.empty()) {
    Choices choices = ChoicesOf(field.list);
    option.choices = std::move(choices.names);
    option.help += choices.explained;
  }
  if (!option.ability.empty()) option.help += fmt::format("; for --renderer {}", NamesOfAble(option.ability));
  const auto named = [&](const char* value) { return option.value.empty() ? value : option.value; };
  if constexpr (requires(T value) { value.number(); }) {
    option.choices = field.words;
  } else if constexpr (std::is_same_v<T, bool> || std::is_same_v<T, std::optional<bool>>) {
    option.standard.clear();  // a flag: it is there or not
    option.negatable = !std::is_same_v<T, bool>;
    return option;
  } else if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::optional<float>> || std::is_same_v<T, std::optional<double>>) {
    option.range = NumberRange{field.least, field.most, field.above_least};
    option.value = named(std::is_integral_v<T> ? "N" : "NUMBER");
  }
  option.repeatable = Items<T> || std::is_same_v<T, std::vector<std::string>>;
  option.value = named("NAME");
  if (IsOfChannels(option.path)) {  // each channel has its own
    option.range.reset();
    option.standard.clear();
    option.repeatable = true;
  }
  return option;
}

// Any renderer's parameters, by name. Whether the chosen renderer has one is checked with the request.
void AddParameters(const std::string& group, std::vector<RequestOption>& table) {
  struct Entry {
    const RendererParameter* parameter = nullptr;
    std::string renderers;  // with this parameter
    std::string standard;   // that of the first, and those that differ from it
  };
  std::map<std::string_view, Entry> parameters;
  for (const RendererKind* kind : Renderers()) {
    for (const RendererParameter& parameter : kind->parameters()) {
      auto& [first, renderers, standard] = parameters[parameter.name];
      if (first == nullptr) {
        first = &parameter;
        standard = TextOf(parameter, parameter.standard);
      } else if (parameter.standard != first->standard) {
        standard += fmt::format(", {}: {}", kind->name(), TextOf(parameter, parameter.standard));
      }
      renderers += (renderers.empty() ? "" : ", ") + std::string(kind->name());
    }
  }
  for (const auto& [name, entry] : parameters) {
    const auto& [parameter, renderers, standard] = entry;
    const bool choice = !parameter->choices.empty();
    RequestOption& option = table.emplace_back(RequestOption{.name = std::string(name),
                                                             .path = fmt::format("{}.{}", kParameters, name),
                                                             .group = group,
                                                             .help = fmt::format("{}; for --renderer {}", parameter->purpose, renderers),
                                                             .value = choice ? "NAME" : "NUMBER",
                                                             .standard = standard,
                                                             .choices = {parameter->choices.begin(), parameter->choices.end()}});
    if (!choice) option.range = NumberRange{parameter->least, parameter->most};
  }
}

template <class Struct>
void Collect(const std::string& place, const std::string& outer_group, const Struct& part, std::vector<RequestOption>& table) {
  Walk(part, [&](const FieldAbout& field, const auto& member, std::size_t) {
    using T = std::remove_cvref_t<decltype(member)>;
    const std::string& group = field.group.empty() ? outer_group : field.group;
    const std::string path = place + field.field;
    if (!field.name.empty()) {
      table.push_back(Describe(field, member, path, group));
    } else if (path == kParameters) {
      AddParameters(group, table);
    } else if constexpr (Part<T>) {
      Collect(path + ".", group, member, table);
    } else if constexpr (requires { requires Part<typename T::value_type>; }) {
      Collect(path + ".", group, typename T::value_type(), table);
    }
  });
}

// ---- one field

// Calls use(member, most items) for the member of `whole` at `path`. Optional parts: made, if `whole` is not const; else one that is not
// there is skipped. Of looks of fields the one of labels counts, if there is one.
template <class Struct, class Use>
void At(std::string_view path, Struct& whole, const Use& use) {
  Walk(whole, [&](const FieldAbout& field, auto& member, std::size_t most) {
    using T = std::remove_cvref_t<decltype(member)>;
    if (!path.starts_with(field.field)) return;
    const std::string_view rest = path.substr(field.field.size());
    if (rest.empty()) return use(field, member, most);
    if (!rest.starts_with('.')) return;
    if constexpr (Part<T>) {
      At(rest.substr(1), member, use);
    } else if constexpr (requires { member.has_value(); }) {
      if constexpr (Part<typename T::value_type>) {
        if constexpr (!std::is_const_v<std::remove_reference_t<decltype(member)>>) {
          if (!member) member.emplace();
        }
        if (member) At(rest.substr(1), *member, use);
      }
    } else if constexpr (std::is_same_v<T, std::vector<FieldChoice>>) {
      for (auto& choice : member) {
        if (choice.labels) At(rest.substr(1), choice, use);
      }
    }
  });
}

// What texts are turned into values with.
struct OptionReader {
  const RequestOption& option;
  const std::string& shown;
  ColorMaps maps;
  std::size_t most;  // items of a repeatable option
  Status status = {};

  template <class T, class Value>
  void Take(T& target, Result<Value> value) {
    if (value.ok()) {
      target = *std::move(value);
    } else {
      status = value.status();
    }
  }

  Result<std::size_t> Choice(const std::string& text) const {
    return ParseChoice(shown, text, std::vector<std::string_view>(option.choices.begin(), option.choices.end()));
  }

  // A number may be left to the service: 0 stands for that.
  bool IsLeft(const std::string& text) const { return text == kAutomatic && option.value.ends_with("|auto"); }

  void Read(const std::string& text, double& value) {
    if (IsLeft(text)) return void(value = 0);
    Take(value, ParseNumber(shown, text, *option.range));
  }
  void Read(const std::string& text, float& value) { Take(value, ParseNumber(shown, text, *option.range)); }
  void Read(const std::string& text, std::optional<float>& value) { Read(text, value.emplace()); }
  void Read(const std::string& text, std::optional<double>& value) { Read(text, value.emplace()); }
  void Read(const std::string& text, std::optional<bool>& value) { Read(text, value.emplace()); }
  void Read(const std::string& text, int& value) {
    if (IsLeft(text)) return void(value = 0);
    Take(value, ParseInteger(shown, text, int(option.range->min), int(option.range->max)));
  }
  void Read(const std::string& text, bool& value) {
    if (text != "true" && text != "false") status = Status::InvalidArgument(fmt::format("{} '{}' is neither true nor false", shown, text));
    value = text == "true";
  }
  template <class T>
  void Read(const std::string& text, EnumMember<T>& value) {
    const Result<std::size_t> choice = Choice(text);
    if (choice.ok()) value.set(int(*choice) + 1);
    status = choice.status();
  }
  void Read(const std::string& text, std::string& value) {
    if (!option.choices.empty()) status = Choice(text).status();
    if (option.path == "policy.combine" && !text.empty()) {
      if (const auto parsed = ParseCombining(text); !parsed.ok()) {
        status = Status::InvalidArgument(fmt::format("{} {}", shown, parsed.status().message()));
      }
    }
    if (status.ok()) value = text;
  }
  void Read(const std::string& text, std::variant<std::string, TransferFunction>& value) {
    Take(value, maps == ColorMaps::kFilesToo ? ParseTransfer(shown, text) : ParseTransferText(shown, text));
  }
  void Read(const std::string& text, ImageSize& value) { Take(value, ParseImageSize(shown, text)); }
  void Read(const std::string& text, std::optional<Vec3>& value) { Take(value, ParsePoint(shown, text)); }
  void Read(const std::string& text, std::optional<ClipBox>& value) { Take(value, ParseClipBox(shown, text)); }
  void Read(const std::string& text, std::optional<Rgb>& value) { Take(value, ParseOpaqueColor(shown, text)); }
  void Read(const std::string& text, std::optional<ScalarRange>& value) { Take(value, ParseScalarRange(shown, text)); }
  void Read(const std::string& text, std::vector<Isosurface>& value) { Take(value, ParseIsosurfaces(shown, text)); }
  void Read(const std::string& text, std::vector<GradientOpacityPoint>& value) { Take(value, ParseGradientOpacities(shown, text)); }
  void Read(const std::string& text, std::vector<LabelOpacity>& value) { Take(value, ParseLabelOpacities(shown, text)); }
  void Read(const std::string& text, std::vector<LabelRange>& value) { Take(value, ParseLabelRanges(shown, text)); }
  void Read(const std::string& text, Vec3& value) { Take(value, ParseDirection(shown, text)); }
  void Read(const std::string& text, ClipPlane& value) { Take(value, ParseClipPlane(shown, text)); }
  void Read(const std::string& text, ShapeChoice& value) { Take(value, ParseShape(shown, text)); }
  void Read(const std::string& text, PlaneChoice& value) { Take(value, ParsePlane(shown, text)); }

  template <class T>
  void ReadAll(std::span<const std::string> texts, T& value) {
    if constexpr (Items<T>) {
      value.clear();
      for (const std::string& text : texts) {
        if (status.ok()) Read(text, value.emplace_back());
      }
      if (status.ok() && value.size() > most) {
        status = Status::InvalidArgument(fmt::format("{} is given {} times, at most {} are possible", shown, value.size(), most));
      }
    } else if constexpr (std::is_same_v<T, std::vector<std::string>>) {
      value.clear();
      for (const std::string& text : texts) {
        const Result<std::vector<std::string>> names = ParseNames(shown, text);
        if (!names.ok()) return void(status = names.status());
        value.insert(value.end(), names->begin(), names->end());
      }
      if (value.size() > most) {
        status = Status::InvalidArgument(fmt::format("{} has {} names, at most {} are possible", shown, value.size(), most));
      }
    } else if constexpr (requires { Read(texts.back(), value); }) {
      Read(texts.back(), value);
    } else {
      CHECK(false) << option.path << " has no form as a text";
    }
  }
};

// Texts of a member, whatever its standard is.
std::string Text(double value) { return fmt::format("{}", value); }
std::string Text(float value) { return fmt::format("{}", value); }
std::string Text(int value) { return fmt::format("{}", value); }
std::string Text(bool value) { return value ? "true" : "false"; }
std::string Text(const std::string& value) { return value; }
template <class T>
std::string Text(const T& value) requires requires {
  TextOf(value);
}
{ return TextOf(value); }

template <class T>
std::vector<std::string> Texts(const FieldAbout& field, const T& value) {
  if constexpr (std::is_same_v<T, bool>) {
    return value ? std::vector<std::string>{"true"} : std::vector<std::string>{};
  } else if constexpr (requires { value.number(); }) {
    return {field.words.at(std::size_t(value.number()) - 1)};
  } else if constexpr (requires { value.index(); }) {
    if (const auto* preset = std::get_if<std::string>(&value)) return {*preset};
    return {kColorMapFile};
  } else if constexpr (Items<T>) {
    std::vector<std::string> texts;
    for (const auto& item : value) texts.push_back(TextOf(item));
    return texts;
  } else if constexpr (requires { value.has_value(); }) {
    if constexpr (requires { Text(*value); }) {
      return value ? std::vector<std::string>{Text(*value)} : std::vector<std::string>{};
    } else {
      return {};
    }
  } else if constexpr (requires { Text(value); }) {
    const std::string text = Text(value);
    return text.empty() ? std::vector<std::string>{} : std::vector<std::string>{text};
  } else {
    return {};
  }
}

// ---- one field of the looks of single channels

std::vector<std::string> TextsOfLook(std::string_view path, const FieldChoice& look) {
  std::vector<std::string> texts;
  At(path, look, [&](const FieldAbout& field, const auto& member, std::size_t) { texts = Texts(field, member); });
  return texts;
}

Status SetOfFields(const RequestOption& option, const std::string& shown, std::span<const std::string> texts, ColorMaps maps,
                   FrameRequest& request) {
  const std::string_view path = std::string_view(option.path).substr(kOfFields.size());
  Status status;
  std::set<std::string> named;
  for (const std::string& text : texts) {
    const Result<std::vector<NamedText>> items = ParseNamedTexts(shown, text);
    if (!items.ok()) return items.status();
    for (const auto& [name, value] : *items) {
      FieldChoice& look = ChoiceOf(name, request);
      const bool said = TextsOfLook(path, look) != TextsOfLook(path, {});  // by a short form
      if (!named.insert(name).second || said) return Status::InvalidArgument(fmt::format("{} names '{}' twice", shown, name));
      if (value.empty()) return Status::InvalidArgument(fmt::format("{} '{}' has no value for '{}'", shown, text, name));
      At(path, look, [&](const FieldAbout& field, auto& member, std::size_t most) {
        const RequestOption of_one{.path = option.path, .value = "VALUE", .range = NumberRange{field.least, field.most}};
        OptionReader reader{.option = of_one, .shown = fmt::format("{} {}:", shown, name), .maps = maps, .most = most};
        reader.ReadAll(std::span(&value, 1), member);
        status = reader.status;
      });
      if (!status.ok()) return status;
    }
  }
  return Status::Ok();
}

// A look that says nothing still names its channel. One that is not shown has no opacity.
std::vector<std::string> TextsOfFields(const RequestOption& option, const FrameRequest& request) {
  const std::string_view path = std::string_view(option.path).substr(kOfFields.size());
  std::string joined;
  for (std::size_t i = 0; i < request.fields.size(); ++i) {
    FieldChoice look = request.fields[i];
    const bool bare = look == FieldChoice{.field = look.field};
    if (!look.shown.value_or(true)) look.weight = 0;
    const std::vector<std::string> texts = TextsOfLook(path, look);
    if (texts == TextsOfLook(path, {}) && !(bare && path == "weight")) continue;
    const bool map = texts.front() == kColorMapFile && path == "preset";
    joined += fmt::format("{}{}={}", joined.empty() ? "" : ",", TextOfName(look.field), map ? ChannelMapFile(i) : texts.front());
  }
  return joined.empty() ? std::vector<std::string>{} : std::vector{joined};
}

std::vector<std::string> AllTextsOf(const RequestOption& option, const FrameRequest& request) {
  if (IsOfChannels(option.path)) return TextsOfFields(option, request);
  std::vector<std::string> texts;
  At(option.path, request, [&](const FieldAbout& field, const auto& member, std::size_t) { texts = Texts(field, member); });
  return texts;
}

const std::string* ParameterOf(const RequestOption& option, const FrameRequest& request) {
  const auto found = request.parameters.find(option.name);
  return found == request.parameters.end() ? nullptr : &found->second;
}

bool IsParameter(const RequestOption& option) { return option.path.starts_with(kParameters); }

}  // namespace

const std::vector<RequestOption>& RequestOptions() {
  static const std::vector<RequestOption> kTable = [] {
    std::vector<RequestOption> table;
    Collect("", "", FrameRequest(), table);
    return table;
  }();
  return kTable;
}

const RequestOption* FindRequestOption(std::string_view name) {
  std::string wanted(name);
  std::ranges::replace(wanted, '_', '-');
  const auto found = std::ranges::find(RequestOptions(), wanted, &RequestOption::name);
  return found == RequestOptions().end() ? nullptr : &*found;
}

Status SetOption(const RequestOption& option, const std::string& shown, std::span<const std::string> texts, ColorMaps maps,
                 FrameRequest& request) {
  if (IsParameter(option)) {
    request.parameters[option.name] = texts.back();
    return Status::Ok();
  }
  if (IsOfChannels(option.path)) return SetOfFields(option, shown, texts, maps, request);
  Status status;
  if (option.path.starts_with(kOfLabels)) (void)ShownLabels(request);
  At(option.path, request, [&](const FieldAbout&, auto& member, std::size_t most) {
    OptionReader reader{.option = option, .shown = shown, .maps = maps, .most = most};
    reader.ReadAll(texts, member);
    status = reader.status;
  });
  return status;
}

std::vector<std::string> TextsOf(const RequestOption& option, const FrameRequest& request) {
  if (IsParameter(option)) {
    const std::string* text = ParameterOf(option, request);
    return text == nullptr ? std::vector<std::string>{} : std::vector{*text};
  }
  static const FrameRequest kStandard = [] {
    FrameRequest standard;
    standard.view = kUnstatedView;
    ShownLabels(standard) = {};
    return standard;
  }();
  std::vector<std::string> texts = AllTextsOf(option, request);
  if (option.name != "label-mode" && texts == AllTextsOf(option, kStandard)) return {};
  return texts;
}

std::map<std::string, std::string> MapFilesOf(const FrameRequest& request) {
  std::map<std::string, std::string> files;
  const auto add = [&files](const std::string& name, const auto& shown) {
    if (const auto* function = std::get_if<TransferFunction>(&shown.choice)) files[name] = FormatParaViewColorMap(*function, name);
  };
  add(kColorMapFile, request.transfer);
  for (std::size_t i = 0; i < request.fields.size(); ++i) add(ChannelMapFile(i), request.fields[i]);
  return files;
}

std::optional<std::vector<std::string>> TextsOfJson(const Json& value, bool repeatable) {
  const auto dumped = [](const Json& json) { return json.dump(-1, true); };
  const auto text_of = [&](const Json& item) -> std::optional<std::string> {
    if (item.is_string()) return item.get<std::string>();
    if (item.is_boolean()) return item.get<bool>() ? "true" : "false";
    if (item.is_number_integer() || item.is_object()) return dumped(item);
    if (item.is_number()) return fmt::format("{}", item.get<double>());  // the fewest digits that read back the same
    if (!item.is_array() || item.empty()) return std::nullopt;
    if (item.front().is_object()) return dumped(item);  // a colour map
    std::string joined;
    for (const Json& number : item) {
      if (!number.is_number()) return std::nullopt;
      joined += fmt::format("{}{}", joined.empty() ? "" : ",", number.get<double>());
    }
    return joined;
  };
  const bool list = repeatable && value.is_array() && !std::ranges::all_of(value, [](const Json& item) { return item.is_number(); });
  std::vector<std::string> texts;
  for (const Json& item : list ? value : Json::array({value})) {
    std::optional<std::string> text = text_of(item);
    if (!text) return std::nullopt;
    texts.push_back(*std::move(text));
  }
  return texts;
}

std::vector<std::pair<std::string, JsonValue::Read>> OptionFields(FrameRequest& request, std::initializer_list<std::string_view> places) {
  std::vector<std::pair<std::string, JsonValue::Read>> fields;
  for (const RequestOption& option : RequestOptions()) {
    if (std::ranges::none_of(places, [&](std::string_view place) { return option.path.starts_with(place); })) continue;
    fields.emplace_back(option.name, [&request, &option](const JsonValue& value) {
      const auto texts = TextsOfJson(value.json(), option.repeatable);
      if (!texts || texts->empty()) return value.Complain(fmt::format("{} is no value of '{}'", value.Shown(), option.name));
      if (const Status status = SetOption(option, option.name, *texts, ColorMaps::kTexts, request); !status.ok()) {
        value.Complain(status.message());
      }
    });
  }
  return fields;
}

Json OptionsJson(const FrameRequest& request, std::string_view place) {
  Json json = Json::object();
  for (const RequestOption& option : RequestOptions()) {
    if (!option.path.starts_with(place)) continue;
    const std::vector<std::string> texts = TextsOf(option, request);
    if (texts.empty()) continue;
    if (option.flag()) {
      json[option.name] = texts.front() == "true";
    } else if (option.range) {
      json[option.name] = Json::Parse(texts.front()).value();
    } else {
      json[option.name] = option.repeatable ? Json(texts) : Json(texts.front());
    }
  }
  return json;
}

}  // namespace slabstream
