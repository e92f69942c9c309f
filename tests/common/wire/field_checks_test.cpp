// What the structs' comments promise, one broken promise at a time: the error names field, value and limit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "common/wire/any_message.h"
#include "common/wire/limits.h"
#include "slabstream/v1/envelope.pb.h"
#include "tests/common/wire/error_of.h"
#include "tests/common/wire/samples.h"

namespace slabstream {
namespace {

template <class Message>
v1::Envelope EnvelopeOf(std::size_t sample = 0) {
  v1::Envelope envelope;
  const std::vector<std::byte> header = Encode(Samples<Message>()[sample]);
  EXPECT_TRUE(envelope.ParseFromArray(header.data(), int(header.size())));
  return envelope;
}

struct Case {
  std::function<void(v1::Envelope&)> alter;
  std::string error;  // a part of it; empty: still valid
};

template <class Message>
void Check(const std::vector<Case>& cases) {
  for (std::size_t i = 0; i < cases.size(); ++i) {
    v1::Envelope envelope = EnvelopeOf<Message>();
    cases[i].alter(envelope);
    if (cases[i].error.empty()) {
      EXPECT_EQ(ErrorOf(envelope), "") << "case " << i;
    } else {
      EXPECT_THAT(ErrorOf(envelope), testing::HasSubstr(cases[i].error)) << "case " << i;
    }
  }
}

TEST(FieldChecks, OnlyANewKeyNeedsARole) {
  Check<KeysOrder>({
      {[](auto& e) { e.mutable_keys_order()->clear_role(); }, ""},
      {[](auto& e) {
         e.mutable_keys_order()->clear_role();
         e.mutable_keys_order()->set_action(v1::KEYS_ACTION_REVOKE);
       },
       ""},
      {[](auto& e) { e.mutable_keys_order()->set_action(v1::KEYS_ACTION_ROTATE); }, "KeysOrder.role: not set"},
      {[](auto& e) { e.mutable_keys_order()->clear_action(); }, "KeysOrder.action: not set"},
  });
}

TEST(FieldChecks, Workers) {
  Check<Register>({
      {[](auto& e) { e.mutable_register_worker()->set_threads(0); }, "Register.threads: 0 is not in [1, 1024]"},
      {[](auto& e) { e.mutable_register_worker()->set_threads(1025); }, "Register.threads: 1025 is not in [1, 1024]"},
      {[](auto& e) { e.mutable_register_worker()->clear_images_endpoint(); },
       "Register.images_endpoint: a text of 0 bytes, expected 1 to 512"},
      {[](auto& e) { e.mutable_register_worker()->set_host(std::string(257, 'h')); },
       "Register.host: a text of 257 bytes, expected 0 to 256"},
  });
  Check<Welcome>({
      {[](auto& e) { e.mutable_welcome()->set_worker(0); }, "Welcome.worker: 0 is not in [1, 4294967295]"},
      {[](auto& e) { e.mutable_welcome()->set_heartbeat_ms(9); }, "Welcome.heartbeat_ms: 9 is not in [10, 60000]"},
      {[](auto& e) { e.mutable_welcome()->set_timeout_ms(600001); }, "Welcome.timeout_ms: 600001 is not in [100, 600000]"},
  });
  Check<WorkerTrouble>({
      {[](auto& e) { e.mutable_worker_trouble()->clear_status(); }, "WorkerTrouble.status.code: not set"},
      {[](auto& e) { e.mutable_worker_trouble()->mutable_key()->set_group(1024); }, "WorkerTrouble.key.group: 1024 is not in [0, 1023]"},
  });
}

TEST(FieldChecks, ParametersOfOwnerZero) {
  const auto parameter = [](v1::Envelope& e, int i = 0) { return e.mutable_register_owner()->mutable_steered(i); };
  Check<RegisterOwner>({
      {[&](auto& e) { parameter(e)->set_name("2k"); }, "RegisterOwner.steered[0].name: '2k' is no identifier"},
      {[&](auto& e) { parameter(e)->set_name("f-k"); }, "RegisterOwner.steered[0].name: 'f-k' is no identifier"},
      {[&](auto& e) { parameter(e)->set_name(std::string(65, 'k')); }, "RegisterOwner.steered[0].name: a text of 65 bytes"},
      {[&](auto& e) { parameter(e)->set_name(""); }, "RegisterOwner.steered[0].name: a text of 0 bytes, expected 1 to 64"},
      {[&](auto& e) { parameter(e)->set_value(0.2); }, "RegisterOwner.steered[0].value: 0.2 is not in [0, 0.1]"},
      {[&](auto& e) { parameter(e)->set_least(0.2); }, "RegisterOwner.steered[0].value: 0.03 is not in [0.2, 0.1]"},
      {[&](auto& e) { parameter(e)->set_most(INFINITY); }, "RegisterOwner.steered[0].most: inf is not a finite number"},
      {[&](auto& e) { parameter(e, 2)->set_name("feed"); }, "RegisterOwner.steered: two of one name"},
      {[](auto& e) {
         e.mutable_register_owner()->set_owners(2);
         e.mutable_register_owner()->set_owner(1);
       },
       "RegisterOwner.steered: of another owner than 0"},
  });
}

TEST(FieldChecks, EachFieldHasALightVolumeIfTheFrameHasLight) {
  const std::vector<GroupAssignment> samples = Samples<GroupAssignment>();
  const auto of_fields = std::ranges::find_if(samples, [](const GroupAssignment& m) { return m.setup.fields.size() == 2; });
  ASSERT_NE(of_fields, samples.end());
  const v1::Envelope valid = EnvelopeOf<GroupAssignment>(std::size_t(of_fields - samples.begin()));
  const auto error = [&](const std::function<void(v1::FrameSetup&)>& alter) {
    v1::Envelope envelope = valid;
    alter(*envelope.mutable_group_assignment()->mutable_setup());
    return ErrorOf(envelope);
  };
  using Setup = v1::FrameSetup;
  EXPECT_THAT(error([](Setup& s) { s.mutable_fields(1)->clear_light(); }), testing::HasSubstr("setup.fields[1].light: missing"));
  EXPECT_THAT(error([](Setup& s) { s.mutable_fields(1)->mutable_light()->mutable_description()->mutable_size()->set_x(129); }),
              testing::HasSubstr("setup.fields[1].light.description: more voxels than a light volume has"));
  EXPECT_THAT(error([](Setup& s) { *s.mutable_fields(1)->mutable_light() = s.light(); }),
              testing::HasSubstr("setup.fields[1].light.description: of other values than the voxels"));
  const auto without_light = [](Setup& s) {
    s.clear_light();
    s.mutable_shading()->clear_shadows();
    s.mutable_shading()->clear_ambient_occlusion();
    s.mutable_fields(0)->clear_light();
  };
  EXPECT_THAT(error(without_light), testing::HasSubstr("setup.fields[1].light: not expected"));
  EXPECT_EQ(error([&](Setup& s) {
              without_light(s);
              s.mutable_fields(1)->clear_light();
            }),
            "");
}

TEST(FieldChecks, TilesOfShapes) {
  const std::vector<GroupAssignment> samples = Samples<GroupAssignment>();
  const auto with_tiles = std::ranges::find_if(samples, [](const GroupAssignment& m) { return !m.tiles.empty(); });
  ASSERT_NE(with_tiles, samples.end());
  const v1::Envelope valid = EnvelopeOf<GroupAssignment>(std::size_t(with_tiles - samples.begin()));
  const auto error = [&](const std::function<void(v1::GroupAssignment&)>& alter) {
    v1::Envelope envelope = valid;
    alter(*envelope.mutable_group_assignment());
    return ErrorOf(envelope);
  };
  using Group = v1::GroupAssignment;
  EXPECT_THAT(error([](Group& g) { g.mutable_setup()->clear_shapes(); }),
              testing::HasSubstr("tiles: without shapes, or not with the first"));
  EXPECT_THAT(error([](Group& g) { g.mutable_key()->set_group(1); }), testing::HasSubstr("tiles: without shapes, or not with the first"));
  EXPECT_THAT(error([](Group& g) { g.mutable_tiles(0)->set_to(1); }), testing::HasSubstr("tiles[0].to: the sender"));
  EXPECT_THAT(error([](Group& g) { g.mutable_tiles(0)->set_tiles(2, 5); }), testing::HasSubstr("tiles[0].tiles: not ascending numbers"));
  EXPECT_THAT(error([](Group& g) { g.mutable_tiles(0)->set_tiles(2, 1U << 20U); }),
              testing::HasSubstr("tiles[0].tiles: not ascending numbers"));
}

TEST(FieldChecks, Groups) {
  using E = v1::Envelope;
  const auto group = [](E& e) { return e.mutable_group_assignment(); };
  const auto setup = [](E& e) { return e.mutable_group_assignment()->mutable_setup(); };
  const auto camera = [](E& e) { return e.mutable_group_assignment()->mutable_setup()->mutable_camera(); };
  const auto sheets = [](E& e) { return e.mutable_group_assignment()->mutable_setup()->mutable_sheets(); };
  const auto plan = [](E& e) { return e.mutable_group_assignment()->mutable_group(); };
  const auto schedule = [](E& e) { return e.mutable_group_assignment()->mutable_group()->mutable_schedule(); };
  Check<GroupAssignment>({
      {[&](E& e) { group(e)->set_group_count(3); }, "GroupAssignment.group_count: 3 is not in [4, 1024]"},
      {[&](E& e) { group(e)->set_group_count(1025); }, "GroupAssignment.group_count: 1025 is not in [4, 1024]"},
      {[&](E& e) { group(e)->set_first_group(4); }, "GroupAssignment.first_group: 4 is not in [0, 3]"},
      {[&](E& e) { group(e)->set_display(0); }, "GroupAssignment.display: 0 is not in [1, "},
      {[&](E& e) { group(e)->clear_peers(); }, "GroupAssignment.peers: worker 4294967295 is missing"},
      {[&](E& e) { group(e)->mutable_peers(0)->set_worker(77); }, "GroupAssignment.peers: worker 1 is missing"},
      {[&](E& e) { *group(e)->add_peers() = group(e)->peers(0); }, "GroupAssignment.peers: a worker appears twice"},
      {[&](E& e) { group(e)->add_tiles()->set_from(1), group(e)->mutable_tiles(0)->set_to(2); },
       "GroupAssignment.tiles: without shapes, or not with the first group"},
      {[&](E& e) { setup(e)->set_dataset(0); }, "GroupAssignment.setup.dataset: 0 is not in [1, "},
      {[&](E& e) { setup(e)->set_renderer("teapot"); }, "GroupAssignment.setup: renderer is 'teapot', but must be one of: splat, "},
      {[&](E& e) { setup(e)->add_parameters(1); }, "GroupAssignment.setup.parameters: 2 values, expected 1"},
      {[&](E& e) { setup(e)->set_renderer("zbuffer"), setup(e)->clear_parameters(); },
       "GroupAssignment.setup.sheets: not expected by this renderer"},
      {[&](E& e) { setup(e)->set_halo(65536); }, "GroupAssignment.setup.halo: 65536 is not in [0, 65535]"},
      {[&](E& e) { setup(e)->set_termination(0.6); }, "GroupAssignment.setup.termination: 0.6 is not in [0, 0.5]"},
      {[&](E& e) { setup(e)->set_unit(0); }, "GroupAssignment.setup.unit: 0 is not in [1e-300, 1e+300]"},
      {[&](E& e) { setup(e)->set_termination(-1e-9); }, "GroupAssignment.setup.termination: -1e-09 is not in [0, 0.5]"},
      {[&](E& e) { setup(e)->mutable_description()->mutable_size()->set_x(0); },
       "GroupAssignment.setup.description.size.x: 0 is not in [1, 65535]"},
      {[&](E& e) { setup(e)->mutable_description()->add_x_places(1); },
       "GroupAssignment.setup.description.x_places: 1 places of 301 voxels"},
      {[&](E& e) {
         for (int i = 0; i < 301; ++i) setup(e)->mutable_description()->add_x_places(i == 7 ? 5.5 : i);
       },
       "GroupAssignment.setup.description.x_places: place 7 is 5.5, must lie 1e-05 or more above the one before and below 300.5"},
      {[&](E& e) {
         for (int i = 0; i < 301; ++i) setup(e)->mutable_description()->add_x_places(i == 7 ? 7.5 : i);
       },
       "GroupAssignment.setup.renderer: one that draws no rectilinear grid"},
      {[&](E& e) { setup(e)->mutable_description()->mutable_orientation()->clear_unit(); }, ""},
      {[&](E& e) { setup(e)->mutable_description()->mutable_orientation()->set_unit(v1::LENGTH_UNIT_FILE); },
       "setup.description.orientation.unit: none that a file states"},
      {[&](E& e) { setup(e)->mutable_description()->mutable_spacing()->set_z(0); },
       "setup.description.spacing.z: 0 is not a finite number above 0"},
      {[&](E& e) { setup(e)->mutable_range()->set_min(1e31F); }, "GroupAssignment.setup.range: min is above max"},
      {[&](E& e) { setup(e)->mutable_transfer()->clear_colors(); }, "GroupAssignment.setup: "},
      {[&](E& e) { setup(e)->mutable_shading()->mutable_lights(0)->CopyFrom(v1::Vec3()); }, "GroupAssignment.setup: "},
      {[&](E& e) { camera(e)->mutable_x_row()->RemoveLast(); }, "GroupAssignment.setup.camera.x_row: 3 values, expected 4"},
      {[&](E& e) { camera(e)->set_supersample(3); }, "GroupAssignment.setup.camera.supersample: 3 is not a power of two"},
      {[&](E& e) { camera(e)->set_supersample(2048); }, "GroupAssignment.setup.camera.supersample: 2048 is not in [1, 1024]"},
      {[&](E& e) { camera(e)->set_width(0); }, "GroupAssignment.setup.camera.width: 0 is not in [1, "},
      {[&](E& e) { camera(e)->set_height(16385 * camera(e)->supersample()); }, "GroupAssignment.setup.camera.height: "},
      {[&](E& e) { camera(e)->mutable_up()->set_x(camera(e)->up().x() + 2); }, "GroupAssignment.setup.camera.up: not a unit vector"},
      {[&](E& e) { camera(e)->mutable_spacing()->set_x(-1); }, "GroupAssignment.setup.camera.spacing.x: -1 is not a finite number above 0"},
      {[&](E& e) { setup(e)->clear_sheets(); }, "GroupAssignment.setup.sheets: missing"},
      {[&](E& e) { sheets(e)->set_width(0); }, "GroupAssignment.setup.sheets.width: 0 is not in [8, 131072]"},
      {[&](E& e) { sheets(e)->set_width(131080); }, "GroupAssignment.setup.sheets.width: 131080 is not in [8, 131072]"},
      {[&](E& e) { sheets(e)->set_width(sheets(e)->width() + 4); }, "GroupAssignment.setup.sheets.width: not a multiple of 8"},
      {[&](E& e) { sheets(e)->set_height(0); }, "GroupAssignment.setup.sheets.height: 0 is not in [1, 131072]"},
      {[&](E& e) { sheets(e)->set_footprint(3.5); }, "GroupAssignment.setup.sheets.footprint: 3.5 is not in [1, 3]"},
      {[&](E& e) { sheets(e)->set_y_v(-1); }, "GroupAssignment.setup.sheets.y_v: -1 is not in [1e-12, 1e+12]"},
      {[&](E& e) { sheets(e)->set_x_0(NAN); }, "GroupAssignment.setup.sheets.x_0: NaN is not in [-1e+12, 1e+12]"},
      {[&](E& e) { sheets(e)->set_w_c(-1); }, "GroupAssignment.setup.sheets: a slice lies behind the eye"},
      {[&](E& e) { sheets(e)->set_x_u(1e-6); }, "GroupAssignment.setup.sheets: footprints reach beyond the halo"},
      {[&](E& e) { sheets(e)->set_y_v(1e3); }, "GroupAssignment.setup.sheets: a voxel is wider than 24 pixels"},
      {[&](E& e) { sheets(e)->mutable_from_picture()->RemoveLast(); }, "GroupAssignment.setup.sheets.from_picture: 8 values, expected 9"},
      {[&](E& e) { sheets(e)->set_from_picture(4, INFINITY); }, "GroupAssignment.setup.sheets.from_picture[4]: inf is not a finite number"},
      {[&](E& e) { plan(e)->mutable_placements(2)->mutable_box()->mutable_end()->set_z(317); },
       "GroupAssignment.group.placements[2].box: not inside the volume"},
      {[&](E& e) { plan(e)->mutable_placements(0)->mutable_box()->mutable_end()->set_y(0); },
       "GroupAssignment.group.placements[0].box: an empty box"},
      {[&](E& e) { plan(e)->mutable_placements(0)->mutable_box()->mutable_end()->set_y(0xFFFFFFFF); },
       "GroupAssignment.group.placements[0].box.end.y: 4294967295 is not in [0, 65535]"},
      {[&](E& e) { plan(e)->mutable_placements(1)->set_worker(0); }, "GroupAssignment.group.placements[1].worker: 0 is not in [1, "},
      {[&](E& e) { plan(e)->mutable_placements()->RemoveLast(); }, "GroupAssignment.group.schedule.ranks: 3, but there are 2 placements"},
      {[&](E& e) { schedule(e)->set_ranks(65537); }, "GroupAssignment.group.schedule.ranks: 65537 is not in [0, 65536]"},
      {[&](E& e) { schedule(e)->set_roots(0, 3); }, "GroupAssignment.group: schedule.roots has 3, but must be below 3"},
      {[&](E& e) { schedule(e)->set_scheme("glue"); }, "GroupAssignment.group: schedule.scheme: 'glue' is not one of "},
      {[&](E& e) { schedule(e)->clear_scheme(); }, "GroupAssignment.group: schedule.scheme: '' is not one of "},
      {[&](E& e) { schedule(e)->set_scheme(std::string(257, 'x')); }, "GroupAssignment.group.schedule.scheme: "},
  });
}

TEST(FieldChecks, HiddenTiles) {
  constexpr std::size_t kWithMask = 3, kZBuffer = 1;  // of the assignments' samples
  const std::vector<GroupAssignment> samples = Samples<GroupAssignment>();
  const std::int32_t tiles_x = samples[kWithMask].hidden.tiles_x, tiles_y = samples[kWithMask].hidden.tiles_y;
  ASSERT_GT(std::min(tiles_x, tiles_y), 1);
  const auto error = [](GroupAssignment message, std::size_t other_tiles_x = 0) {
    if (other_tiles_x != 0) message.hidden = {std::int32_t(other_tiles_x), 1, std::vector<std::uint8_t>(other_tiles_x)};
    return Decode(Encode(message)).status().message();
  };
  EXPECT_EQ(error(samples[kWithMask]), "");
  EXPECT_EQ(error(samples[kWithMask], std::size_t(tiles_x)), "GroupAssignment.hidden: " + std::to_string(tiles_x) +
                                                                 " x 1 tiles, but the frame has " + std::to_string(tiles_x) + " x " +
                                                                 std::to_string(tiles_y));
  GroupAssignment without_termination = samples[kWithMask];
  without_termination.setup.termination = 0;
  EXPECT_EQ(error(without_termination), "GroupAssignment.setup.front: a front in a frame that uses none");
  without_termination.setup.front = {};
  EXPECT_EQ(error(without_termination), "GroupAssignment.hidden: a mask in a frame that uses none");
  EXPECT_EQ(error(samples[kZBuffer], 40), "GroupAssignment.hidden: a mask in a frame that uses none");
  GroupAssignment first = samples[kWithMask];
  first.key.group = first.first_group = 0;
  EXPECT_EQ(error(first), "GroupAssignment.hidden: a mask for the first group, in front of which there is nothing");

  // 5 x 3 tiles: 15 bits in 2 bytes.
  const auto mask = [](v1::Envelope& e) {
    v1::OcclusionMask* hidden = e.mutable_group_done()->mutable_hidden();
    hidden->set_tiles_x(5);
    hidden->set_tiles_y(3);
    hidden->set_hidden(std::string("\xFF\x7F"));
    return hidden;
  };
  Check<GroupDone>({
      {[&](auto& e) { mask(e); }, ""},
      {[&](auto& e) { mask(e)->set_hidden("\xFF\xFF"); }, "GroupDone.hidden.hidden: a bit beyond the last tile"},
      {[&](auto& e) { mask(e)->set_hidden("\xFF"); }, "GroupDone.hidden.hidden: a text of 1 bytes, expected 2 to 2"},
      {[&](auto& e) { mask(e)->set_hidden("123"); }, "GroupDone.hidden.hidden: a text of 3 bytes, expected 2 to 2"},
      {[&](auto& e) { mask(e)->clear_hidden(); }, "GroupDone.hidden.hidden: a text of 0 bytes, expected 2 to 2"},
      {[&](auto& e) { mask(e)->set_tiles_x(16385); }, "GroupDone.hidden.tiles_x: 16385 is not in [0, 16384]"},
      {[&](auto& e) { mask(e)->set_tiles_y(16385); }, "GroupDone.hidden.tiles_y: 16385 is not in [1, 16384]"},
      {[&](auto& e) { mask(e)->set_tiles_y(0); }, "GroupDone.hidden.tiles_y: 0 is not in [1, 16384]"},
      {[&](auto& e) { mask(e)->set_tiles_x(0); }, "GroupDone.hidden.tiles_y: 3 is not in [0, 0]"},
      {[&](auto& e) { e.mutable_group_done()->clear_hidden(); }, ""},
  });
}

TEST(FieldChecks, Chunks) {
  Check<ChunkRequest>({
      {[](auto& e) { e.mutable_chunk_request()->clear_box(); }, "ChunkRequest.box: an empty box"},
      {[](auto& e) { e.mutable_chunk_request()->mutable_box()->mutable_end()->set_x(65536); },
       "ChunkRequest.box.end.x: 65536 is not in [0, 65535]"},
      {[](auto& e) { e.mutable_chunk_request()->set_chunk(3); },
       "ChunkRequest.chunk: 3 is not in [0, 0]"},  // a voxel has at most three samples
  });
  Check<Chunk>({
      {[](auto& e) { e.mutable_chunk()->set_raw_bytes(0); }, "Chunk.encoded_bytes: 1 is not in [0, 0]"},
      {[](auto& e) { e.mutable_chunk()->set_raw_bytes(kChunkBytes + 1); }, "Chunk.raw_bytes: 1048577 is not in [0, 1048576]"},
      {[](auto& e) { e.mutable_chunk()->set_encoded_bytes(2); }, "Chunk.encoded_bytes: 2 is not in [1, 1]"},
      {[](auto& e) { e.mutable_chunk()->set_encoded_bytes(0); }, "Chunk.encoded_bytes: 0 is not in [1, 1]"},
  });
  Check<ChunkRefused>({{[](auto& e) { e.mutable_chunk_refused()->clear_status(); }, "ChunkRefused.status.code: not set"}});
}

TEST(FieldChecks, Images) {
  // 30 x 40 = 1200 pixels at (0, 0).
  const auto image = [](v1::Envelope& e) {
    v1::RunImageHeader* header = e.mutable_partial_image()->mutable_image();
    header->mutable_bounds()->set_x_end(30);
    header->mutable_bounds()->set_y_end(40);
    header->set_run_count(10);
    header->set_pixel_count(1200);
    header->set_color(v1::COLOR_CODING_FLOAT32);
    return header;
  };
  const auto packed = [](v1::Envelope& e, v1::Codec codec, std::uint64_t bytes) {
    e.mutable_partial_image()->mutable_packed()->set_codec(codec);
    e.mutable_partial_image()->mutable_packed()->set_bytes(bytes);
  };
  Check<ImageReceived>({
      {[](auto& e) { e.mutable_image_received()->set_number(0); }, "ImageReceived.number: 0 is not in [1, 18446744073709551615]"},
  });
  const auto tiles = [](v1::Envelope& e) { return e.mutable_shape_tiles(); };
  Check<ShapeTiles>({
      {[&](auto& e) { tiles(e)->clear_tiles(), tiles(e)->clear_bytes(); }, "ShapeTiles.tiles: none"},
      {[&](auto& e) { tiles(e)->add_bytes(4); }, "ShapeTiles.bytes: 2 of 1 tiles"},
      {[&](auto& e) { tiles(e)->add_tiles(0), tiles(e)->add_bytes(4); }, "ShapeTiles.tiles: not ascending"},
      {[&](auto& e) { tiles(e)->set_bytes(0, 1U << 31U), tiles(e)->add_tiles(1), tiles(e)->add_bytes(4); },
       "ShapeTiles.bytes: 2147483652 in all, at most 2147483648"},
  });
  Check<PartialImage>({
      {[&](auto& e) { image(e); }, ""},
      {[&](auto& e) { image(e)->set_pixel_count(1201); }, "PartialImage.image.pixel_count: 1201 is not in [0, 1200]"},
      {[&](auto& e) { image(e)->set_run_count(1201); }, "PartialImage.image.run_count: 1201 is not in [0, 1200]"},
      {[&](auto& e) { image(e)->set_run_count(0); }, ""},  // dense
      {[&](auto& e) {
         v1::RunImageHeader* header = image(e);
         header->set_pixel_count(1199);
         header->set_run_count(0);
       },
       "PartialImage.image.run_count: 0 is not in [1, 1199]"},
      {[&](auto& e) { image(e)->set_pixel_count(0); }, "PartialImage.image.run_count: 10 is not in [0, 0]"},
      {[&](auto& e) { image(e)->mutable_bounds()->set_x_begin(31); }, "PartialImage.image.bounds.x_end: 30 is not in [31, 16777216]"},
      {[&](auto& e) { image(e)->mutable_bounds()->set_y_end(1U << 25U); },
       "PartialImage.image.bounds.y_end: 33554432 is not in [0, 16777216]"},
      {[&](auto& e) {
         v1::RunImageHeader* header = image(e);
         header->mutable_bounds()->set_x_end(1U << 24U);
         header->mutable_bounds()->set_y_end(1U << 24U);
         header->set_pixel_count(std::uint64_t{1} << 48U);
       },
       "PartialImage.image.pixel_count: a payload of 4503599627370616 bytes, at most 2147483648"},
      {[&](auto& e) {
         image(e);
         packed(e, v1::CODEC_ZSTD, 10 * 12 + 1200 * 16 - 1);
       },
       ""},
      {[&](auto& e) {
         image(e);
         packed(e, v1::CODEC_ZSTD, 10 * 12 + 1200 * 16);
       },
       "PartialImage.packed.bytes: 19320 are not less than the 19320 of the runs"},
      {[&](auto& e) {
         image(e);
         packed(e, v1::CODEC_ZSTD, 0);
       },
       "PartialImage.packed.bytes: 0 is not in [1, 2147483647]"},
      {[&](auto& e) {
         image(e);
         packed(e, v1::CODEC_RAW, 1);
       },
       "PartialImage.packed.codec: raw, of packed runs"},
      {[&](auto& e) { packed(e, v1::CODEC_ZSTD, 1); }, "PartialImage.packed.bytes: 1 are not less than the 0 of the runs"},
      {[](auto& e) { e.mutable_partial_image()->mutable_shared(); }, "PartialImage.shared.arena: 0 is not in [1, 18446744073709551615]"},
      {[](auto& e) { e.mutable_partial_image()->set_interval_end(0); }, "PartialImage.interval_end: 0 is not in [1, 65536]"},
      {[](auto& e) { e.mutable_partial_image()->set_step((1U << 20U) + 1); }, "PartialImage.step: 1048577 is not in [0, 1048576]"},
      {[](auto& e) { e.mutable_partial_image()->mutable_image()->set_format(v1::PIXEL_FORMAT_RGBA_DEPTH); },
       "PartialImage.image.format: that of a finished picture"},
      {[](auto& e) { e.mutable_partial_image()->mutable_pixels()->set_begin(1); }, "PartialImage.pixels.end: 0 is not in [1, "},
  });
  Check<FrameImage>({
      {[](auto& e) { e.mutable_frame_image()->set_group_count(0); }, "FrameImage.group_count: 0 is not in [1, 1024]"},
      {[](auto& e) { e.mutable_frame_image()->set_groups_done(2); }, "FrameImage.groups_done: 2 is not in [0, 1]"},
      {[](auto& e) { e.mutable_frame_image()->mutable_picture()->mutable_runs()->set_encoded_bytes(1); },
       "FrameImage.picture.runs.encoded_bytes: 1 is not in [0, 0]"},
      {[](auto& e) { e.mutable_frame_image()->mutable_picture()->mutable_runs()->set_codec(v1::CODEC_ZSTD); },
       "FrameImage.picture.runs.encoded_bytes: 0 is not in [1, 0]"},
  });
}

TEST(FieldChecks, Clients) {
  const auto frame = [](v1::Envelope& e) { return e.mutable_submit_frame()->mutable_frame(); };
  Check<SubmitFrame>({
      {[](auto& e) { e.mutable_submit_frame()->set_deadline_ms(0); }, "SubmitFrame.deadline_ms: 0 is not in [1, 86400000]"},
      {[](auto& e) { e.mutable_submit_frame()->clear_frame(); }, "SubmitFrame.frame.dataset: a text of 0 bytes, expected 1 to 256"},
      {[&](auto& e) { frame(e)->mutable_size()->set_width(0); }, "SubmitFrame.frame.size.width: 0 is not in [1, 16384]"},
      {[&](auto& e) { frame(e)->mutable_size()->set_height(0x80000000); },
       "SubmitFrame.frame.size.height: 2147483648 is not in [1, 16384]"},
      {[&](auto& e) { frame(e)->mutable_view()->set_fov_degrees(90); }, "SubmitFrame.frame: view.fov"},
      {[&](auto& e) { frame(e)->mutable_transfer()->clear_choice(); }, ""},
      {[&](auto& e) { frame(e)->mutable_transfer()->mutable_function(); }, "SubmitFrame.frame"},  // without points
      {[&](auto& e) { frame(e)->mutable_transfer()->set_opacity_distance(0); }, "SubmitFrame.frame: transfer.opacity_distance"},
      {[&](auto& e) { frame(e)->mutable_shading()->set_shininess(0); }, "SubmitFrame.frame: shading.shininess"},
      {[&](auto& e) { frame(e)->mutable_shading()->set_shadows(1.5); },
       "SubmitFrame.frame: shading.shadows is 1.5, but must lie in [0, 1]"},
      {[&](auto& e) { frame(e)->set_termination(0.75); }, "SubmitFrame.frame: termination"},
      {[&](auto& e) { frame(e)->mutable_policy()->set_groups(1025); }, "SubmitFrame.frame.policy.groups: 1025 is not in [0, 1024]"},
      {[&](auto& e) { frame(e)->mutable_policy()->set_teams(1025); }, "SubmitFrame.frame.policy.teams: 1025 is not in [1, 1024]"},
      {[&](auto& e) { frame(e)->mutable_policy()->set_teams(0); }, "SubmitFrame.frame.policy.teams: 0 is not in [1, 1024]"},
      {[&](auto& e) { frame(e)->mutable_policy()->clear_combine(); }, ""},
      {[&](auto& e) { frame(e)->mutable_policy()->clear_teams(); }, ""},
      {[&](auto& e) { frame(e)->clear_view(); }, ""},
      {[&](auto& e) { frame(e)->clear_dataset(); }, "SubmitFrame.frame.dataset: a text of 0 bytes, expected 1 to 256"},
  });
  const auto geometry = [](auto& e) { return e.mutable_frame_reply()->mutable_geometry(); };
  Check<FrameReply>({
      {[](auto& e) { e.mutable_frame_reply()->clear_size(); }, "FrameReply.size.width: 0 is not in [1, 16384]"},
      {[](auto& e) {
         v1::EncodedRuns* runs = e.mutable_frame_reply()->mutable_shares(0)->mutable_runs();
         runs->mutable_image()->mutable_bounds()->set_x_end(2);
         runs->mutable_image()->mutable_bounds()->set_y_end(1);
       },
       "FrameReply.shares[0].runs.image.bounds: not inside the picture"},
      {[&](auto& e) { geometry(e)->clear_world(); }, "FrameReply.geometry.world: not set"},
      {[&](auto& e) { geometry(e)->set_unit(v1::LengthUnit(9)); }, "FrameReply.geometry.unit: unknown value 9"},
      {[&](auto& e) { geometry(e)->clear_projection(); }, "FrameReply.geometry.projection: not set"},
      {[&](auto& e) { geometry(e)->mutable_right()->set_x(1.1); },
       "FrameReply.geometry.right: not of three right-handed unit vectors at right angles"},
      {[&](auto& e) { geometry(e)->mutable_forward()->set_y(-1); },
       "FrameReply.geometry.right: not of three right-handed unit vectors at right angles"},
      {[&](auto& e) { geometry(e)->set_pixel_size(0); }, "FrameReply.geometry.pixel_size: 0 is not a finite number above 0"},
      {[&](auto& e) { geometry(e)->set_target_depth(-1); }, ""},
      {[&](auto& e) {
         geometry(e)->set_target_depth(-1);
         geometry(e)->set_projection(v1::PROJECTION_PERSPECTIVE);
       },
       "FrameReply.geometry.target_depth: -1 is not a finite number above 0"},
      {[](auto& e) { e.mutable_frame_reply()->clear_geometry(); }, "FrameReply.geometry.world: not set"},
      {[](auto& e) {
         e.mutable_frame_reply()->set_groups_done(e.frame_reply().group_count());
         e.mutable_frame_reply()->clear_statistics();
       },
       "FrameReply: renderer is '', but must be one of: splat, "},
  });
  Check<FrameProgress>(
      {{[](auto& e) { e.mutable_frame_progress()->set_groups_done(1); }, "FrameProgress.groups_done: 1 is not in [0, 0]"}});
  Check<FrameFailed>({{[](auto& e) { e.mutable_frame_failed()->mutable_status()->set_code(v1::StatusCode(9)); },
                       "FrameFailed.status.code: unknown value 9"}});
  const auto order = [](v1::Envelope& e) { return e.mutable_data_order(); };
  Check<DataOrder>({
      {[&](auto& e) { order(e)->set_action(v1::DataAction(0)); }, "DataOrder.action: not set"},
      {[&](auto& e) { order(e)->set_action(v1::DataAction(5)); }, "DataOrder.action: unknown value 5"},
      {[&](auto& e) { order(e)->add_items(""); }, "DataOrder.items[0]: a text of 0 bytes, expected 1 to 5120"},
      {[&](auto& e) { order(e)->add_items(std::string(5121, '/')); }, "DataOrder.items[0]: a text of 5121 bytes, expected 1 to 5120"},
      {[&](auto& e) {
         for (int i = 0; i < 129; ++i) order(e)->add_items("a");
       },
       "DataOrder.items: 129 items, at most 128"},
  });
}

}  // namespace
}  // namespace slabstream
