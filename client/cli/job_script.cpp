#include "client/cli/job_script.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "client/request/shell_word.h"
#include "common/base/printable.h"

namespace slabstream {
namespace {

constexpr std::string_view kPreamble = R"(#!/bin/bash
# Slabstream on a cluster: a Slurm job array, made by `slabstream slurm` to be read and edited, and submitted with sbatch.
#
# Every element of the array runs workers on a node of its own. Element 0 also runs the coordinator, which writes the
# service files into a folder that all nodes share; workers wait for worker.json there. It is an array, not one job of many
# nodes, so that Slurm starts, preempts, requeues and cancels each node alone. Pictures stay the same when workers come and
# go.
)";

// What follows the values. It uses: programs, folder, data, dataset, workers, threads, drain, patience.
constexpr std::string_view kBody = R"(
service_file() { cat "$folder/worker.json" 2> /dev/null; }

# Whether the service has ended, or its coordinator has written another service file than $1.
is_over() {
  local current
  [[ -e "$folder/ended" ]] || { current=$(service_file) && [[ "$current" != "$1" ]]; }
}

# Runs the workers of this node until the service ends. A coordinator that was requeued runs elsewhere: it writes another
# service file, and the workers restart. After a notice the workers leave, but this waits on: Slurm does not requeue a
# preempted job that ends by itself.
run_workers() {
  local file="" waited step
  # srun --overlap, where Slurm knows it: else srun may wait minutes for a step of workers that have ended.
  export SLURM_OVERLAP=1
  while true; do
    waited=0
    until is_over "$file"; do
      if ((waited++ >= patience)); then
        echo "No coordinator for $patience s: there is no new $folder/worker.json." >&2
        return 1
      fi
      sleep 1
    done
    [[ ! -e "$folder/ended" ]] || return 0
    file=$(service_file)
    srun --ntasks="$workers" --cpus-per-task="$threads" --kill-on-bad-exit=0 --wait=0 \
      "$programs/slabstream-worker" --service "$folder/worker.json" --threads "$threads" --memory 1/$((2 * workers)) \
        --drain "$drain" < /dev/null &
    step=$!
    while kill -0 "$step" 2> /dev/null && ! is_over "$file"; do sleep 1; done
    if kill -0 "$step" 2> /dev/null; then
      # The workers of this element, not this script. $SLURM_JOB_ID would not do: the last element's is that of the array.
      scancel --quiet --signal=TERM "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID"
      wait "$step"
    else
      wait "$step" || return # a worker failed
    fi
  done
}

# The address at which other nodes reach this one: the one that Slurm uses. A host may know its own name by a loopback
# address; then its first other address. To use a faster network, print this node's address there instead.
own_address() {
  local node address
  node=$(scontrol --oneliner show node "$SLURMD_NODENAME" | grep -o 'NodeAddr=[^ ]*')
  for address in $(getent ahosts "${node#*=}" | awk '{ print $1 }') $(hostname -I); do
    case "$address" in
      127.* | ::1 | fe80:*) ;;
      *:*) echo "[$address]" && return ;;
      *) echo "$address" && return ;;
    esac
  done
}

tell_user() { # the coordinator's HOST:PORT
  local file
  file=$(printf '%q' "$folder/client.json")
  cat << END
Slabstream listens at $1, coordinator on $SLURMD_NODENAME.
Where this folder is shared:
  slabstream render $dataset -o picture.png --service $file
On another machine, with a copy of the file and a tunnel:
  scp $SLURM_SUBMIT_HOST:$file .
  ssh -N -L 7420:$1 $SLURM_SUBMIT_HOST
  slabstream render $dataset -o picture.png --service client.json --endpoint tcp://127.0.0.1:7420
To end it:
  slabstream down --service $(printf '%q' "$folder/admin.json")
END
}

if ((SLURM_ARRAY_TASK_ID > 0)); then
  run_workers
  exit
fi

ended_by_slurm=no
trap 'ended_by_slurm=yes' TERM
[[ -d "$folder" ]] || mkdir -m 700 "$folder"
rm -f "$folder/ended"
exec 3< <(exec "$programs/slabstream-coordinator" --listen "tcp://$(own_address):*" --keys "$folder" "${data[@]}" < /dev/null)
coordinator=$!
if read -r _ _ client _ <&3; then # blocks until the coordinator is ready or has ended
  tell_user "${client#client=tcp://}"
  run_workers &
fi
status=1
while kill -0 "$coordinator" 2> /dev/null; do # a trap ends `wait` early
  wait "$coordinator"
  status=$?
done
if [[ "$ended_by_slurm" == no ]]; then # nobody will restart the coordinator
  touch "$folder/ended"
  scancel --quiet --state=PENDING "$SLURM_ARRAY_JOB_ID"
  wait
fi
exit "$status"
)";

}  // namespace

Result<std::string> ParseDirective(std::string_view text) {
  constexpr std::array<std::string_view, 3> kDecided = {"array", "nodes", "ntasks"};
  const auto refused = [text](std::string_view why) {
    return Printable(Status::InvalidArgument(fmt::format("option '{}' of sbatch {}", text, why)));
  };
  if (std::ranges::any_of(text, [](unsigned char c) { return c < ' ' || c == 0x7f; })) return refused("has a control character");
  const std::string_view option = text.starts_with("--") ? text.substr(2) : text;
  if (std::ranges::find(kDecided, option.substr(0, option.find('='))) != kDecided.end())
    return refused("is decided by --nodes and --workers-per-node");
  return fmt::format("--{}", option);
}

std::string JobScript(const SlurmOptions& options, const std::string& dataset, const std::string& programs) {
  std::string text(kPreamble);
  const auto directive = [&text](std::string_view line) { text += fmt::format("#SBATCH {}\n", line); };
  directive("--job-name=slabstream");
  directive(fmt::format("--array=0-{}", options.nodes - 1));
  directive("--nodes=1");
  directive(fmt::format("--ntasks={}", options.workers_per_node));
  if (options.threads > 0) {
    directive(fmt::format("--cpus-per-task={}", options.threads));
  } else {
    directive("--exclusive");
    directive("--mem=0");
  }
  directive(fmt::format("--signal=TERM@{}", options.notice_seconds));
  directive("--requeue");
  directive("--open-mode=append");
  for (const std::string& line : options.directives) directive(line);
  text += "set -u\n\n";

  text += fmt::format("programs={}\n", ShellWord(programs));
  text += fmt::format("folder={}/slabstream-$SLURM_ARRAY_JOB_ID # one for each job; whoever reads it controls the service\n",
                      options.folder.empty() ? "$SLURM_SUBMIT_DIR" : ShellWord(options.folder));
  text += "data=(";
  for (const std::string& data : options.data) text += fmt::format("{}--data {}", text.ends_with('(') ? "" : " ", ShellWord(data));
  text += fmt::format(")\ndataset={}\nworkers={}\n", ShellWord(dataset), options.workers_per_node);
  text += fmt::format("threads={}\n", options.threads > 0 ? std::to_string(options.threads) : "$((SLURM_CPUS_ON_NODE / workers))");
  text += fmt::format("drain={}s # for workers to finish their work after a notice\n", options.notice_seconds - options.notice_seconds / 4);
  text += "patience=600 # seconds without a coordinator after which workers end\n";
  return text + std::string(kBody);
}

}  // namespace slabstream
