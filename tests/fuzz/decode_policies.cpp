// Requests made of texts that a user types: the policy's names, the renderer and one of its parameters.
//
// input: u8 axis, u16 groups, u16 teams, then lines: renderer, parameter, its value, decomposition, load metric, assignment, balance,
// combine
#include "common/planning/resolved_policy.h"
#include "common/renderers/registry.h"
#include "common/wire/any_message.h"
#include "common/wire/validate_request.h"
#include "tests/fuzz/decoders.h"
#include "tests/support/random_combining.h"

namespace slabstream {

bool DecodePolicy(std::span<const std::byte> bytes) {
  FuzzInput input(bytes);
  FrameRequest request;
  request.dataset = "brain";
  request.policy.axis = AxisChoice(input.Take<std::uint8_t>());
  request.policy.groups = std::int16_t(input.Take<std::uint16_t>());
  request.policy.teams = std::int16_t(input.Take<std::uint16_t>());
  request.renderer = input.TakeLine();
  const std::string parameter = input.TakeLine(), value = input.TakeLine();
  if (!parameter.empty()) request.parameters[parameter] = value;
  for (std::string* name : {&request.policy.decomposition, &request.policy.balance_by, &request.policy.assignment, &request.policy.balance,
                            &request.policy.combine})
    *name = input.TakeLine();
  const VolumeGeometry geometry{.size = {64, 32, 40}};

  const Status names = CheckNames(request.policy);
  if (!Validate(request).ok() || !names.ok()) return false;
  // What is valid travels unchanged.
  const AnyMessage message = SubmitFrame{.request = 1, .frame = request};
  const Result<AnyMessage> received = Decode(Encode(message));
  CHECK(received.ok()) << received.status().message();
  CHECK(*received == message);

  (void)NeedsOccupancy(request.policy);
  const ResolvedPolicy policy = ResolvePolicy(SettledPolicy(request, geometry), geometry);
  CHECK(policy.decomposition->name == request.policy.decomposition && NameOf(policy.balance_by) == BalanceByOf(request.policy));
  return true;
}

std::vector<FuzzBytes> PolicySeeds() {
  Random random(44);
  std::vector<FuzzBytes> seeds;
  const auto one_of = [&](const auto& entries) { return std::string(entries[random.Integer<std::size_t>(0, entries.size() - 1)].name); };
  for (const RendererKind* renderer : Renderers()) {
    std::string parameter = "\n\n";
    for (const RendererParameter& p : renderer->parameters())
      parameter = std::string(p.name) + "\n" + (p.choices.empty() ? "1" : std::string(p.choices.front())) + "\n";
    for (int i = 0; i < 8; ++i) {
      FuzzSeed seed;
      seed.Put(std::uint8_t(random.Integer(0, 4))).Put(std::uint16_t(random.Integer(0, 9))).Put(std::uint16_t(random.Integer(1, 3)));
      seed.Put(std::string(renderer->name()) + "\n" + parameter);
      seed.Put(one_of(Decompositions()) + "\n" + one_of(BalanceByChoices()) + "\n");
      seed.Put(one_of(Assignments()) + "\n" + one_of(Balances()) + "\n");
      seeds.push_back(seed.Put(i == 0 ? std::string() : RandomCombining(random)).bytes());
    }
  }
  return seeds;
}

}  // namespace slabstream
