// Frames of a running service, each for itself or as walks, measured as its client sees them, with its own balance. Nothing is rendered or
// simulated here. The service's roster and datasets decide the numbers beside the requests.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "client/client.h"
#include "laboratory/experiments/frame_case.h"
#include "laboratory/experiments/track.h"
#include "laboratory/results/results.h"

namespace slabstream {

// [{"host", "threads"}, ...], in the order of hosts.
Json RosterOf(const StatusReply& status);

// The roster, and the datasets of `volumes`. Throws Failure: those of
// ServiceConnection::OpenService and Client::QueryStatus; Unavailable: no workers; NotFound: a dataset that the service does not have.
Json DescribeService(const ServiceChoice& service, std::span<const BenchCase> volumes);

// Throws Failure (Unavailable) if it is not what it was at `begin`.
void CheckRoster(Client& client, const StatusReply& begin);

// The table `roster`: each worker with its host and threads.
void AttachRoster(Results& results, const Json& roster);

// As many frames as keep all workers busy.
int FramesInFlight(int workers, const FrameCase& frame);

struct ServedFrame {
  FrameCase frame;
  Json columns;  // of its results
};

// Measures frames at the service that the user named, each over and over: with one in flight, and with as many as keep all workers busy.
// `frames`: of as many workers as the service has. Adds measured latency, period,
// render_time, longest_render_time, picture_time, imbalance, idle_share and image_bytes of each, and the stage_time of the worker that
// renders longest; attaches the roster. Throws Failure, also if the roster changes meanwhile.
void MeasureAtService(ExperimentContext& context, Results& results, const std::function<std::vector<ServedFrame>(int workers)>& frames);

// Whether a service can be led along the path: a slow worker and a time series cannot be asked for.
bool IsPossibleAtService(const Path& path);

// Walks twice: with one frame in flight, and with frames requested ahead. What the service has learnt before, it knows: for a walk that
// begins with nothing, start the service anew.
Trial ServiceWalkTrial(Client& client, const StatusReply& begin, const Walk& walk);

// The trial must have been run.
std::vector<Track> RecallServiceWalk(const TrialLog& log, const StatusReply& begin, const Walk& walk);

}  // namespace slabstream
