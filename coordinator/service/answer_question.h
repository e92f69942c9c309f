// The answers to questions about what a dataset holds. They may take milliseconds, and longer if voxels are read for them.
#pragma once

#include <vector>

#include "coordinator/datasets/dataset_machine.h"
#include "coordinator/service/voxel_server.h"

namespace slabstream {

// Errors: as of ResolveRequest and MakeFrameSetup. `samples`: neither, if the dataset has gone meanwhile, which is Unavailable.
// Any thread.
// `others`: of the other fields of `asked`, if it is about points. `labels`: of its labels. `shapes`: of the shapes of its picture, then of
// the planes.
Result<QuestionReply> AnswerTo(const AnswerQuestion& asked, const VoxelServer::Samples& samples,
                               const std::vector<VoxelServer::Samples>& others = {}, const VoxelServer::Samples& labels = {},
                               const std::vector<VoxelServer::Samples>& shapes = {});

}  // namespace slabstream
