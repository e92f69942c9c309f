#include "gateway/openapi.h"

#include <string>
#include <string_view>
#include <vector>

#include "client/request/picture_fields.h"
#include "common/base/version.h"

namespace slabstream {
namespace {

Json SchemaOf(const FieldDescription& field) {
  Json schema = {{"type", field.value.empty() ? "boolean" : field.value == "NUMBER" ? "number" : "string"}};
  if (field.repeated) return {{"type", "array"}, {"items", std::move(schema)}};
  return schema;
}

std::string DescriptionOf(const FieldDescription& field) {
  std::string text = field.purpose;
  if (!field.value.empty()) text += " [" + field.value + "]";
  if (!field.standard.empty()) text += " (default: " + field.standard + ")";
  return text;
}

Json Parameters(const std::vector<FieldDescription>& fields) {
  Json parameters = Json::array();
  for (const FieldDescription& field : fields) {
    parameters.push_back({{"name", field.name},
                          {"in", "query"},
                          {"required", field.name == "dataset"},
                          {"description", DescriptionOf(field)},
                          {"x-group", field.group},
                          {"schema", SchemaOf(field)}});
  }
  return parameters;
}

Json Body(const std::vector<FieldDescription>& fields) {
  Json properties = Json::object();
  for (const FieldDescription& field : fields) {
    Json property = SchemaOf(field);
    property["description"] = DescriptionOf(field);
    properties[field.name] = std::move(property);
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
  responses["403"] = failure("Host or Origin is foreign");
  if (takes_options) responses["404"] = failure("There is no such dataset");
  if (takes_options) responses["429"] = failure("Too many pictures are under way");
  responses["503"] = failure("The service does not answer, has no worker, or not enough memory");
  if (takes_options) responses["504"] = failure("The picture was not ready in time");
  return responses;
}

struct Operation {
  const char *path, *summary, *type;
  bool open = false;
  std::vector<FieldDescription> fields = {};
};

Json Describe(const Operation& operation) {
  const bool picture = std::string_view(operation.type) == "image/png";
  const Json schema = picture ? Json{{"type", "string"}, {"format", "binary"}}
                              : Json{{"type", std::string_view(operation.type) == "application/json" ? "object" : "string"}};
  const bool options = !operation.fields.empty();
  Json get = {{"summary", operation.summary}, {"responses", Responses(operation.type, operation.open, schema, options)}};
  if (operation.open) get["security"] = Json::array();
  if (!options) return {{"get", std::move(get)}};
  Json post = get;
  get["parameters"] = Parameters(operation.fields);
  post["requestBody"] = Body(operation.fields);
  return {{"get", std::move(get)}, {"post", std::move(post)}};
}

}  // namespace

Json OpenApi() {
  const Operation operations[] = {
      {"/livez", "The gateway runs", "text/plain", true},
      {"/readyz", "The service answers and has a worker", "text/plain", true},
      {"/metrics", "Counters and histograms for Prometheus", "text/plain"},
      {"/api/v1/openapi.json", "This document", "application/json", true},
      {"/api/v1/status", "The service: workers, frames, memory", "application/json"},
      {"/api/v1/datasets", "The datasets of the service", "application/json"},
      {"/api/v1/render.png", "A picture, as `slabstream render` makes it", "image/png", false, RenderFields()},
      {"/api/v1/slice.png", "Planes through a volume, as `slabstream slice` makes them", "image/png", false, SliceFields()},
      {"/api/v1/command", "The command line that makes a picture", "application/json", false, RenderFields()},
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
