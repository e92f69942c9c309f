#include "worker/service/executor.h"

#include <algorithm>
#include <set>
#include <utility>

#include "common/base/check.h"
#include "common/base/log.h"
#include "common/image/coverage_map.h"
#include "common/image/image_view.h"
#include "common/parallel/parallel.h"
#include "common/renderers/renderer_kind.h"
#include "common/threads/guarded.h"
#include "common/wire/payload.h"
#include "worker/shapes/compose_shapes.h"
#include "worker/shapes/tile_coding.h"

namespace slabstream {
namespace {

const OcclusionMask kNothingHidden;
constexpr ClientId kNobody = 0;  // for what belongs to no client

std::int64_t NowNs() { return MonotonicNow().time_since_epoch().count(); }

// Runs `work` with as many threads as all workers of this process have: when pixels are combined or a picture is made, the other workers
// have already rendered. Call on the thread that the arena belongs to.
template <class Work>
auto WithAllThreads(TaskArena& arena, Work&& work) {
  if (const int threads = ThreadShare::OfProcess(); arena.threads() != threads) arena.Resize(threads);
  return arena.Run(work);
}

// The pixels of `view` as runs: the payload, and their header in the message.
Bytes EncodePixels(const ImageView& view, ColorCoding color, PartialImage& message) {
  RunImage runs = EncodeRuns(view, color);
  message.image = runs.header;
  return Bytes(std::move(runs.payload));
}

// The same without a copy, if the pixels of `view` of `image` already lie in memory as their payload. Like lent pixels they may be read
// until the message has been sent: pixels that were passed on are written again only after they have come back.
std::optional<Bytes> PixelsInPlace(const LocalImage& image, const ImageView& view, PartialImage& message) {
  const std::optional<RunImageHeader> header = DenseHeader(view);
  if (!header) return std::nullopt;
  std::optional<BlockPin> pin = PinOf(image.rgba);
  if (!pin) return std::nullopt;
  message.image = *header;
  return Bytes(std::make_shared<BlockPin>(*std::move(pin)), {reinterpret_cast<const std::byte*>(view.rgba), PayloadBytes(*header)});
}

// The last group that a picture shows.
GroupKey KeyOf(const FrameImage& message) { return {message.frame, message.attempt, std::max(message.groups_done, 1U) - 1}; }

bool Covers(PixelRange pixels, const PixelBounds& bounds, std::int32_t frame_width) {
  if (bounds.empty()) return true;
  const auto index = [&](std::int32_t x, std::int32_t y) { return std::uint64_t(y) * std::uint64_t(frame_width) + std::uint64_t(x); };
  return pixels.begin <= index(bounds.x_begin, bounds.y_begin) && index(bounds.x_end - 1, bounds.y_end - 1) < pixels.end;
}

// The bounds to which an image grows that gets `pixels` of another one. To grow each time would cost more than to combine, and only written
// parts take memory. So that is the whole frame or, of a very large one, all rows of these pixels: of a share no more will come. An image
// that outgrows such rows will hold the frame.
PixelBounds RoomFor(const PixelBounds& image, const PixelBounds& other, PixelRange pixels, const PixelBounds& frame) {
  constexpr std::int64_t kMostPixels = std::int64_t{1} << 22;
  const PixelBounds both = Union(image, other);
  if (both.empty()) return both;
  const bool outgrown = image.width() == frame.width() && image != both;
  if (outgrown || frame.pixel_count() <= kMostPixels) return frame;
  const PixelBounds rows = RowsOf(pixels, frame);
  return rows.pixel_count() <= kMostPixels ? Union(both, rows) : both;
}

// With another image of this worker. `fresh`: `image` does not exist yet.
void CombineImages(LocalImage& image, bool fresh, const std::shared_ptr<LocalImage>& other, const StartCombine& action, PixelRange pixels) {
  const bool whole = Covers(pixels, other->bounds, action.frame.width());
  if (fresh && whole && other.use_count() == 1) {
    image = std::move(*other);  // already released, and this task is the last holder
    return;
  }
  const ImageView view = whole ? ViewOf(*other) : ViewOf(*other, pixels, action.frame.width());
  const PixelBounds room = RoomFor(image.bounds, view.bounds, pixels, action.frame);
  if (fresh) image = MakeEmptyRows(view.format, room);
  if (action.replace) Erase(image, pixels, action.frame.width());
  Combine(image, view, action.side, room);
}

Status CombineIncoming(LocalImage& image, bool fresh, const StartCombine& action, PixelRange pixels) {
  const RunImageHeader& header = action.incoming->header;
  if (Status fits = ValidateRunHeader(header, action.frame); !fits.ok()) return fits;  // its size says how much memory is taken
  Bytes payload = action.incoming->payload;
  if (const Rare<PackedRuns>& packed = action.incoming->packed) {
    Result<Bytes> unpacked = UnpackRuns(*packed, payload, PayloadBytes(header));
    if (!unpacked.ok()) return unpacked.status();
    payload = *std::move(unpacked);
  }
  if (!action.replace && Covers(pixels, header.bounds, action.frame.width())) {
    const PixelBounds room = RoomFor(image.bounds, header.bounds, pixels, action.frame);
    if (fresh) image = MakeEmptyRows(header.format, room);
    return CombineRuns(image, header, payload.span(), action.frame, action.side, room);
  }
  Result<LocalImage> read = ReadRuns(header, payload.span(), action.frame);
  if (!read.ok()) return read.status();
  CombineImages(image, fresh, std::make_shared<LocalImage>(*std::move(read)), action, pixels);
  return Status::Ok();
}

Status CombineBorrowed(LocalImage& image, bool fresh, const StartCombine& action, PixelRange pixels, PeerMemory& memory) {
  const IncomingImage& incoming = *action.incoming;
  const Result<BorrowedImage> borrowed =
      memory.Borrow(*incoming.shared, incoming.header.format, incoming.payload, pixels, action.frame, MonotonicNow());
  if (!borrowed.ok()) return borrowed.status();
  const ImageView& view = borrowed->view;
  const PixelBounds room = RoomFor(image.bounds, view.bounds, pixels, action.frame);
  if (fresh) image = MakeEmptyRows(view.format, room);
  if (action.replace) Erase(image, pixels, action.frame.width());
  const bool valid = CombineUnchecked(image, view, action.side, room);
  // The owner reused the frame while it was read here: `image` may hold anything, and the group fails.
  if (!borrowed->Intact()) return Status::DataLoss("a lent image was taken back while it was read");
  return valid ? Status::Ok() : Status::InvalidArgument("shared image: a pixel's colour or depth is not finite");
}

using ShapeBytes = std::vector<std::shared_ptr<const VoxelBlock>>;  // of each shape
ShapeBytes BytesOf(const std::vector<std::shared_ptr<StoredBox>>& shapes) {
  ShapeBytes bytes;
  for (const auto& shape : shapes) bytes.push_back(shape->Block());
  return bytes;
}

std::shared_ptr<const FrameLight> LightFrom(const std::vector<std::shared_ptr<StoredBox>>& lights, const ShapeBytes& shapes,
                                            ClientId client, const FrameSetup& setup) {
  if (lights.empty()) return nullptr;
  return MakeFrameLight(
      [&](std::size_t field) {
        lights[field]->Assemble();
        const StoredBox::Lease lease = lights[field]->Lend(client);
        return lease.data().bricks().Block();
      },
      setup, shapes);
}

// Null: the frame has none.
Result<std::shared_ptr<const FrameShapes>> ShapesFrom(const ShapeBytes& shapes, const std::shared_ptr<const FrameLight>& light,
                                                      SharedShapes* shared) {
  if (shared == nullptr) return std::shared_ptr<const FrameShapes>();
  return shared->Make(shapes, light);
}

// A message of tiles that a worker has drawn for another one, and its payload. Tiles that would make it too large are left out.
std::pair<ShapeTiles, Bytes> PackTiles(const DrawTiles& draw, const DrawTiles::For& receiver, const ShapeGrid& grid,
                                       const FrameShapes& shapes) {
  constexpr std::size_t kMostBytes = std::size_t{256} << 20;
  ShapeTiles message{.epoch = draw.epoch, .from_worker = draw.from, .key = draw.key};
  PooledVector<std::byte> bytes;
  for (const std::uint32_t number : receiver.tiles) {
    const PixelBounds pixels = grid.PixelsOf(number);
    const ShapeTile& tile = shapes.TileAt(pixels.x_begin, pixels.y_begin);
    const std::size_t size = BytesOf(tile, receiver.colors);
    if (bytes.size() + size > kMostBytes) continue;
    message.tiles.push_back(number);
    message.bytes.push_back(std::uint32_t(size));
    AppendTile(tile, receiver.colors, bytes);
  }
  return {std::move(message), Bytes(std::move(bytes))};
}

// The picture of an accumulated frame, or of a share of it.
LocalImage FinishWithShapes(const LocalImage& frame, const SendFrame& send, const FrameShapes& shapes) {
  const FrameSetup& setup = *send.setup;
  const bool before = frame.format == PixelFormat::kRgba || frame.format == PixelFormat::kDepth;  // it has colours
  if (before) return setup.renderer->Finish(ComposeShapes(frame, send.pixels, setup, shapes), setup);
  return PictureOverShapes(setup.renderer->Finish(frame, setup), setup, shapes);
}

}  // namespace

Executor::Executor(Mailbox<ExecutorOutput>& outbox, Codec frame_codec, int threads, RendererFactory make_renderer, TaskHook hook)
    : outbox_(outbox),
      frame_codec_(frame_codec),
      make_renderer_(std::move(make_renderer)),
      hook_(std::move(hook)),
      threads_(threads),
      chunk_thread_([this] { Break(); }),
      combine_(threads, [this] { Break(); }),
      finish_(threads, [this] { Break(); }),
      draw_(threads, [this] { Break(); }),
      render_(threads, [this] { Break(); }) {}

void Executor::Break() {
  broken_ = true;
  outbox_.wakeup().Notify();
}

template <class Work>
Status Executor::Guard(const char* task, Work&& work) {
  return Guarded(task, [&] {
    if (hook_) hook_(task);
    return work();
  });
}

template <class Work>
bool Executor::TrySend(const char* task, const GroupKey& key, Work&& work) {
  const Status status = Guard(task, work);
  if (!status.ok()) outbox_.Post(WorkerEvent(SendFailed{key, status}));
  return status.ok();
}

Executor::~Executor() {
  for (const auto& [image, render] : renders_) {
    if (const std::shared_ptr<RenderControl> control = render.lock()) control->Cancel();
  }
}

void Executor::Perform(const OpenBox& action) {
  std::vector<StoredBox::Copy> copies;
  for (const OpenBox::Copy& copy : action.copies) copies.push_back({BoxOf(copy.from), copy.box});
  boxes_.insert_or_assign(action.padded, std::make_shared<StoredBox>(action.padded, std::move(copies), action.stored, action.filled));
}

void Executor::Perform(const DropBox& action) { boxes_.erase(action.padded); }

void Executor::Perform(StoreChunk&& action) {
  const auto found = boxes_.find(action.padded);
  std::shared_ptr<StoredBox> padded = found == boxes_.end() ? nullptr : found->second;
  chunk_thread_.Post([this, padded = std::move(padded), store = std::move(action)] {
    Status status = Guard("box", [&] {
      return padded == nullptr ? Status::NotFound("chunk of a padded box that was dropped") : padded->Store(store.chunk, store.payload);
    });
    outbox_.Post(WorkerEvent(ChunkStored{store.padded, store.chunk.box, store.chunk.chunk, std::move(status)}));
  });
}

void Executor::Perform(StartRender&& action) {
  RenderedBoxes boxes = {BoxOf(action.padded), ShapeBoxesOf(action.key.frame, action), {}};
  for (const std::optional<BoxKey>& field : action.fields) boxes.fields.push_back(field ? BoxOf(*field) : nullptr);
  auto image = images_.insert_or_assign(action.image, std::make_shared<LocalImage>()).first->second;
  auto control = std::make_shared<RenderControl>();
  std::erase_if(renders_, [](const auto& render) { return render.second.expired(); });
  renders_[action.image] = control;
  ClientLane& lane = render_.Of(action.client);
  lane.thread.Post(
      [this, &lane, boxes = std::move(boxes), image = std::move(image), control = std::move(control), render = std::move(action)] {
        outbox_.Post(WorkerEvent(lane.arena.Run([&] { return Render(render, boxes, *control, lane, *image); })));
      });
}

RenderDone Executor::Render(const StartRender& action, const RenderedBoxes& boxes, const RenderControl& control, ClientLane& lane,
                            LocalImage& image) {
  RenderDone done{action.key, action.rank, action.image, {}, {}};
  RankReport& report = done.report;
  const std::int64_t begin = NowNs();
  done.status = Guard("render", [&] {
    bool copied = boxes.padded->Assemble();
    for (const auto& field : boxes.fields) copied = (field != nullptr && field->Assemble()) || copied;
    if (copied) AddStage(report, Stage::kFetch, begin, NowNs());
    const StoredBox::Lease lease = boxes.padded->Lend(action.client);
    const ShapeBytes shape_bytes = BytesOf(boxes.shapes.shapes);
    const std::shared_ptr<const FrameLight> light = LightFrom(boxes.shapes.lights, shape_bytes, action.client, *action.setup);
    lease.data().SetLight(light);
    const auto shapes = ShapesFrom(shape_bytes, light, boxes.shapes.shared.get());
    if (!shapes.ok()) return shapes.status();
    lease.data().SetShapes(*shapes);
    // Fields that share a box have a lease each: renderers derive other data for each.
    std::vector<std::unique_ptr<const StoredBox::Lease>> field_leases;
    std::vector<BoxData*> fields;
    for (const auto& field : boxes.fields) {
      if (field != nullptr) field_leases.emplace_back(new StoredBox::Lease(field->Lend(action.client)));
      fields.push_back(field == nullptr ? nullptr : &field_leases.back()->data());
    }
    lease.data().SetFields(std::move(fields));
    std::unique_ptr<Renderer>& renderer = lane.renderers[action.setup->renderer];
    if (renderer == nullptr) renderer = make_renderer_(*action.setup->renderer);
    const OcclusionMask& hidden = action.hidden == nullptr ? kNothingHidden : *action.hidden;
    Result<LocalImage> rendered = renderer->Render(lease.data(), action.placement.at(), *action.setup, hidden, control, report);
    if (!rendered.ok()) return rendered.status();
    image = std::move(*rendered);
    report.image_bounds = image.bounds;
    report.image_pixels = SamplePixels(image);
    return Status::Ok();
  });
  if (report.stage_ns[std::size_t(Stage::kRender)] == 0) AddStage(report, Stage::kRender, begin, NowNs());
  done.box_bytes = boxes.padded->bytes();
  for (const auto& field : boxes.fields) done.field_bytes.push_back(field == nullptr ? 0 : field->bytes());
  return done;
}

std::shared_ptr<RenderControl> Executor::ControlOf(ImageHandle image) const {
  const auto render = renders_.find(image);
  return render == renders_.end() ? nullptr : render->second.lock();
}

void Executor::Perform(const PauseRender& action) {
  if (const auto control = ControlOf(action.image)) control->Pause();
}

void Executor::Perform(const ResumeRender& action) {
  if (const auto control = ControlOf(action.image)) control->Resume();
}

void Executor::Perform(const CancelRender& action) {
  if (const auto control = ControlOf(action.image)) control->Cancel();
}

std::shared_ptr<SharedShapes> Executor::SharedShapesOf(FrameId frame, const FrameSetup& setup) {
  std::shared_ptr<SharedShapes>& shared = shapes_[frame];
  if (shared == nullptr) shared = SharedShapes::Of(setup);
  return shared;
}

template <class Action>
Executor::ShapeBoxes Executor::ShapeBoxesOf(FrameId frame, const Action& action) {
  ShapeBoxes boxes;
  for (const BoxKey& shape : action.shapes) boxes.shapes.push_back(BoxOf(shape));
  for (const BoxKey& light : action.lights) boxes.lights.push_back(BoxOf(light));
  if (!boxes.shapes.empty()) boxes.shared = SharedShapesOf(frame, *action.setup);
  return boxes;
}

void Executor::Perform(DrawTiles&& action) {
  ShapeBoxes boxes = ShapeBoxesOf(action.key.frame, action);
  ClientLane& lane = draw_.Of(action.client);
  lane.thread.Post([this, &lane, boxes = std::move(boxes), draw = std::move(action)] {
    const std::int64_t begin = NowNs();
    const Status status = Guard("tiles", [&] {
      return lane.arena.Run([&] {
        const ShapeBytes bytes = BytesOf(boxes.shapes);
        const auto shapes = ShapesFrom(bytes, LightFrom(boxes.lights, bytes, draw.client, *draw.setup), boxes.shared.get());
        if (!shapes.ok()) return shapes.status();
        const ShapeGrid grid(FrameBounds(*draw.setup));
        std::set<std::uint32_t> all;
        for (const DrawTiles::For& receiver : draw.receivers) all.insert(receiver.tiles.begin(), receiver.tiles.end());
        const std::vector<std::uint32_t> tiles(all.begin(), all.end());
        ParallelFor(std::size_t{0}, tiles.size(), [&](std::size_t i) {
          const PixelBounds pixels = grid.PixelsOf(tiles[i]);
          (*shapes)->TileAt(pixels.x_begin, pixels.y_begin);
        });
        for (const DrawTiles::For& receiver : draw.receivers) {
          auto [message, payload] = PackTiles(draw, receiver, grid, **shapes);
          if (!message.tiles.empty()) outbox_.Post(OutgoingPartial{receiver.to, Encode(message), std::move(payload), false, 0, draw.key});
        }
        return Status::Ok();
      });
    });
    if (!status.ok()) LogWarning(status.message());  // whoever needs them draws them
    outbox_.Post(WorkerEvent(TilesDrawn{draw.key, {Stage::kRender, begin, NowNs()}}));
  });
}

void Executor::Perform(const KeepTiles& action) {
  SharedShapesOf(action.message.key.frame, *action.setup)->Add(action.message, action.payload);
}

std::shared_ptr<StoredBox> Executor::BoxOf(const BoxKey& key) const {
  const auto found = boxes_.find(key);
  CHECK(found != boxes_.end()) << "the machine copies and renders from boxes that it holds";
  return found->second;
}

std::shared_ptr<LocalImage> Executor::ImageOf(ImageHandle image) const {
  const auto found = images_.find(image);
  CHECK(found != images_.end()) << "image " << image << " does not exist";
  return found->second;
}

void Executor::Perform(StartCombine&& action) {
  std::shared_ptr<LocalImage>& image = images_[action.image];
  const bool fresh = image == nullptr;
  if (fresh) image = std::make_shared<LocalImage>();
  std::shared_ptr<LocalImage> other = action.other == 0 ? nullptr : ImageOf(action.other);
  ClientLane& lane = combine_.Of(action.client);
  lane.thread.Post([this, &lane, fresh, image = image, other = std::move(other), combine = std::move(action)]() mutable {
    CombineDone done{combine.key, combine.image, {}, {Stage::kCombine, NowNs(), 0}};
    done.status = Guard("combine", [&] {
      const PixelRange pixels = combine.pixels == PixelRange{} ? PixelRange{0, std::uint64_t(combine.frame.pixel_count())} : combine.pixels;
      if (other != nullptr) {
        WithAllThreads(lane.arena, [&] { CombineImages(*image, fresh, other, combine, pixels); });
        return Status::Ok();
      }
      if (!combine.incoming) combine.incoming.emplace();
      if (!fresh && image->format != combine.incoming->header.format) {
        return Status::InvalidArgument("PartialImage.image.format is not that of the frame");
      }
      return WithAllThreads(lane.arena, [&] {
        return combine.incoming->shared ? CombineBorrowed(*image, fresh, combine, pixels, peer_memory_)
                                        : CombineIncoming(*image, fresh, combine, pixels);
      });
    });
    done.span.end_ns = NowNs();
    outbox_.Post(WorkerEvent(std::move(done)));
  });
}

void Executor::Perform(FindHidden&& action) {
  std::shared_ptr<LocalImage> image = ImageOf(action.image);
  combine_.Of(action.client).thread.Post([this, image = std::move(image), find = std::move(action)]() mutable {
    HiddenFound found{find.key, find.image, {}};
    const Status status = Guard("hidden tiles", [&] {
      const PixelBounds frame = FrameBounds(*find.setup);
      if (image->format != PixelFormat::kRgba) {  // a peer's mistake
        return Status::InvalidArgument("hidden tiles: not an image that blends");
      }
      FillRows(*image);
      found.hidden = FindHiddenTiles(*image, frame.width(), frame.height(), find.setup->termination, std::move(find.known));
      return Status::Ok();
    });
    if (!status.ok()) LogWarning(status.message());  // what no mask hides is rendered
    outbox_.Post(WorkerEvent(std::move(found)));
  });
}

std::optional<Bytes> Executor::PayloadInPlace(const LocalImage& image, const ImageView& view, SendPartial& send) {
  if (send.delivery.lend) {
    if (std::optional<Bytes> spans = lent_.Lend(image, view, *send.to, send.message)) return spans;
  }
  return send.color == ColorCoding::kFloat32 ? PixelsInPlace(image, view, send.message) : std::nullopt;
}

void Executor::Post(SendPartial& send, Bytes payload, std::int64_t begin_ns) {
  sent_.Add(send.message.key, send.rank, payload.size(), begin_ns, NowNs());
  sent_.MoveInto(send.message.key, send.message.reports);
  outbox_.Post(
      OutgoingPartial{*send.to, Encode(send.message), std::move(payload), send.delivery.timed, send.message.acknowledge, send.message.key});
}

void Executor::Perform(SendPartial&& action) {
  std::shared_ptr<LocalImage> image = ImageOf(action.image);
  const auto view_of = [](const LocalImage& of, const SendPartial& send) { return ViewOf(of, send.message.pixels, send.frame.width()); };
  std::optional<ImageView> view;
  std::optional<Bytes> payload;
  // Describing where pixels are takes less time than waking a thread for it.
  ClientLane& lane = combine_.Of(action.client);
  if (lane.thread.Idle()) {
    bool posted = false;
    const bool tried = TrySend("encode", action.message.key, [&] {
      const std::int64_t begin = NowNs();
      view = view_of(*image, action);
      payload = PayloadInPlace(*image, *view, action);
      posted = payload && !MayPack(action.delivery.bytes_per_second);
      if (posted) Post(action, *std::move(payload), begin);
    });
    if (posted || !tried) return;
  }
  lane.thread.Post(
      [=, this, &lane, image = std::move(image), view = std::move(view), payload = std::move(payload), send = std::move(action)]() mutable {
        TrySend("encode", send.message.key, [&] {
          const std::int64_t begin = NowNs();
          if (!view) {
            view = view_of(*image, send);
            payload = PayloadInPlace(*image, *view, send);
          }
          if (!payload) payload = WithAllThreads(lane.arena, [&] { return EncodePixels(*view, send.color, send.message); });
          Post(send, PackForLink(*std::move(payload), send.delivery.bytes_per_second, send.message.packed), begin);
        });
      });
}

void Executor::Perform(const ForgetGroups& action) {
  const auto over = [&](const GroupKey& key) { return action.Over(key); };
  lent_.Forget(over);
  sent_.Forget(over);
  std::erase_if(shapes_, [&](const auto& shapes) { return action.Over(shapes.first); });
}

void Executor::Perform(const ResendImage& action) {
  std::shared_ptr<const LentImage> lent = lent_.Find(action.refused.key, action.refused.step, action.refused.pixels);
  if (lent == nullptr) return;
  ClientLane& lane = combine_.Of(kNobody);
  lane.thread.Post([this, &lane, lent = std::move(lent)] {
    TrySend("encode", lent->message.key, [&] {
      PartialImage message = lent->message;
      message.shared.reset();
      Bytes payload = WithAllThreads(lane.arena, [&] { return EncodePixels(lent->view, ColorCoding::kFloat32, message); });
      outbox_.Post(OutgoingPartial{lent->to, Encode(message), std::move(payload), false, 0, message.key});
    });
  });
}

void Executor::Perform(SendFrame&& action) {
  std::shared_ptr<LocalImage> image = ImageOf(action.image);
  const bool finished = action.message.groups_done == action.message.group_count;
  ClientLane& lane = (finished ? finish_ : combine_).Of(action.client);
  ShapeBoxes shapes = ShapeBoxesOf(action.message.frame, action);
  lane.thread.Post([this, &lane, image = std::move(image), shapes = std::move(shapes), send = std::move(action)]() mutable {
    TrySend("picture", KeyOf(send.message), [&] { return MakePicture(*image, send, shapes, lane.arena); });
  });
}

Status Executor::MakePicture(LocalImage& frame, SendFrame& send, const ShapeBoxes& shape_boxes, TaskArena& arena) {
  const GroupKey key = KeyOf(send.message);
  RankReport& report = send.message.reports.emplace_back();
  report.worker = send.message.worker;
  report.group = key.group;
  const std::int64_t begin = NowNs();
  std::int64_t resolved_ns = begin;
  Result<RunImage> made = WithAllThreads(arena, [&]() -> Result<RunImage> {
    const RendererKind& renderer = *send.setup->renderer;
    LocalImage share;
    const bool whole = send.pixels == WholeFrame(*send.setup);
    if (!whole) share = CopyOf(ViewOf(frame, send.pixels, FrameBounds(*send.setup).width()));
    LocalImage& image = whole ? frame : share;
    // At the seams of shares that are resampled, pixels are sums, and codes of their parts would not add up.
    const bool straight8 = send.straight8 && (whole || renderer.FrameIsPicture(*send.setup));
    const ColorCoding color = straight8 ? ColorCoding::kStraight8 : ColorCoding::kFloat32;
    const std::optional<Rgb>& over = send.straight8_over;
    const Premultiplied behind = over ? Premultiplied{over->r, over->g, over->b, 1} : Premultiplied{};
    if (renderer.FrameIsPicture(*send.setup)) return EncodePicture(image, color, behind);
    FillRows(image);
    const ShapeBytes bytes = BytesOf(shape_boxes.shapes);
    const auto shapes = ShapesFrom(bytes, LightFrom(shape_boxes.lights, bytes, send.client, *send.setup), shape_boxes.shared.get());
    if (!shapes.ok()) return shapes.status();
    const LocalImage picture = *shapes == nullptr ? renderer.Finish(image, *send.setup) : FinishWithShapes(image, send, **shapes);
    resolved_ns = NowNs();
    return EncodePicture(picture, color, behind);
  });
  if (!made.ok()) return made.status();
  RunImage& runs = *made;
  AddStage(report, Stage::kResolve, begin, resolved_ns);
  EncodedRuns& encoded = send.message.picture.runs;
  encoded.image = runs.header;
  const Bytes payload = PackRuns(Bytes(std::move(runs.payload)), frame_codec_, encoded);
  AddStage(report, Stage::kEncode, resolved_ns, NowNs());
  outbox_.Post(OutgoingFrame{key, std::move(send.message), payload, std::move(send.pictures)});
  return Status::Ok();
}

void Executor::Perform(const ReleaseImage& action) { images_.erase(action.image); }

}  // namespace slabstream
