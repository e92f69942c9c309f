#include <algorithm>

#include "common/frame/dataset_name.h"
#include "common/volume/memory_budget.h"
#include "coordinator/datasets/dataset_machine_state.h"

namespace slabstream {
namespace {

constexpr std::size_t kMaxUploads = 4;                           // at a time
constexpr std::uint64_t kUploadWindow = std::uint64_t{8} << 20;  // bytes that may be under way

}  // namespace

void DatasetMachine::State::OnMessage(PeerToken client, const AddVolume& message, const Bytes&) {
  if (const Upload earlier = UploadOf(client); earlier != uploads.end())
    EndUpload(earlier, Status::Cancelled("the client sends another volume"));
  if (const Status admitted = AdmitUpload(message); !admitted.ok()) {
    return Send(client, OrderRefused{.nonce = message.nonce, .status = Bounded(admitted)});
  }
  uploads.emplace(++last_upload, OpenUpload{.client = client, .order = message});
  actions.emplace_back(BeginUpload{last_upload, message});
}

Status DatasetMachine::State::AdmitUpload(const AddVolume& order) {
  if (Status name = CheckDatasetName(order.name); !name.ok()) return name;
  if (Status taken = NameIsFree(order.name); !taken.ok()) return taken;
  if (std::ranges::any_of(uploads, [&](const auto& each) { return each.second.order.name == order.name; })) {
    return Status::InvalidArgument(fmt::format("a dataset named \"{}\" is on its way from another client", order.name));
  }
  if (uploads.size() >= kMaxUploads) {
    return Status::ResourceExhausted(fmt::format("{} volumes are on their way, which is the limit of the service", uploads.size()));
  }
  if (datasets.size() + uploads.size() >= config.max_datasets) {
    return Status::ResourceExhausted(fmt::format("the catalogue has {} datasets, which is its limit", datasets.size()));
  }
  const std::uint64_t share = DatasetShare(config.memory_bytes), bytes = BytesToSend(order);
  // What can never fit makes no room.
  while (UploadBytes() + bytes <= share && datasets.bytes() + UploadBytes() + bytes > share && UnloadOne()) {
  }
  if (datasets.bytes() + UploadBytes() + bytes <= share) return Status::Ok();
  ++refused.too_large;
  return TooLarge(order.name, bytes, datasets.bytes() + UploadBytes());
}

Status DatasetMachine::State::NameIsFree(const std::string& name) const {
  if (!datasets.IsListed(name)) return Status::Ok();
  return Status::InvalidArgument("there is already a dataset named " + InQuotes(name) + "; remove it first");
}

std::uint64_t DatasetMachine::State::UploadBytes() const {
  std::uint64_t total = 0;
  for (const auto& [id, upload] : uploads) total += BytesToSend(upload.order);
  for (const auto& [name, file] : files) total += BytesToSend(file.order);
  return total;
}

void DatasetMachine::State::On(const UploadBegun& event) {
  const Upload upload = uploads.find(event.upload);
  if (upload == uploads.end()) return;  // its client has gone
  if (!event.status.ok()) return EndUpload(upload, event.status);
  GrantCredit(upload->second);
}

void DatasetMachine::State::GrantCredit(OpenUpload& upload) {
  upload.allowed = std::min(upload.received + kUploadWindow, BytesToSend(upload.order));
  Send(upload.client, VolumeCredit{.nonce = upload.order.nonce, .received = upload.received, .allowed = upload.allowed});
}

DatasetMachine::State::Upload DatasetMachine::State::UploadOf(PeerToken client, std::optional<std::uint64_t> nonce) {
  return std::ranges::find_if(
      uploads, [&](const auto& each) { return each.second.client == client && (!nonce || each.second.order.nonce == *nonce); });
}

void DatasetMachine::State::OnMessage(PeerToken client, const VolumePart& part, const Bytes& payload) {
  const Upload found = UploadOf(client, part.nonce);
  if (found == uploads.end()) return;  // it was refused meanwhile
  OpenUpload& upload = found->second;
  if (part.begin != upload.received || part.bytes > upload.allowed - upload.received || payload.size() != part.bytes) {
    return EndUpload(found,
                     Status::InvalidArgument(fmt::format("VolumePart: {} bytes from {} on, expected those from {} on, at most up to {}",
                                                         part.bytes, part.begin, upload.received, upload.allowed)));
  }
  actions.emplace_back(StoreUpload{found->first, part.begin, payload});
  upload.received += part.bytes;
  if (upload.received == BytesToSend(upload.order)) {
    actions.emplace_back(FinishUpload{found->first});
  } else if (upload.allowed < BytesToSend(upload.order) && upload.allowed - upload.received <= kUploadWindow / 2) {
    GrantCredit(upload);
  }
}

void DatasetMachine::State::On(const UploadFinished& event) {
  const auto upload = uploads.extract(event.upload);
  if (upload.empty()) return;
  const AddVolume& order = upload.mapped().order;
  // A file of that name may have come into a watched folder.
  const Status status = event.source.ok() ? NameIsFree(order.name) : event.source.status();
  if (!status.ok()) return Send(upload.mapped().client, OrderRefused{.nonce = order.nonce, .status = Bounded(status)});
  if (order.file) files.emplace(order.name, upload.mapped());
  AddData(order.name, *event.source);
  Send(upload.mapped().client, DataReply{.nonce = order.nonce, .datasets = datasets.Report(now)});
}

void DatasetMachine::State::OnMessage(PeerToken client, const DropVolume& message, const Bytes&) {
  const Upload upload = UploadOf(client, message.nonce);
  if (upload != uploads.end()) return EndUpload(upload, Status::Cancelled("the client gave the volume up"));
  const auto file = std::ranges::find_if(
      files, [&](const auto& each) { return each.second.client == client && each.second.order.nonce == message.nonce; });
  if (file == files.end()) return;
  const std::string name = file->first;
  RemoveData(name, "its client has removed it");
  Send(client, OrderRefused{.nonce = message.nonce, .status = Status::Cancelled("the client has removed the dataset")});
}

void DatasetMachine::State::RemoveFilesOf(PeerToken client) {
  std::vector<std::string> names;
  for (const auto& [name, file] : files) {
    if (file.client == client) names.push_back(name);
  }
  for (const std::string& name : names) RemoveData(name, "its client has gone");
}

void DatasetMachine::State::EndUpload(Upload upload, const Status& why) {
  const OpenUpload& open = upload->second;
  Tell(NoteAbout::kDatasets, LogLevel::kInfo, "dataset \"{}\" of client {} did not arrive: {}", open.order.name, open.client,
       why.message());
  Send(open.client, OrderRefused{.nonce = open.order.nonce, .status = Bounded(why)});
  actions.emplace_back(DropUpload{upload->first});
  uploads.erase(upload);
}

}  // namespace slabstream
