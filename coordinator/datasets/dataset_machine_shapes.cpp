#include <fmt/format.h>

#include <memory>

#include "common/view/clip.h"
#include "coordinator/datasets/dataset_machine_state.h"

namespace slabstream {

std::vector<DatasetMachine::State::Use::Entry> DatasetMachine::State::NamedShapes(const FrameRequest& request) {
  std::vector<Use::Entry> shapes;
  for (const ShapeChoice& shape : request.shapes) shapes.push_back({shape.shape});
  return shapes;
}

std::vector<DatasetMachine::State::Use::Entry> DatasetMachine::State::SeekShapes(const FrameRequest& request) {
  std::vector<Use::Entry> shapes = NamedShapes(request);
  for (Use::Entry& shape : shapes) shape.check = Seek(shape.name);
  return shapes;
}

// The entries of shapes with several times become those of the picture's time. False: some are not ready. InvalidArgument: a shape does not
// have the time; or it has several times, but not as many as the dataset.
Result<bool> DatasetMachine::State::SeekAtTime(const FrameRequest& request, int time, std::vector<Use::Entry>& shapes) {
  bool ready = true;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const ShapeChoice& choice = request.shapes[i];
    const DatasetTable::Entry& shape = *datasets.Find(choice.shape);
    const bool is_open = shape.state == DatasetState::kReady;
    const int times = is_open && shape.fields != nullptr ? shape.fields->times.count : 1;
    if (is_open && choice.time.value_or(0) >= times)
      return Status::InvalidArgument(fmt::format("shape '{}' has time {}, must be in [0, {}]", choice.shape, *choice.time, times - 1));
    if (times > 1) {
      const DatasetTable::Entry* const dataset = datasets.Find(request.dataset);
      const int of_dataset = dataset != nullptr && dataset->fields != nullptr ? dataset->fields->times.count : 1;
      if (!choice.time && of_dataset > 1 && of_dataset != times) {
        return Status::InvalidArgument(fmt::format("shape '{}' has {} times, must have one or {}, as dataset \"{}\"; time=N shows one",
                                                   choice.shape, times, of_dataset, request.dataset));
      }
      const int number = choice.time.value_or(of_dataset > 1 ? time : shape.fields->time);
      const Result<FieldSource> source = SourceOf(choice.shape, shape.fields->field, number);
      if (!source.ok()) return source.status();
      if (shapes[i].name != source->entry) shapes[i] = {source->entry, Seek(source->entry)};
    }
    ready = ready && datasets.Find(shapes[i].name)->state == DatasetState::kReady;
  }
  return ready;
}

// The planes of a picture, through the voxels of an entry that is ready. `finest`: of the volume, if it has levels.
std::vector<DatasetMachine::State::Use::Entry> DatasetMachine::State::SeekPlanes(const FrameRequest& request, const VolumeGeometry& finest,
                                                                                 const std::string& through) {
  std::vector<Use::Entry> planes;
  const DatasetTable::Entry& voxels = *datasets.Find(through);
  for (const PlaneChoice& plane : request.planes) {
    ClipSlab slab = plane.slab;
    slab.through = MiddleOf(slab, finest);
    slab.index.reset();
    DataSource source;
    source.plane = std::make_shared<const PlaneOfVoxels>(PlaneOfVoxels{slab, voxels.id, voxels.summary});
    const std::string name = PlaneName(through, slab);
    parts_came |= datasets.AddPart(name, std::move(source), now);
    planes.push_back({name, Seek(name)});
  }
  return planes;
}

}  // namespace slabstream
