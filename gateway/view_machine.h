// ViewMachine: decides what happens next for one view that a page changes: when to render, encode, send and give up. Pure: events and the
// time go in, actions come out. The session (view_session.h) carries them out.
//
//   OnView --> [pending] --Render--> [rendering] --OnRendered--> [outgoing] --Encode--> OnEncoded --Send--> [sent] --OnAck--> ...
//
// - The latest view wins: there is one pending view, and a new one takes its place.
// - One view renders, one picture is outgoing, and as many are sent and not acknowledged as the way to the page holds (page_link.h). The
// next
//   view begins to render when it should be finished no sooner than its picture gets through: so what is shown is as new as can be, and no
//   frame is rendered for nothing.
// - A frame that renders is finished although newer views have come, else a picture that always moves would never be seen. A lossless
//   picture is given up for a newer view.
// - While the view moves, pictures may be drawn from coarser levels: as much coarser as it takes to render them quickly. If a picture with
//   shadows or ambient occlusion takes longer than 50 ms, those that move have neither.
// - Where pictures take long to a page that is far away, those that move are video, if the page can show it. All that is encoded is sent
// then.
// - kStillAfter after the last view, the same picture follows, lossless: the one that was rendered, or one in full size
//   and of the level that the view asks for. If rendering takes long, pictures of levels between these come before it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/base/time.h"
#include "gateway/page_link.h"
#include "gateway/picture_coding.h"

namespace slabstream {

inline constexpr Duration kStillAfter = std::chrono::milliseconds(150);
inline constexpr double kFirstCoarseness = 4, kMostCoarseness = 16;  // powers of two: a level has about half as many voxels along an axis

enum class ViewActionKind : std::uint8_t {
  kRender,        // view `seq` at `scale` and `coarseness`; answer by OnRendered, OnRefused or OnUnavailable
  kCancelRender,  // the frame that renders; no answer
  kEncode,        // the picture that was rendered last, as `coding` and `quality` say; answer by OnEncoded
  kCancelEncode,  // no answer
  kSend,          // what was encoded, as number `frame`; answered by the page (OnAck)
};

struct ViewAction {
  ViewActionKind kind = ViewActionKind::kRender;
  std::uint64_t seq = 0;                        // kRender
  double scale = 1;                             // kRender: of width and height
  double coarseness = 1;                        // kRender: factor of the view's `detail`, [1, kMostCoarseness]
  bool plain = false;                           // kRender: without the view's shadows and ambient occlusion
  PictureCoding coding = PictureCoding::kJpeg;  // kEncode
  int quality = 0;                              // kEncode: of JPEG
  std::uint64_t frame = 0;                      // kSend
  friend bool operator==(const ViewAction&, const ViewAction&) = default;
};

class ViewMachine {
 public:
  using Actions = std::vector<ViewAction>;

  explicit ViewMachine(Time opened = {}) : used_(opened) {}
  // `seq` rises from view to view; one that does not is ignored. `video`: the page can show it.
  Actions OnView(std::uint64_t seq, bool video, Time now);
  // finest: with less coarseness the picture would be the same. shadowed: the view has shadows or ambient occlusion.
  Actions OnRendered(bool finest, bool shadowed, Time now);
  void OnLoading(Time now);         // the dataset is still read: that is no time of rendering
  Actions OnRefused(Time now);      // the view cannot be rendered: it is done with
  Actions OnUnavailable(Time now);  // the service is gone: the view waits for OnServiceBack
  Actions OnServiceBack(Time now);
  Actions OnEncoded(Time now);
  Actions OnEncodeFailed(Time now);                                              // there is no picture to send; the view is done with
  Actions OnAck(std::uint64_t frame, Duration in_page, Time now);                // as PageLink's
  void OnEcho(Duration round_trip, Time now) { link_.OnEcho(round_trip, now); }  // as PageLink's
  Actions OnTime(Time now);                                                      // at wake_time()

  // When OnTime is due; nullopt: nothing waits for a time.
  std::optional<Time> wake_time() const { return wake_; }
  const PageLink& link() const { return link_; }
  // When the page last acknowledged a picture that it had been sent; before that, the time of the constructor.
  Time used() const { return used_; }
  // The JPEG quality of a moving picture, by the time that pictures take on the connection.
  int Quality() const;

 private:
  struct Picture {
    std::uint64_t seq = 0;
    double scale = 1;
    double coarseness = 1;
    bool plain = false;
    bool for_still = false;  // the view stands still
    bool as_asked() const { return scale == 1 && coarseness == 1 && !plain; }
  };
  enum class Out : std::uint8_t { kEmpty, kEncoding, kEncoded };

  Actions Next(Time now);
  void Send(Time now, Actions& actions);
  void Encode(Time now, Actions& actions);
  void Render(Time now, Actions& actions);
  bool IsRenderedOrRenders(std::uint64_t seq) const;
  bool MayRender(Time now);
  void AdaptScale(bool no_coarser, Duration time, Time now);
  void WakeAt(Time time);

  Time used_{};
  std::uint64_t latest_ = 0;  // the newest view; 0: none yet
  Time latest_since_{};
  bool refused_ = false;      // the latest view
  bool unavailable_ = false;  // the service
  std::optional<Picture> rendering_;
  Time rendering_since_{};
  std::optional<Picture> rendered_;  // the last one that was finished
  bool to_be_shown_ = false;         // and it was not encoded yet
  Out out_ = Out::kEmpty;
  bool outgoing_final_ = false;
  std::uint64_t final_seq_ = 0;  // the newest view whose lossless picture was begun
  PageLink link_;
  std::uint64_t frames_ = 0;
  Duration render_time_{};                // smoothed; 0: not measured yet
  bool may_be_video_ = false;             // by the latest view
  Time video_until_{};                    // pictures while moving are video
  bool small_ = false;                    // pictures while moving have half the size, for the connection's sake
  double scale_ = 1;                      // the scale of pictures while moving, below 1 for the service's sake
  Duration time_before_{};                // what the last picture while moving took
  Duration wider_time_{};                 // what the last picture of twice the scale took
  Time whole_until_{};                    // scale_ stays 1
  double coarseness_ = kFirstCoarseness;  // the coarseness of pictures while the view moves
  bool plain_ = false;                    // pictures while moving have no shadows
  double still_coarseness_ = 1;           // the coarseness of the next picture of a view that stands still
  std::optional<Time> wake_;
};

}  // namespace slabstream
