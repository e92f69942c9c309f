// What measurements at a running service share: its roster and its datasets decide the numbers beside the requests.
#pragma once

#include <span>

#include "client/client.h"
#include "laboratory/experiments/frame_case.h"
#include "laboratory/results/results.h"

namespace slabstream {

// [{"host", "threads"}, ...], in the order of hosts.
Json RosterOf(const StatusReply& status);

// What decides numbers beside the requests: the roster, and the datasets of `volumes`. Throws Failure: those of
// ServiceConnection::OpenService and Client::QueryStatus; Unavailable: no workers; NotFound: a dataset that the service does not have.
Json DescribeService(const ServiceChoice& service, std::span<const BenchCase> volumes);

// Throws Failure (Unavailable) if it is not what it was at `begin`.
void CheckRoster(Client& client, const StatusReply& begin);

// The table `roster`: each worker with its host and threads.
void AttachRoster(Results& results, const Json& roster);

// As many frames as keep all workers busy.
int FramesInFlight(int workers, const FrameCase& frame);

}  // namespace slabstream
