// Which machine a service is, as far as its coordinator can tell.
#include "coordinator/tuning/service_machine.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "common/calibration/calibration.h"

namespace slabstream {
namespace {

ServiceSurroundings Surroundings(const LinkModel& link) { return {.link = link, .memory_scope = 7, .cores = 4}; }

TEST(ServiceMachine, WorkersOfOneHostLendTheirImagesAndShareItsCores) {
  const LinkModel slow{Contention::kSharedBus, 1e-3, 1e6};
  const std::vector<HostedWorker> workers(3, {.memory_scope = 7, .threads = 2});
  const MachineModel machine = ServiceMachine(workers, Surroundings(slow));
  EXPECT_TRUE(Validate(machine).ok());
  EXPECT_EQ(machine.link.contention, Contention::kNone);
  EXPECT_EQ(machine.combining.rgba_bytes, 0) << "pixels travel although they are lent";
  EXPECT_EQ(machine.workers_a_host, 3);
  EXPECT_EQ(machine.cores_a_host, 4);
  EXPECT_EQ(machine.threads, 2);
}

TEST(ServiceMachine, OneThatDoesNotLendMakesImagesOfTheHostTravel) {
  const LinkModel slow{Contention::kSharedBus, 1e-3, 1e6};
  std::vector<HostedWorker> workers(3, {.memory_scope = 7, .threads = 2});
  const MachineModel lent = ServiceMachine(workers, Surroundings(slow));
  workers[1].lends_memory = false;
  const MachineModel machine = ServiceMachine(workers, Surroundings(slow));
  EXPECT_TRUE(Validate(machine).ok());
  EXPECT_EQ(machine.combining.rgba_bytes, MachineModel().combining.rgba_bytes);
  EXPECT_GT(machine.combining.encode_pixel, 0);
  EXPECT_LT(machine.link.bytes_per_second, lent.link.bytes_per_second);
  EXPECT_EQ(machine.link.contention, Contention::kNone) << "within the host, not over the link between hosts";
  EXPECT_EQ(machine.workers_a_host, 3);
  EXPECT_EQ(machine.cores_a_host, 4);
}

TEST(ServiceMachine, EncryptionCostsWhateverIsSentAndNoLentImages) {
  std::vector<HostedWorker> workers(2, {.memory_scope = 7, .threads = 1});
  for (const bool lends : {true, false}) {
    workers[1].lends_memory = lends;
    for (const std::uint64_t scope : {7, 8}) {
      workers[1].memory_scope = scope;
      ServiceSurroundings surroundings = Surroundings(ParseLink("link", "10gbit").value());
      const MachineModel plain = ServiceMachine(workers, surroundings);
      EXPECT_EQ(plain.combining.cipher_byte, 0);
      surroundings.encrypted = true;
      EXPECT_EQ(ServiceMachine(workers, surroundings).link, plain.link);
      const bool lent = lends && scope == 7;
      EXPECT_EQ(ServiceMachine(workers, surroundings).combining.cipher_byte, lent ? 0 : calibration::service::kCipherByte)
          << lends << scope;
    }
  }
}

TEST(ServiceMachine, WorkersOfOneProcessMakePicturesTogether) {
  std::vector<HostedWorker> workers(3, {.memory_scope = 7, .threads = 1, .pid = 99});
  EXPECT_EQ(ServiceMachine(workers, Surroundings({})).picture_threads, 3);
  workers[1].pid = 98;
  EXPECT_LE(ServiceMachine(workers, Surroundings({})).picture_threads, 1);
}

TEST(ServiceMachine, AnotherHostThanTheCoordinatorsHasTheCoresThatItsWorkersUse) {
  const std::vector<HostedWorker> workers(3, {.memory_scope = 8, .threads = 2});
  EXPECT_EQ(ServiceMachine(workers, Surroundings({})).cores_a_host, 6);
}

TEST(ServiceMachine, WorkersOfDifferentOrUnknownHostsSendImagesOverTheLink) {
  const LinkModel link = ParseLink("link", "1gbit").value();
  for (const std::uint64_t scope : {std::uint64_t{0}, std::uint64_t{8}}) {
    const std::vector<HostedWorker> workers = {{.memory_scope = scope, .threads = 4}, {.memory_scope = scope == 0 ? 0U : 7U, .threads = 1}};
    const MachineModel machine = ServiceMachine(workers, Surroundings(link));
    EXPECT_TRUE(Validate(machine).ok());
    EXPECT_EQ(machine.link, link);
    EXPECT_GT(machine.combining.rgba_bytes, 0);
    EXPECT_EQ(machine.workers_a_host, 0);
    EXPECT_EQ(machine.threads, 1) << "the slowest worker counts";
  }
}

TEST(ServiceMachine, NobodyIsAMachineToo) { EXPECT_TRUE(Validate(ServiceMachine({}, {})).ok()); }

}  // namespace
}  // namespace slabstream
