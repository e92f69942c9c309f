#include "gateway/openapi.h"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <string>
#include <string_view>

#include "client/movie/turntable.h"
#include "client/request/picture_fields.h"
#include "common/base/version.h"
#include "gateway/movie_requests.h"

namespace slabstream {
namespace {

// Fields are as DescribeOptions has them.

std::string TextOf(const Json& field, const char* name) { return field.value(name, std::string()); }

Json SchemaOf(const Json& field) {
  const std::string type = TextOf(field, field.contains("optional_value") ? "optional_value" : "type");
  Json schema = {{"type", type.empty() ? "boolean" : type == "NUMBER" ? "number" : type == "N" ? "integer" : "string"}};
  if (field.contains("choices")) schema["enum"] = field["choices"];
  if (field.contains("max") && schema["type"] != "string") {
    schema["minimum"] = field.contains("above") ? field["above"] : field["min"];
    if (field.contains("above")) schema["exclusiveMinimum"] = true;
    schema["maximum"] = field["max"];
  }
  if (field.contains("repeatable")) return {{"type", "array"}, {"items", std::move(schema)}};
  return schema;
}

std::string DescriptionOf(const Json& field) {
  std::string text = TextOf(field, "help");
  if (field.contains("type")) text += " [" + TextOf(field, "type") + "]";
  if (field.contains("optional_value")) text += " [true, or " + TextOf(field, "optional_value") + "]";
  if (field.contains("default")) text += " (default: " + TextOf(field, "default") + ")";
  return text;
}

Json Parameters(const Json& fields) {
  Json parameters = Json::array();
  for (const Json& field : fields) {
    parameters.push_back({{"name", field["name"]},
                          {"in", "query"},
                          {"required", field.contains("required")},
                          {"description", DescriptionOf(field)},
                          {"x-group", field["group"]},
                          {"schema", SchemaOf(field)}});
  }
  return parameters;
}

Json Body(const Json& fields) {
  Json properties = Json::object();
  for (const Json& field : fields) {
    Json property = SchemaOf(field);
    property["description"] = DescriptionOf(field);
    properties[TextOf(field, "name")] = std::move(property);
  }
  return {{"required", false},
          {"content", {{"application/json", {{"schema", {{"type", "object"}, {"properties", std::move(properties)}}}}}}}};
}

Json Responses(const char* type, bool open, const Json& schema, bool takes_options) {
  const auto failure = [](const char* when) {
    return Json{{"description", when}, {"content", {{"application/json", {{"schema", {{"$ref", "#/components/schemas/Error"}}}}}}}};
  };
  Json responses = {{"200", {{"description", "As asked"}, {"content", {{type, {{"schema", schema}}}}}}}};
  if (takes_options) responses["400"] = failure("An option is wrong");
  if (!open) responses["401"] = failure("The token is missing or wrong");
  responses["403"] = failure("Host or Origin is foreign, or the token does not give this");
  if (takes_options) responses["404"] = failure("There is no such dataset");
  if (takes_options) responses["429"] = failure("Too many pictures or questions are under way");
  responses["503"] = failure("The service does not answer, has no worker, or not enough memory");
  if (std::string_view(type) == "video/mp4") responses["501"] = failure("The gateway's host lacks the program ffmpeg");
  if (takes_options) responses["504"] = failure("The answer was not ready in time");
  return responses;
}

struct Operation {
  const char* path;
  std::string summary;
  const char* type;
  bool open = false;
  Json fields = Json::array();
  bool takes_post = false;
  bool takes_bytes = false;  // by POST alone
};

// Those of `fields` with these names.
Json Named(const Json& fields, std::initializer_list<std::string_view> names) {
  Json named = Json::array();
  for (const Json& field : fields) {
    if (std::find(names.begin(), names.end(), TextOf(field, "name")) != names.end()) named.push_back(field);
  }
  return named;
}

// A field replaces one of the same name.
Json With(const Json& fields, std::initializer_list<Json> more) {
  Json all = Json::array();
  const auto is_kept = [&](const Json& field) {
    return std::ranges::none_of(more, [&](const Json& other) { return TextOf(other, "name") == TextOf(field, "name"); });
  };
  for (const Json& field : fields) {
    if (is_kept(field)) all.push_back(field);
  }
  for (const Json& field : more) all.push_back(field);
  return all;
}

Json Describe(const Operation& operation) {
  const bool binary = std::string_view(operation.type) == "image/png" || std::string_view(operation.type) == "video/mp4";
  const Json schema = binary ? Json{{"type", "string"}, {"format", "binary"}}
                             : Json{{"type", std::string_view(operation.type) == "application/json" ? "object" : "string"}};
  const bool options = !operation.fields.empty();
  Json get = {{"summary", operation.summary}, {"responses", Responses(operation.type, operation.open, schema, options)}};
  if (operation.open) get["security"] = Json::array();
  if (!options) return {{"get", std::move(get)}};
  Json post = get;
  if (operation.takes_bytes) {
    post["parameters"] = Parameters(operation.fields);
    post["requestBody"] = {{"required", false},
                           {"content", {{"application/octet-stream", {{"schema", {{"type", "string"}, {"format", "binary"}}}}}}}};
    return {{"post", std::move(post)}};
  }
  get["parameters"] = Parameters(operation.fields);
  if (!operation.takes_post) return {{"get", std::move(get)}};
  post["requestBody"] = Body(operation.fields);
  return {{"get", std::move(get)}, {"post", std::move(post)}};
}

}  // namespace

Json OfferedOptions() { return {{"render", RenderFields()}, {"slice", SliceFields()}}; }

Json OpenApi() {
  const Json render = RenderFields(), dataset = Named(render, {"dataset"});
  const auto field = [](const char* name, const char* help, const char* type, const std::string& standard = "") {
    Json json = {{"name", name}, {"group", "Options"}, {"type", type}, {"help", help}};
    json[standard.empty() ? "required" : "default"] = standard.empty() ? Json(true) : Json(standard);
    return json;
  };
  const auto optional = [](const char* name, const char* help, const char* type) {
    return Json{{"name", name}, {"group", "Options"}, {"type", type}, {"help", help}};
  };
  const Json of_field =
      With(dataset, {optional("field", "Which channel, by its number or name (default: the first one that is shown)", "CHANNEL"),
                     optional("time", "Which time, as of a picture (default: that of the file, mostly the first)", "N|3.5s|last")});
  const Json path = {{"name", "path"}, {"group", "Options"}, {"type", "JSON"}, {"help", kPathHelp}};
  const Operation operations[] = {
      {"/livez", "The gateway runs", "text/plain", true},
      {"/readyz", "The service answers and has a worker", "text/plain", true},
      {"/metrics", "Counters and histograms for Prometheus", "text/plain"},
      {"/api/v1/openapi.json", "This document", "application/json", true},
      {"/api/v1/options", "The options of pictures and slices with their limits, as `slabstream options` prints them", "application/json",
       true},
      {"/api/v1/access", "What the token gives: rights, datasets, until when", "application/json"},
      {"/api/v1/status", "The service: workers, frames, memory", "application/json"},
      {"/api/v1/datasets", "The datasets of the service", "application/json"},
      {"/api/v1/render.png", "A picture, as `slabstream render` makes it; other endings make other files: " + PictureEndings(), "image/png",
       false, render, true},
      {"/api/v1/slice.png",
       "Planes through a volume, as `slabstream slice` makes them; other endings make other files: " + PictureEndings(), "image/png", false,
       SliceFields(), true},
      {"/api/v1/turntable.mp4", "A movie, as `slabstream turntable` makes it, sent while it is made", "video/mp4", false,
       With(render, {field("frames", kFramesHelp, "NUMBER", fmt::format("one for each time, or {}", kMovieFrames)),
                     field("turns", kTurnsHelp, "NUMBER", "1"),
                     field("fps", kFramesPerSecondHelp, "NUMBER", fmt::format("{:g}", MovieShape().frames_per_second)), path,
                     optional("time", kTimesHelp, kTimesValue)}),
       true},
      {"/api/v1/command", "The command line that makes a picture", "application/json", false, render, true},
      {"/api/v1/histogram", "The histogram of a dataset, its range and percentiles", "application/json", false, of_field},
      {"/api/v1/joint-histogram", "How often values occur together with slopes", "application/json", false, of_field},
      {"/api/v1/labels", "The labels of a dataset, with their names and colours", "application/json", false, dataset},
      {"/api/v1/value", "The voxel, value and label of a dataset at a point", "application/json", false,
       With(of_field, {field("at", kPointHelp, "X,Y,Z")})},
      {"/api/v1/profile", "The values of a dataset along a line, interpolated between its voxels", "application/json", false,
       With(of_field,
            {field("from", kLineHelp, "X,Y,Z"), field("to", kLineHelp, "X,Y,Z"),
             field("samples", "Number of points along the line, both ends included: 2 to 4096", "N", fmt::format("{}", kProfileSamples))})},
      {"/api/v1/statistics", "Mean, deviation and range of the values in a box, or of those of each label", "application/json", false,
       With(of_field,
            {field("box", kBoxHelp, "X0:X1,Y0:Y1,Z0:Z1", kWholeBox),
             {{"name", "labels"}, {"group", "Options"}, {"help", "The values of each label there, and its volume"}, {"default", "false"}},
             field("format", "Of labels: json, or csv for a table", "json|csv", "json")})},
      {"/api/v1/pick", "The point that a pixel of a picture shows, of the volume or of a shape", "application/json", false,
       With(render, {field("x", kPixelXHelp, "NUMBER"), field("y", kPixelYHelp, "NUMBER")}), true},
      {"/api/v1/transfer", "The colour map of a preset for a dataset, as `slabstream transfer` prints it", "application/json", false,
       With(of_field, {Named(render, {"transfer"})[0], Named(render, {"scalar-range"})[0]})},
      {"/api/v1/parameters", "How far a simulation is that holds a dataset, and its parameters; by POST they change", "application/json",
       false, With(dataset, {optional("set", "By POST: new values of parameters", "NAME=VALUE,...")}), true},
      {"/api/v1/upload", "Sends a file that becomes a dataset, in parts (docs/http.md)", "application/json", false,
       Json::array({optional("file", "To begin: the name of the file, whose ending says its format", "NAME"),
                    optional("bytes", "To begin: the size of the file", "N"), optional("upload", "Then: what the first answer says", "ID"),
                    optional("begin", "Then: where in the file the body begins", "N"), optional("drop", "Remove the dataset", "true")}),
       false, true},
  };
  Json paths = Json::object();
  for (const Operation& operation : operations) paths[operation.path] = Describe(operation);
  return {
      {"openapi", "3.0.3"},
      {"info", {{"title", "Slabstream gateway"}, {"version", Version()}, {"description", "docs/http.md explains it, and the WebSocket."}}},
      {"servers", Json::array({{{"url", "../.."}}})},
      {"security", Json::array({{{"bearer", Json::array()}}, {{"query", Json::array()}}})},
      {"paths", std::move(paths)},
      {"components",
       {{"securitySchemes",
         {{"bearer", {{"type", "http"}, {"scheme", "bearer"}}}, {"query", {{"type", "apiKey"}, {"in", "query"}, {"name", "token"}}}}},
        {"schemas",
         {{"Error",
           {{"type", "object"},
            {"required", {"error"}},
            {"properties", {{"error", {{"type", "string"}, {"description", "The reason, one line"}}}}}}}}}}}};
}

}  // namespace slabstream
