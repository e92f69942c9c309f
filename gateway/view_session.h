// ViewSession: one WebSocket with one view. It carries out what its ViewMachine decides. Used by the io thread alone.
#pragma once

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/http/http.h"
#include "gateway/frame_message.h"
#include "gateway/metrics.h"
#include "gateway/page_message.h"
#include "gateway/rights.h"
#include "gateway/service_link.h"
#include "gateway/service_news.h"
#include "gateway/view_machine.h"

namespace slabstream {

inline constexpr std::uint16_t kExpired = 4401, kMadeRoom = 4408;  // close codes: those from 4000 on are the application's

// What sessions share; all of it outlives them.
struct SessionSurroundings {
  boost::asio::io_context& io;
  boost::asio::thread_pool& encoders;
  Metrics& metrics;
};

class ViewSession final : public WebSocketSession, public std::enable_shared_from_this<ViewSession> {
 public:
  // `asker`: the page; the end of what its token gives ends the session, too. `closed` is called at the end, when the session leaves.
  ViewSession(SessionSurroundings surroundings, std::unique_ptr<ServiceLink> link, std::shared_ptr<const ServiceNews> news, Asker asker,
              std::function<void(ViewSession&)> closed);

  void OnOpen(WebSocketPeer& peer) override;
  void OnText(std::string_view text) override;
  void OnClosed(const std::string& reason) override;

  void OnNews(std::shared_ptr<const ServiceNews> news);
  void SendStatus();
  void End(std::uint16_t code, const std::string& why);  // closes it
  SessionPlace place() const { return {asker_.token, machine_.used()}; }
  std::vector<std::string> datasets() const { return DatasetsOf(shown_); }  // of the latest picture

 private:
  void Handle(ViewMessage view);
  bool HasExpired();  // closes the session if so
  void Do(const ViewMachine::Actions& actions);
  void Render(const ViewAction& action);  // kRender
  void OnFrames(std::uint64_t order, Result<ServiceLink::Rendered> rendered);
  void OnProgress(std::uint64_t order, const FrameProgress& progress);
  void FetchNextTimes(const FrameRequest& shown);
  void Encode(PictureCoding coding, int quality);
  void OnEncoded(std::uint64_t number, Result<EncodedView> encoded);
  void Send(std::uint64_t frame);
  void SendError(std::uint64_t seq, const Status& status);
  void SetTimer();

  SessionSurroundings around_;
  std::unique_ptr<ServiceLink> link_;  // null after OnClosed
  std::shared_ptr<const ServiceNews> news_;
  const Asker asker_;
  std::function<void(ViewSession&)> closed_;
  WebSocketPeer* peer_ = nullptr;  // null before OnOpen and after OnClosed
  ViewMachine machine_{MonotonicNow()};
  boost::asio::steady_timer timer_;

  std::optional<ViewMessage> view_;  // the latest
  std::uint64_t orders_ = 0;         // counts orders to render
  struct Rendering {
    std::uint64_t order = 0;
    ServiceLink::Ticket ticket = 0;
    RenderedView view;      // what is known before the pictures are there
    FrameRequest frame;     // the first one; all have the same size
    bool shadowed = false;  // the view asks for shadows or ambient occlusion
  };
  std::optional<Rendering> rendering_;
  std::shared_ptr<const RenderedView> rendered_;
  FrameRequest shown_;                           // the first frame of `rendered_`
  ServiceLink::Ticket fetching_ = 0;             // times ahead; 0: none
  VideoEncoder video_;                           // used by one encoding at a time
  std::shared_ptr<std::atomic<bool>> given_up_;  // tells the encoding under way that nobody wants it any more
  std::uint64_t encoding_ = 0;                   // number of the encoding whose end is awaited
  std::optional<EncodedView> encoded_;
  std::uint64_t pings_ = 0;
  Time pinged_at_{};                    // the last one
  std::uint64_t told_unavailable_ = 0;  // seq of the view of whose failure the page knows
};

}  // namespace slabstream
