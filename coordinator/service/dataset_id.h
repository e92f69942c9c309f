// What names a dataset in messages: the same volume under the same name has the same id in every life of every coordinator, so that workers
// may keep its voxels when a coordinator starts anew. Other voxels, another description of them, or other labels have another id.
#pragma once

#include <string>

#include "common/frame/frame_setup.h"
#include "common/mesh/mesh_part.h"
#include "common/volume/labels.h"
#include "data/volume_io/exact_samples.h"

namespace slabstream {

// Reads every voxel once. `exact`: its exact samples; null: those of the volume are. `cells`: of a grid. Not 0.
DatasetId IdOf(const std::string& name, const Volume& volume, const LabelTable* labels = nullptr, const ExactSamples* exact = nullptr,
               const GridCells* cells = nullptr);
// The number of voxels that nobody has read: their files have another version if they are other voxels. `name` is that
// of the dataset, or of one level of it.
DatasetId IdOf(const std::string& name, const VolumeDescription& description, const StoredAt& stored);

}  // namespace slabstream
