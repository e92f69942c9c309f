#include "gateway/view_machine.h"

#include <algorithm>
#include <utility>

namespace slabstream {
namespace {

using std::chrono::milliseconds;

// Quality of JPEG falls with the time that a picture takes on the connection: at these and beyond it stays.
constexpr Duration kQuick = milliseconds(30), kSlow = milliseconds(200);
constexpr int kBestQuality = 92, kLeastQuality = 50;
// Pictures become small above the first, and large again below the second, which small ones would else lead to at once.
constexpr Duration kSmallAbove = milliseconds(100), kLargeBelow = milliseconds(50);
// Pictures become video above the first, where the delay is at least the second: nearer by, nothing is gained. After
// a while it is tried without.
constexpr Duration kVideoAbove = milliseconds(40), kFar = milliseconds(10), kVideoFor = std::chrono::seconds(20);
// Pictures become coarser above the first, and finer below the second: the next finer level has eight times as many voxels.
constexpr Duration kCoarserAbove = milliseconds(200), kFinerBelow = milliseconds(25);

// Where there is no coarser level, as of grids, pictures while moving get half the width and height if two in turn are above the first, and
// twice as much below the second: a quarter of the pixels takes at least a quarter of the time. If it takes more than this share of the
// time before, the voxels take the time and not the pixels, so pictures are whole again for a while.
constexpr Duration kSmallerAbove = milliseconds(120), kWiderBelow = milliseconds(25), kWholeFor = std::chrono::seconds(20);
constexpr double kLeastScale = 0.25, kHelpfulShare = 0.7;

// Pictures while moving lose their shadows above the first, and get them back below the second: at most they double the time.
constexpr Duration kPlainAbove = milliseconds(50), kShadowedBelow = milliseconds(25);

}  // namespace

int ViewMachine::Quality() const {
  const double share = double((std::clamp(link_.connection_time(), kQuick, kSlow) - kQuick).count()) / double((kSlow - kQuick).count());
  return kBestQuality - int(share * (kBestQuality - kLeastQuality));
}

ViewMachine::Actions ViewMachine::OnView(std::uint64_t seq, bool video, Time now) {
  Actions actions;
  if (seq <= latest_) return actions;
  may_be_video_ = video;
  latest_ = seq;
  latest_since_ = now;
  refused_ = false;
  // A lossless picture of an older view is given up.
  if (out_ != Out::kEmpty && outgoing_final_) {
    if (out_ == Out::kEncoding) actions.push_back({.kind = ViewActionKind::kCancelEncode});
    out_ = Out::kEmpty;
  }
  if (rendering_ && rendering_->for_still) {
    actions.push_back({.kind = ViewActionKind::kCancelRender});
    rendering_.reset();
  }
  Actions more = Next(now);
  actions.insert(actions.end(), more.begin(), more.end());
  return actions;
}

ViewMachine::Actions ViewMachine::OnRendered(bool finest, bool shadowed, Time now) {
  if (!rendering_) return {};
  const Duration time = now - rendering_since_;
  render_time_ = Smoothed(render_time_, time);
  rendered_ = std::exchange(rendering_, std::nullopt);
  if (!rendered_->for_still && time > kCoarserAbove) coarseness_ = std::min(2 * coarseness_, kMostCoarseness);
  if (!rendered_->for_still && time < kFinerBelow) coarseness_ = std::max(coarseness_ / 2, 1.0);
  if (!rendered_->for_still) AdaptScale(finest && rendered_->coarseness > 1, time, now);
  if (!rendered_->for_still && shadowed) plain_ = time > (rendered_->plain ? kShadowedBelow : kPlainAbove);
  if (!shadowed) rendered_->plain = false;
  still_coarseness_ = time < kFinerBelow ? 1 : rendered_->coarseness / 2;
  if (finest) rendered_->coarseness = 1;
  to_be_shown_ = !rendered_->for_still || !rendered_->as_asked();  // the lossless one is encoded only once
  return Next(now);
}

void ViewMachine::AdaptScale(bool no_coarser, Duration time, Time now) {
  if (scale_ < 1 && double(time.count()) > kHelpfulShare * double(wider_time_.count())) {
    scale_ = 1;
    whole_until_ = now + kWholeFor;
  } else if (no_coarser && std::min(time, time_before_) > kSmallerAbove && now >= whole_until_ && scale_ > kLeastScale) {
    wider_time_ = time;
    scale_ /= 2;
  } else if (time < kWiderBelow) {
    scale_ = std::min(2 * scale_, 1.0);
  }
  time_before_ = time;
}

void ViewMachine::OnLoading(Time now) {
  if (rendering_) rendering_since_ = now;
}

ViewMachine::Actions ViewMachine::OnRefused(Time now) {
  if (!rendering_) return {};
  if (rendering_->seq == latest_) refused_ = true;
  rendering_.reset();
  return Next(now);
}

ViewMachine::Actions ViewMachine::OnUnavailable(Time now) {
  rendering_.reset();
  unavailable_ = true;
  return Next(now);
}

ViewMachine::Actions ViewMachine::OnServiceBack(Time now) {
  if (!std::exchange(unavailable_, false)) return {};
  return Next(now);
}

ViewMachine::Actions ViewMachine::OnEncoded(Time now) {
  if (out_ == Out::kEncoding) out_ = Out::kEncoded;
  return Next(now);
}

ViewMachine::Actions ViewMachine::OnEncodeFailed(Time now) {
  out_ = Out::kEmpty;
  if (rendered_) final_seq_ = std::max(final_seq_, rendered_->seq);
  return Next(now);
}

ViewMachine::Actions ViewMachine::OnAck(std::uint64_t frame, Duration in_page, Time now) {
  if (!link_.OnAck(frame, in_page, now)) return {};
  used_ = now;
  if (link_.connection_time() > kVideoAbove && link_.delay() >= kFar) video_until_ = now + kVideoFor;
  if (link_.picture_time() > kSmallAbove) small_ = true;
  if (link_.picture_time() < kLargeBelow) small_ = false;
  return Next(now);
}

ViewMachine::Actions ViewMachine::OnTime(Time now) { return Next(now); }

ViewMachine::Actions ViewMachine::Next(Time now) {
  Actions actions;
  wake_.reset();
  Send(now, actions);
  Encode(now, actions);
  Render(now, actions);
  return actions;
}

void ViewMachine::Send(Time now, Actions& actions) {
  if (out_ != Out::kEncoded || link_.is_full()) return;
  out_ = Out::kEmpty;
  link_.OnSent(++frames_, !outgoing_final_, now);
  actions.push_back({.kind = ViewActionKind::kSend, .frame = frames_});
}

void ViewMachine::Encode(Time now, Actions& actions) {
  if (out_ == Out::kEncoding || !rendered_) return;
  if (to_be_shown_) {  // also in place of an older picture that could not be sent yet, unless it is video
    const bool video = may_be_video_ && now < video_until_;
    if (video && (out_ != Out::kEmpty || link_.is_full())) return;
    to_be_shown_ = false;
    outgoing_final_ = false;
    out_ = Out::kEncoding;
    actions.push_back(
        {.kind = ViewActionKind::kEncode, .coding = video ? PictureCoding::kVideo : PictureCoding::kJpeg, .quality = Quality()});
    return;
  }
  const bool as_asked = rendered_->seq == latest_ && rendered_->as_asked();
  if (out_ != Out::kEmpty || !as_asked || final_seq_ == latest_) return;
  if (now < latest_since_ + kStillAfter) return WakeAt(latest_since_ + kStillAfter);
  final_seq_ = latest_;
  outgoing_final_ = true;
  out_ = Out::kEncoding;
  actions.push_back({.kind = ViewActionKind::kEncode, .coding = PictureCoding::kLossless});
}

bool ViewMachine::IsRenderedOrRenders(std::uint64_t seq) const {
  return (rendered_ && rendered_->seq == seq) || (rendering_ && rendering_->seq == seq);
}

// A frame that would wait for the page is begun later, and then shows a newer view.
bool ViewMachine::MayRender(Time now) {
  if (link_.is_full() && (out_ != Out::kEmpty || to_be_shown_)) return false;
  const Time ready = link_.ready() - render_time_;
  if (now >= ready) return true;
  WakeAt(ready);
  return false;
}

void ViewMachine::Render(Time now, Actions& actions) {
  if (latest_ == 0 || refused_ || unavailable_ || rendering_) return;
  Picture next{.seq = latest_, .scale = std::min(small_ ? 0.5 : 1, scale_), .coarseness = coarseness_, .plain = plain_};
  if (IsRenderedOrRenders(latest_)) {
    const bool still_needs_it = !rendered_->as_asked() && !to_be_shown_;
    if (!still_needs_it) return;
    if (now < latest_since_ + kStillAfter) return WakeAt(latest_since_ + kStillAfter);
    next = {.seq = latest_, .coarseness = std::max(still_coarseness_, 1.0), .for_still = true};
  } else if (!MayRender(now)) {
    return;
  }
  rendering_ = next;
  rendering_since_ = now;
  actions.push_back(
      {.kind = ViewActionKind::kRender, .seq = next.seq, .scale = next.scale, .coarseness = next.coarseness, .plain = next.plain});
}

void ViewMachine::WakeAt(Time time) { wake_ = wake_ ? std::min(*wake_, time) : time; }

}  // namespace slabstream
