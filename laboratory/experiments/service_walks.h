// Walks at a running service: its frames are measured as a client sees them, with its own balance. Nothing is rendered here.
#pragma once

#include <vector>

#include "client/client.h"
#include "laboratory/experiments/track.h"

namespace slabstream {

// Whether a service can be led along the path: a slow worker and a time series cannot be asked for.
bool IsPossibleAtService(const Path& path);

// Walks twice: with one frame in flight, and with frames requested ahead. What the service has learnt before, it knows: for a walk that
// begins with nothing, start the service anew.
Trial ServiceWalkTrial(Client& client, const StatusReply& begin, const Walk& walk);

// The trial must have been run.
std::vector<Track> RecallServiceWalk(const TrialLog& log, const StatusReply& begin, const Walk& walk);

}  // namespace slabstream
