#include "gateway/uploads.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <cctype>
#include <utility>

#include "common/base/printable.h"
#include "common/http/address.h"
#include "common/text/parse_number.h"

namespace slabstream {
namespace {

constexpr std::size_t kMostNameBytes = 128;

std::uint64_t NeedCount(FieldReader& read, const std::string& name, std::string_view purpose, std::uint64_t least) {
  const std::string text = read.Need(name, purpose);
  const std::optional<std::uint64_t> count = ParseNumber<std::uint64_t>(text);
  if (count && *count >= least && *count <= kMaxSentFileBytes) return *count;
  read.Refuse(
      fmt::format("{} is '{}', must be a whole number from {} to {}", name, Printable(text.substr(0, 32)), least, kMaxSentFileBytes));
  return least;
}

// A name that no dataset has: that of the file without its endings, and a number if need be.
std::string DatasetNameFor(const std::string& file, const std::function<bool(const std::string&)>& is_taken) {
  const std::string stem = file.substr(0, file.find('.', 1));
  std::string name = stem;
  for (int number = 2; is_taken(name); ++number) name = fmt::format("{}-{}", stem, number);
  return name;
}

}  // namespace

std::string FileNameForService(std::string_view name) {
  std::string safe;
  for (const char c : name) {
    const bool allowed = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' || (c == '.' && !safe.empty());
    if (allowed) {
      safe += c;
    } else if (!safe.ends_with('_')) {
      safe += '_';
    }
  }
  if (safe.size() > kMostNameBytes) safe = safe.substr(0, kMostNameBytes / 2) + safe.substr(safe.size() - kMostNameBytes / 2);
  return safe.empty() ? "_" : safe;
}

void Uploads::Handle(Asked asked, const std::vector<std::string>& taken) {
  if (most_bytes_ == 0) return asked.reply(Failure(403, "this gateway takes no files: it was started with --max-upload 0"));
  FieldReader read(std::move(asked.fields));
  if (read.Has("file")) return Begin(std::move(read), taken, asked.reply);
  const std::string id = read.Need("upload", "what the request with `file` and `bytes` has answered");
  if (!read.status().ok()) return asked.reply(Failure(read.status()));
  const Place upload = uploads_.find(id);
  if (upload == uploads_.end()) {
    constexpr auto kMinutes = std::chrono::duration_cast<std::chrono::minutes>(kUnseen).count();
    return asked.reply(Failure(404, fmt::format("there is no such upload: it failed, or was removed after {} minutes unseen", kMinutes)));
  }
  upload->second.used = MonotonicNow();
  if (read.Has("drop")) {
    const ReplyFunction waiting = std::move(upload->second.waiting);
    uploads_.erase(upload);
    if (waiting) waiting(Failure(404, "the upload was dropped"));
    return asked.reply(JsonReply(Json::object()));
  }
  if (upload->second.failure) {
    const Status why = *upload->second.failure;
    uploads_.erase(upload);
    return asked.reply(Failure(why));
  }
  const std::uint64_t begin = NeedCount(read, "begin", "where in the file the body begins", 0);
  read.NothingElse();
  if (!read.status().ok()) return asked.reply(Failure(read.status()));
  Continue(upload, begin, std::move(asked.body), std::move(asked.reply), asked.gone);
}

void Uploads::Begin(FieldReader read, const std::vector<std::string>& taken, const ReplyFunction& reply) {
  const std::string file = read.Need("file", "the name of the file");
  const std::uint64_t bytes = NeedCount(read, "bytes", "the size of the file", 1);
  read.NothingElse();
  if (!read.status().ok()) return reply(Failure(read.status()));
  if (bytes > most_bytes_) {
    metrics_.CountRefusal("upload");
    return reply(Failure(413, fmt::format("the file has {} bytes; this gateway takes at most {} (--max-upload)", bytes, most_bytes_)));
  }
  if (uploads_.size() >= kMaxUploadsKept) {
    metrics_.CountRefusal("uploads");
    return reply(Failure(429, fmt::format("there are {} files that pages have sent, which is the limit", uploads_.size())));
  }
  Result<std::string> id = MakeToken();
  if (!id.ok()) return reply(Failure(id.status()));
  const std::string name = FileNameForService(file);
  Upload upload;
  upload.dataset = DatasetNameFor(name, [&](const std::string& dataset) {
    return std::ranges::find(taken, dataset) != taken.end() ||
           std::ranges::any_of(uploads_, [&](const auto& other) { return other.second.dataset == dataset; });
  });
  upload.bytes = bytes;
  upload.used = MonotonicNow();
  const auto here = [this, id = *id, alive = std::weak_ptr<bool>(alive_)](auto method) {
    return [this, id, alive, method](auto what) {
      boost::asio::post(io_, [this, id, alive, method, what] {
        if (alive.lock() != nullptr) std::invoke(method, this, id, what);
      });
    };
  };
  upload.sender = std::make_unique<FileUpload>(context_, service_, upload.dataset, SentFile{name, bytes},
                                               FileUpload::Events{.sent = here(&Uploads::OnSent), .changed = here(&Uploads::OnChanged)});
  const HttpReply answer = JsonReply({{"upload", *id}, {"dataset", upload.dataset}});
  uploads_.emplace(*std::move(id), std::move(upload));
  reply(answer);
}

void Uploads::Continue(Place upload, std::uint64_t begin, std::string body, ReplyFunction reply, const Gone& gone) {
  Upload& to = upload->second;
  const std::uint64_t end = begin + body.size();
  // A part may come again: its reply was lost.
  if (begin > to.received || (begin < to.received && end > to.received) || end > to.bytes) {
    return reply(
        Failure(400, fmt::format("bytes {} to {} of a file of {} bytes, of which {} are here", begin, end, to.bytes, to.received)));
  }
  if (begin == to.received && !body.empty()) {
    if (to.sent < to.received) {
      return reply(Failure(
          429, fmt::format("bytes {} to {} are still on their way: send the next part when they are answered", to.sent, to.received)));
    }
    to.received = end;
    const auto owner = std::make_shared<const std::string>(std::move(body));
    to.sender->Add(Bytes(owner, std::as_bytes(std::span(*owner))));
  }
  // The connection of a part that comes again may have died without a word.
  if (to.waiting) std::exchange(to.waiting, nullptr)(Failure(400, "the part has come again"));
  to.waiting = std::move(reply);
  *gone = [this, alive = std::weak_ptr<bool>(alive_), id = upload->first, number = ++to.requests] {
    if (alive.lock() == nullptr) return;
    const Place left = uploads_.find(id);
    if (left != uploads_.end() && left->second.requests == number) left->second.waiting = nullptr;
  };
  AnswerIfDone(to);
}

void Uploads::AnswerIfDone(Upload& upload) {
  const bool done = upload.received < upload.bytes ? upload.sent == upload.received : upload.there;
  if (!done || !upload.waiting) return;
  Json answer = {{"received", upload.received}};
  if (upload.there) answer["dataset"] = upload.dataset;
  std::exchange(upload.waiting, nullptr)(JsonReply(answer));
}

void Uploads::OnSent(const std::string& id, std::uint64_t bytes) {
  const Place upload = uploads_.find(id);
  if (upload == uploads_.end()) return;
  upload->second.sent = bytes;
  AnswerIfDone(upload->second);
}

void Uploads::OnChanged(const std::string& id, const Status& status) {
  const Place upload = uploads_.find(id);
  if (upload == uploads_.end()) return;
  if (status.ok()) {
    upload->second.there = true;
    return AnswerIfDone(upload->second);
  }
  const ReplyFunction waiting = std::move(upload->second.waiting);
  if (waiting) {
    uploads_.erase(upload);
    return waiting(Failure(status));
  }
  if (upload->second.there) {
    uploads_.erase(upload);
  } else {
    upload->second.failure = status;  // for the next part
  }
}

void Uploads::Touch(std::string_view dataset, Time now) {
  for (auto& [id, upload] : uploads_) {
    if (upload.dataset == dataset) upload.used = now;
  }
}

void Uploads::RemoveUnseen(Time now) {
  std::erase_if(uploads_, [now](const auto& each) {
    const Upload& upload = each.second;
    return !upload.waiting && now - upload.used > (upload.there ? kUnseen : kStalled);
  });
}

}  // namespace slabstream
