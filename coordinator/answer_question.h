// The answers to questions about what a dataset holds. Pure; they may take milliseconds.
#pragma once

#include "coordinator/dataset_machine.h"
#include "coordinator/voxel_server.h"

namespace slabstream {

// Errors: as of ResolveRequest and MakeFrameSetup. `samples`: neither, if the dataset has gone meanwhile, which is Unavailable.
Result<QuestionReply> AnswerTo(const AnswerQuestion& asked, const VoxelServer::Samples& samples);

}  // namespace slabstream
