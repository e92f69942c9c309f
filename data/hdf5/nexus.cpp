// Data of NeXus: a group of the class NXdata, whose attribute `signal` names the dataset and `axes` the datasets with the coordinates of
// its axes. The attributes `default` lead to it from the root. Source: https://manual.nexusformat.org/datarules.html
#include "data/hdf5/hdf5_image.h"

namespace slabstream {
namespace {

std::string ClassOf(AttributedFile& file, const std::string& group) { return file.Text(group, "NX_class").value_or(""); }

Result<std::vector<std::string>> Images(AttributedFile& file) {
  constexpr int kMostSteps = 8;
  std::string group;
  for (int step = 0; step < kMostSteps; ++step) {
    const std::string name = group.empty() ? "/" : group;
    const std::string signal = file.Text(name, "signal").value_or(""), next = file.Text(name, "default").value_or("");
    if (!signal.empty() && ClassOf(file, name) == "NXdata" && file.Has(group + "/" + signal)) return std::vector{group + "/" + signal};
    if (next.empty() || !file.Has(group + "/" + next)) break;
    group += "/" + next;
  }
  return std::vector<std::string>{};
}

Result<std::optional<ImageDescription>> Describe(AttributedFile& file, const DatasetFacts& dataset) {
  const std::string group = dataset.path.substr(0, dataset.path.rfind('/'));
  const std::optional<std::vector<std::string>> axes = file.Texts(group.empty() ? "/" : group, "axes");
  if (!axes || axes->size() != dataset.size.size() || ClassOf(file, group.empty() ? "/" : group) != "NXdata") {
    return std::optional<ImageDescription>();
  }
  std::vector<std::string> scales;
  for (const std::string& name : *axes) scales.push_back(name == "." ? "" : group + "/" + name);
  Result<ImageDescription> image = DescribeByAttributes(file, dataset, std::move(scales));
  if (!image.ok()) return image.status();
  image->format = "NeXus";
  return std::optional(*std::move(image));
}

}  // namespace

ImageLayout Nexus() { return {Images, Describe}; }

}  // namespace slabstream
